#include "builder/page_geometry.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>

#include "octree/leaf_math.h"

namespace vcp {

namespace {

// Two triangles that meet at an edge with a sharper turn than this are not one sheet for a certificate.
constexpr double kCreaseCosine = 0.35;

// Squared distances to bounding boxes are in float: this much room for their rounding.
constexpr double kBoundsRounding = 1.00001;

struct EdgeUse {
    uint64_t edge;      ///< smaller vertex in the high word
    uint32_t triangle;  ///< local
    uint8_t corner;     ///< where the edge begins
};

}  // namespace

PageGeometry::PageGeometry(const LatticeMesh& mesh, std::span<const uint32_t> triangles, glm::u32vec3 page, uint32_t log2Cells)
    : mesh_(mesh), cells_(1 << log2Cells), origin_(glm::i32vec3(page) * (kLatticePerCell << log2Cells)) {
    loadTriangles(triangles);
    markBadEdges();
    fillCells(triangles);
}

void PageGeometry::loadTriangles(std::span<const uint32_t> triangles) {
    triangles_.reserve(triangles.size());
    for (const uint32_t k : triangles) {
        CertifiedTriangle t;
        for (int i = 0; i < 3; ++i) t.corners[i] = glm::dvec3(mesh_.positions[mesh_.triangles[k][i]] - origin_) / double(kLatticePerCell);
        t.normal = glm::normalize(glm::cross(t.corners[1] - t.corners[0], t.corners[2] - t.corners[0]));
        triangles_.push_back(t);
        vertices_.push_back(mesh_.triangles[k]);
        overlap_.emplace_back(t.corners);
        bounds_.push_back({glm::vec3(overlap_.back().lower()), glm::vec3(overlap_.back().upper())});
    }
    stamp_.assign(triangles_.size(), 0);
    const size_t side = static_cast<size_t>(cells_) + 1;
    gridCorner_.assign(side * side * side, 0);
}

void PageGeometry::markBadEdges() {
    std::vector<EdgeUse> uses;
    uses.reserve(vertices_.size() * 3);
    for (uint32_t k = 0; k < vertices_.size(); ++k)
        for (uint8_t i = 0; i < 3; ++i) {
            const uint32_t a = vertices_[k][i], b = vertices_[k][(i + 1) % 3];
            uses.push_back({uint64_t{std::min(a, b)} << 32 | std::max(a, b), k, i});
        }
    std::sort(uses.begin(), uses.end(), [](const EdgeUse& a, const EdgeUse& b) { return a.edge != b.edge ? a.edge < b.edge : a.triangle < b.triangle; });
    for (size_t begin = 0, end = 0; begin < uses.size(); begin = end) {
        for (end = begin; end < uses.size() && uses[end].edge == uses[begin].edge;) ++end;
        bool good = end - begin == 2;
        if (good) {
            // Oriented by the shared edge, both normals agree where the surface continues and oppose at a fold.
            const CertifiedTriangle &s = triangles_[uses[begin].triangle], &t = triangles_[uses[begin + 1].triangle];
            const bool sameDirection = vertices_[uses[begin].triangle][uses[begin].corner] == vertices_[uses[begin + 1].triangle][uses[begin + 1].corner];
            good = (sameDirection ? -1 : 1) * glm::dot(s.normal, t.normal) >= kCreaseCosine;
        }
        if (good) continue;
        for (size_t i = begin; i < end; ++i) triangles_[uses[i].triangle].badEdges |= static_cast<uint8_t>(1u << uses[i].corner);
    }
}

void PageGeometry::fillCells(std::span<const uint32_t> numbers) {
    const int side = cells_ + 2 * kBorder;
    const size_t cellCount = static_cast<size_t>(side) * side * side;
    occupied_.assign(cellCount, 0);
    struct Entry {
        uint32_t cell, triangle;
        bool touches;
    };
    std::vector<Entry> entries;
    entries.reserve(triangles_.size() * 8);
    constexpr double m = kCertificateMarginCells;
    for (uint32_t k = 0; k < triangles_.size(); ++k) {
        const BoxOverlap& overlap = overlap_[k];
        const glm::ivec3 low = glm::max(glm::ivec3(glm::floor(overlap.lower() - m)), -kBorder);
        const glm::ivec3 high = glm::min(glm::ivec3(glm::floor(overlap.upper() + m)), cells_ + kBorder - 1);
        bool touchesPage = false;
        for (int z = low.z; z <= high.z; ++z)
            for (int y = low.y; y <= high.y; ++y)
                for (int x = low.x; x <= high.x; ++x) {
                    const glm::dvec3 centre = glm::dvec3(x, y, z) + 0.5;
                    if (!overlap.test(centre, 0.5 + m)) continue;
                    const bool touches = overlap.test(centre, 0.5);
                    const size_t cell = cellIndex({x, y, z});
                    entries.push_back({static_cast<uint32_t>(cell), k, touches});
                    if (touches) occupied_[cell] = 1;
                    touchesPage |= touches && std::min({x, y, z}) >= 0 && std::max({x, y, z}) < cells_;
                }
        if (touchesPage) stray_ = std::max(stray_, double(mesh_.stray[numbers[k]]));
    }
    cellBegin_.assign(cellCount + 1, 0);
    for (const Entry& e : entries) ++cellBegin_[e.cell + 1];
    for (size_t i = 0; i < cellCount; ++i) cellBegin_[i + 1] += cellBegin_[i];
    cellTriangles_.resize(entries.size());
    cellTouchEnd_.assign(cellBegin_.begin(), cellBegin_.end() - 1);
    for (const Entry& e : entries)
        if (e.touches) cellTriangles_[cellTouchEnd_[e.cell]++] = e.triangle;
    std::vector<uint32_t> next = cellTouchEnd_;
    for (const Entry& e : entries)
        if (!e.touches) cellTriangles_[next[e.cell]++] = e.triangle;
}

void PageGeometry::trianglesOf(const NodeBox& box, std::vector<uint32_t>& around, std::vector<uint32_t>& inside) {
    around.clear();
    inside.clear();
    const glm::ivec3 low = box.lower / kSubcells, high = low + box.edge / kSubcells - 1;
    ++stampNow_;
    for (int z = low.z; z <= high.z; ++z)
        for (int y = low.y; y <= high.y; ++y)
            for (int x = low.x; x <= high.x; ++x) {
                const size_t cell = cellIndex({x, y, z});
                for (uint32_t i = cellBegin_[cell]; i < cellBegin_[cell + 1]; ++i) {
                    const uint32_t k = cellTriangles_[i];
                    if (stamp_[k] != stampNow_) {
                        stamp_[k] = stampNow_;
                        around.push_back(k);
                    }
                    if (i < cellTouchEnd_[cell]) inside.push_back(k);
                }
            }
    std::sort(around.begin(), around.end());
    std::sort(inside.begin(), inside.end());
    inside.erase(std::unique(inside.begin(), inside.end()), inside.end());
}

void PageGeometry::filter(const NodeBox& box, std::span<const uint32_t> candidates, std::vector<uint32_t>& around, std::vector<uint32_t>& inside) const {
    around.clear();
    inside.clear();
    const double half = box.edgeCells() / 2;
    for (const uint32_t k : candidates) {
        if (!overlap_[k].test(box.centreCells(), half + kCertificateMarginCells)) continue;
        around.push_back(k);
        if (overlap_[k].test(box.centreCells(), half)) inside.push_back(k);
    }
}

const CornerVector& PageGeometry::corner(glm::ivec3 subcells) {
    const glm::ivec3 cell = subcells / kSubcells;
    const size_t side = static_cast<size_t>(cells_) + 1;
    uint32_t& number = cell * kSubcells == subcells
                           ? gridCorner_[cell.x + side * (cell.y + side * cell.z)]
                           : subcellCorner_[uint64_t(subcells.x) | uint64_t(subcells.y) << 20 | uint64_t(subcells.z) << 40];
    if (number == 0) {
        corners_.push_back(searchCorner(glm::dvec3(subcells) / double(kSubcells)));
        number = static_cast<uint32_t>(corners_.size());
    }
    return corners_[number - 1];
}

CornerVector PageGeometry::searchCorner(glm::dvec3 p) {
    ClosestPoint best;
    best.squared = 1e300;
    uint32_t bestTriangle = 0;
    const glm::vec3 pFloat(p);
    ++stampNow_;
    glm::ivec3 doneLow(0), doneHigh(-1);  // cells already looked at
    for (int radius = 1;; ++radius) {
        // The cells that a ball of `radius` about p meets.
        const glm::ivec3 low = glm::max(glm::ivec3(glm::floor(p - double(radius))), -kBorder);
        const glm::ivec3 high = glm::min(glm::ivec3(glm::ceil(p + double(radius))) - 1, cells_ + kBorder - 1);
        for (int z = low.z; z <= high.z; ++z)
            for (int y = low.y; y <= high.y; ++y)
                for (int x = low.x; x <= high.x; ++x) {
                    if (x >= doneLow.x && x <= doneHigh.x && y >= doneLow.y && y <= doneHigh.y && z >= doneLow.z && z <= doneHigh.z) {
                        x = doneHigh.x;
                        continue;
                    }
                    const size_t cell = cellIndex({x, y, z});
                    for (uint32_t i = cellBegin_[cell]; i < cellTouchEnd_[cell]; ++i) {
                        const uint32_t k = cellTriangles_[i];
                        if (stamp_[k] == stampNow_) continue;
                        stamp_[k] = stampNow_;
                        const glm::vec3 away = glm::max(glm::max(bounds_[k].lower - pFloat, pFloat - bounds_[k].upper), 0.0f);
                        if (glm::dot(away, away) > kBoundsRounding * best.squared) continue;
                        const ClosestPoint c = closestOnTriangle(p, triangles_[k].corners);
                        if (c.squared < best.squared || (c.squared == best.squared && k < bestTriangle)) {
                            best = c;
                            bestTriangle = k;
                        }
                    }
                }
        const bool whole = low == glm::ivec3(-kBorder) && high == glm::ivec3(cells_ + kBorder - 1);
        if (best.squared <= double(radius) * radius || whole) break;
        doneLow = low;
        doneHigh = high;
    }
    CornerVector corner;
    corner.distance = std::sqrt(best.squared);
    corner.direction = best.squared > 0 ? -best.offset / corner.distance : triangles_[bestTriangle].normal;
    if (!mesh_.colours.empty()) {
        for (int c = 0; c < 4; ++c) {
            double sum = 0.5;
            for (int i = 0; i < 3; ++i) sum += best.weights[i] * double(mesh_.colours[vertices_[bestTriangle][i]] >> 8 * c & 255u);
            corner.colour |= static_cast<uint32_t>(std::clamp(sum, 0.0, 255.0)) << 8 * c;
        }
    }
    return corner;
}

}  // namespace vcp
