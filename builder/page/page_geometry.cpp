#include "builder/page/page_geometry.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include <glm/common.hpp>

#include "builder/page/cell_overlap.h"
#include "octree/surface/leaf_math.h"

namespace vcp {

namespace {

// Two triangles that meet at an edge with a sharper turn than this are not one sheet for a certificate.
constexpr double kCreaseCosine = 0.35;

// Batches measure distances except for their last bits: this factor leaves room for exact measuring to decide.
constexpr double kBatchDistance = 1 + 1e-9;

// Distances to triangles' centres are in float, of coordinates up to some hundred cells; this is room for rounding.
constexpr float kBallRounding = 1e-3f;

/// How often an edge occurs, and where it did first: a table with linear probing.
class EdgeTable {
public:
    struct Slot {
        uint64_t edge = 0;  ///< smaller vertex in the high word; no edge is 0
        uint32_t firstUse = 0;
        uint8_t uses = 0;  ///< 3: three or more
        bool good = false;
    };
    static_assert(sizeof(Slot) == 16);

    explicit EdgeTable(size_t edges) : slots_(std::bit_ceil(edges * 4 / 3 + 2)) {}

    uint32_t find(uint32_t a, uint32_t b) {
        const uint64_t edge = uint64_t{std::min(a, b)} << 32 | std::max(a, b);
        const size_t mask = slots_.size() - 1;
        size_t i = (edge * 0x9e3779b97f4a7c15u) >> 32 & mask;
        while (slots_[i].edge != edge && slots_[i].edge != 0) i = (i + 1) & mask;
        slots_[i].edge = edge;
        return uint32_t(i);
    }
    Slot& operator[](uint32_t i) { return slots_[i]; }

private:
    std::vector<Slot> slots_;
};

}  // namespace

PageGeometry::PageGeometry(const LatticeMesh& mesh, std::span<const uint32_t> triangles, glm::u32vec3 page,
                           uint32_t log2Cells)
    : mesh_(mesh),
      numbers_(triangles),
      cells_(1 << log2Cells),
      origin_(glm::i32vec3(page) * (kLatticePerCell << log2Cells)) {
    loadTriangles();
    markBadEdges();
    fillCells();
}

void PageGeometry::loadTriangles() {
    triangles_.reserve(numbers_.size());
    vertices_.reserve(numbers_.size());
    for (const uint32_t k : numbers_) {
        Triangle t{};
        for (int i = 0; i < 3; ++i)
            t.corners[i] = glm::vec3(mesh_.positions[mesh_.triangles[k][i]] - origin_) / float(kLatticePerCell);
        const Triangle3 c = cornersOf(t);
        t.normal = glm::vec3(glm::normalize(glm::cross(c[1] - c[0], c[2] - c[0])));
        t.centre = (t.corners[0] + t.corners[1] + t.corners[2]) / 3.0f;
        for (const glm::vec3& corner : t.corners) t.radius = std::max(t.radius, glm::distance(corner, t.centre));
        triangles_.push_back(t);
        vertices_.push_back(mesh_.triangles[k]);
    }
    stamp_.assign(triangles_.size(), 0);
    const size_t side = size_t(cells_) + 1;
    gridCorner_.assign(side * side * side, 0);
}

void PageGeometry::markBadEdges() {
    EdgeTable table(vertices_.size() * 3);
    std::vector<std::array<uint32_t, 3>> slots(vertices_.size());
    for (uint32_t k = 0; k < vertices_.size(); ++k)
        for (uint32_t i = 0; i < 3; ++i) {
            const uint32_t a = vertices_[k][i], b = vertices_[k][(i + 1) % 3];
            slots[k][i] = table.find(a, b);
            EdgeTable::Slot& slot = table[slots[k][i]];
            slot.uses = uint8_t(std::min(slot.uses + 1, 3));
            if (slot.uses == 1) slot.firstUse = 4 * k + i;
            slot.good = false;
            if (slot.uses != 2) continue;
            // Oriented by the shared edge, both normals agree where the surface continues, and oppose at a fold.
            const uint32_t first = slot.firstUse / 4;
            const bool sameDirection = vertices_[first][slot.firstUse % 4] == a;
            slot.good = (sameDirection ? -1 : 1) * double(glm::dot(triangles_[first].normal, triangles_[k].normal)) >=
                        kCreaseCosine;
        }
    for (uint32_t k = 0; k < vertices_.size(); ++k)
        for (int i = 0; i < 3; ++i) triangles_[k].badEdges |= uint8_t((table[slots[k][i]].good ? 0u : 1u) << i);
}

void PageGeometry::fillCells() {
    const int side = cells_ + 2 * kBorder;
    const size_t cellCount = size_t(side) * side * side;
    struct Entry {
        uint32_t list, triangle;
    };
    std::vector<Entry> entries;
    entries.reserve(triangles_.size() * 8);
    std::vector<uint8_t> met;
    listBegin_.assign(2 * cellCount + 2, 0);
    const auto add = [&](glm::ivec3 cell, uint32_t triangle, bool touches) {
        const size_t list = 2 * cellIndex(cell) + (touches ? 0 : 1);
        entries.push_back({uint32_t(list), triangle});
        ++listBegin_[list + 2];
        return touches && std::min({cell.x, cell.y, cell.z}) >= 0 && std::max({cell.x, cell.y, cell.z}) < cells_;
    };
    for (uint32_t k = 0; k < triangles_.size(); ++k) {
        const CellOverlap overlap(cornersOf(triangles_[k]), kCertificateMarginCells);
        const glm::ivec3 low = glm::max(overlap.lower(), -kBorder),
                         high = glm::min(overlap.upper(), cells_ + kBorder - 1);
        if (low.x > high.x || low.y > high.y || low.z > high.z) continue;
        overlap.classify(low, high, met);
        bool touchesPage = false;
        const uint8_t* how = met.data();
        for (int z = low.z; z <= high.z; ++z)
            for (int y = low.y; y <= high.y; ++y)
                for (int x = low.x; x <= high.x; ++x, ++how)
                    if (*how) touchesPage |= add({x, y, z}, k, *how == CellOverlap::kTouches);
        if (touchesPage) stray_ = std::max(stray_, double(mesh_.stray[numbers_[k]]));
    }
    // Counts are two places further on: after the sums, place list + 1 holds where the list's next entry goes.
    for (size_t i = 2; i < listBegin_.size(); ++i) listBegin_[i] += listBegin_[i - 1];
    cellTriangles_.resize(entries.size());
    for (const Entry& e : entries) cellTriangles_[listBegin_[e.list + 1]++] = e.triangle;
}

void PageGeometry::trianglesOf(const NodeBox& box, std::vector<uint32_t>& around, std::vector<uint32_t>& inside) {
    around.clear();
    inside.clear();
    const glm::ivec3 low = box.lower / kSubcells, high = low + box.edge / kSubcells - 1;
    ++stampNow_;
    for (int z = low.z; z <= high.z; ++z)
        for (int y = low.y; y <= high.y; ++y)
            for (int x = low.x; x <= high.x; ++x) {
                const CellTriangles cell = trianglesOf({x, y, z});
                for (const uint32_t k : cell.around)
                    if (stamp_[k] != stampNow_) {
                        stamp_[k] = stampNow_;
                        around.push_back(k);
                    }
                inside.insert(inside.end(), cell.inside.begin(), cell.inside.end());
            }
    std::sort(around.begin(), around.end());
    std::sort(inside.begin(), inside.end());
    inside.erase(std::unique(inside.begin(), inside.end()), inside.end());
}

void PageGeometry::filter(const NodeBox& box, std::span<const uint32_t> candidates, std::vector<uint32_t>& around,
                          std::vector<uint32_t>& inside) const {
    around.clear();
    inside.clear();
    const double half = box.edgeCells() / 2;
    for (const uint32_t k : candidates) {
        const BoxOverlap overlap(cornersOf(triangles_[k]));
        if (!overlap.test(box.centreCells(), half + kCertificateMarginCells)) continue;
        around.push_back(k);
        if (overlap.test(box.centreCells(), half)) inside.push_back(k);
    }
}

void PageGeometry::split(const NodeBox& box, std::span<const uint32_t> candidates, ChildTriangles& children) const {
    for (auto* lists : {&children.around, &children.inside})
        for (std::vector<uint32_t>& list : *lists) list.clear();
    // The box is scaled so that its children are unit cells.
    const glm::dvec3 lower = box.lowerCells();
    const double scale = 2 / box.edgeCells();
    std::vector<uint8_t> met;
    for (const uint32_t k : candidates) {
        Triangle3 t = cornersOf(triangles_[k]);
        for (glm::dvec3& corner : t) corner = (corner - lower) * scale;
        const CellOverlap overlap(t, kCertificateMarginCells * scale);
        const glm::ivec3 low = glm::max(overlap.lower(), 0), high = glm::min(overlap.upper(), 1);
        if (low.x > high.x || low.y > high.y || low.z > high.z) continue;
        overlap.classify(low, high, met);
        const uint8_t* how = met.data();
        for (int z = low.z; z <= high.z; ++z)
            for (int y = low.y; y <= high.y; ++y)
                for (int x = low.x; x <= high.x; ++x, ++how) {
                    const size_t child = size_t(x + 2 * y + 4 * z);
                    if (*how) children.around[child].push_back(k);
                    if (*how == CellOverlap::kTouches) children.inside[child].push_back(k);
                }
    }
}

const CornerVector& PageGeometry::corner(glm::ivec3 subcells) {
    const glm::ivec3 cell = subcells / kSubcells;
    const size_t side = size_t(cells_) + 1;
    uint32_t& number =
        cell * kSubcells == subcells
            ? gridCorner_[cell.x + side * (cell.y + side * cell.z)]
            : subcellCorner_[uint64_t(subcells.x) | uint64_t(subcells.y) << 20 | uint64_t(subcells.z) << 40];
    if (number == 0) {
        corners_.push_back(searchCorner(glm::dvec3(subcells) / double(kSubcells)));
        number = uint32_t(corners_.size());
    }
    return corners_[number - 1];
}

double PageGeometry::measureFound(glm::dvec3 p, size_t first, double least) {
    const glm::vec3 query(p);
    float reach = float(std::min(std::sqrt(least), 1e9));
    for (size_t i = first; i < found_.size(); ++i) {
        const Triangle& t = triangles_[found_[i].triangle];
        const float distance = glm::distance(query, t.centre);
        found_[i].least = distance - t.radius - kBallRounding;
        reach = std::min(reach, distance + kBallRounding);
    }
    TriangleBatch batch;
    uint32_t at[TriangleBatch::kSize];
    for (size_t i = first; i < found_.size();) {
        size_t count = 0;
        for (; i < found_.size() && count < TriangleBatch::kSize; ++i) {
            if (found_[i].least > reach) continue;
            const float* corners = &triangles_[found_[i].triangle].corners[0].x;
            for (int c = 0; c < 9; ++c) batch.corners[c][count] = corners[c];
            at[count++] = uint32_t(i);
        }
        for (size_t k = count; k > 0 && k < TriangleBatch::kSize; ++k)
            for (auto& corners : batch.corners) corners[k] = corners[0];
        if (count == 0) break;
        squaredDistances(p, batch);
        for (size_t k = 0; k < count; ++k) {
            found_[at[k]].squared = batch.squared[k];
            least = std::min(least, batch.squared[k]);
        }
        reach = std::min(reach, float(std::sqrt(least)) + kBallRounding);
    }
    return least;
}

CornerVector PageGeometry::searchCorner(glm::dvec3 p) {
    double least = 1e300;
    found_.clear();
    ++stampNow_;
    glm::ivec3 doneLow(0), doneHigh(-1);  // cells already looked at
    for (double radius = 0.25;; radius = radius < 1 ? 2 * radius : radius + 1) {
        // The cells that a ball of `radius` about p meets.
        const glm::ivec3 low = glm::max(glm::ivec3(glm::floor(p - radius)), -kBorder);
        const glm::ivec3 high = glm::min(glm::ivec3(glm::ceil(p + radius)) - 1, cells_ + kBorder - 1);
        if (low == doneLow && high == doneHigh && least > radius * radius) continue;
        const size_t before = found_.size();
        for (int z = low.z; z <= high.z; ++z)
            for (int y = low.y; y <= high.y; ++y)
                for (int x = low.x; x <= high.x; ++x) {
                    if (x >= doneLow.x && x <= doneHigh.x && y >= doneLow.y && y <= doneHigh.y && z >= doneLow.z &&
                        z <= doneHigh.z) {
                        x = doneHigh.x;
                        continue;
                    }
                    for (const uint32_t k : trianglesOf({x, y, z}).inside)
                        if (stamp_[k] != stampNow_) {
                            stamp_[k] = stampNow_;
                            found_.push_back({k, 0, 1e300});
                        }
                }
        least = measureFound(p, before, least);
        const bool whole = low == glm::ivec3(-kBorder) && high == glm::ivec3(cells_ + kBorder - 1);
        if (least <= radius * radius || whole) break;
        doneLow = low;
        doneHigh = high;
    }
    ClosestPoint best;
    best.squared = 1e300;
    uint32_t bestTriangle = 0;
    for (const Found& f : found_) {
        if (f.squared > least * kBatchDistance) continue;
        const ClosestPoint c = closestOnTriangle(p, cornersOf(triangles_[f.triangle]));
        if (c.squared < best.squared || (c.squared == best.squared && f.triangle < bestTriangle)) {
            best = c;
            bestTriangle = f.triangle;
        }
    }
    CornerVector corner;
    corner.distance = std::sqrt(best.squared);
    if (best.squared > 0) {
        corner.direction = -best.offset / corner.distance;
    } else {
        const Triangle3 t = cornersOf(triangles_[bestTriangle]);
        corner.direction = glm::normalize(glm::cross(t[1] - t[0], t[2] - t[0]));
    }
    if (!mesh_.colours.empty()) {
        for (int c = 0; c < 4; ++c) {
            double sum = 0.5;
            for (int i = 0; i < 3; ++i)
                sum += best.weights[i] * double(mesh_.colours[vertices_[bestTriangle][i]] >> 8 * c & 255u);
            corner.colour |= uint32_t(std::clamp(sum, 0.0, 255.0)) << 8 * c;
        }
    }
    return corner;
}

}  // namespace vcp
