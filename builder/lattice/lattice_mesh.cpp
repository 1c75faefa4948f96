#include "builder/lattice/lattice_mesh.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_invoke.h>
#include <oneapi/tbb/parallel_sort.h>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "builder/lattice/page_partition.h"
#include "octree/surface/leaf_math.h"
#include "octree/surface/morton.h"
#include "octree/surface/vertex_normal.h"

namespace vcp {

namespace {

struct PositionHash {
    size_t operator()(glm::i32vec3 p) const {
        uint64_t h = uint32_t(p.x) * 0x9e3779b97f4a7c15u ^ uint32_t(p.y) * 0xc2b2ae3d27d4eb4fu ^
                     uint32_t(p.z) * 0x165667b19e3779f9u;
        return h ^ h >> 29;
    }
};

/// An open-addressing map from position to index; the vertex array itself holds the keys.
class PositionIndex {
public:
    explicit PositionIndex(size_t count) {
        size_t size = 16;
        while (size < count * 2) size *= 2;
        slots_.assign(size, kEmpty);
    }
    /// Returns the index of `p` in `positions`, or `next` after entering it.
    uint32_t findOrAdd(const std::vector<glm::i32vec3>& positions, glm::i32vec3 p, uint32_t next) {
        if (next * 3ull >= slots_.size() * 2) grow(positions);
        const size_t mask = slots_.size() - 1;
        for (size_t i = PositionHash{}(p)&mask;; i = (i + 1) & mask) {
            if (slots_[i] == kEmpty) return slots_[i] = next;
            if (positions[slots_[i]] == p) return slots_[i];
        }
    }

private:
    void grow(const std::vector<glm::i32vec3>& positions) {
        slots_.assign(slots_.size() * 2, kEmpty);
        const size_t mask = slots_.size() - 1;
        for (uint32_t v = 0; v < positions.size(); ++v) {
            size_t i = PositionHash{}(positions[v]) & mask;
            while (slots_[i] != kEmpty) i = (i + 1) & mask;
            slots_[i] = v;
        }
    }

    static constexpr uint32_t kEmpty = 0xffffffff;
    std::vector<uint32_t> slots_;
};

/// A vertex on its way into the canonical order, by which vertices are numbered.
struct OrderedVertex {
    uint64_t cell;
    glm::i32vec3 position;
    uint32_t number;

    bool operator<(const OrderedVertex& b) const {
        if (cell != b.cell) return cell < b.cell;
        if (position.z != b.position.z) return position.z < b.position.z;
        if (position.y != b.position.y) return position.y < b.position.y;
        return position.x < b.position.x;
    }
};

OrderedVertex orderedVertex(glm::i32vec3 p, uint32_t number) {
    return {mortonEncode(glm::u32vec3(p >> int(PageGrid::kLog2LatticePerCell))), p, number};
}

// Triangles that turn away make a crease where they have so large a part of the area around a vertex.
constexpr int64_t kCreaseShare = 16;

constexpr size_t kGrain = 16384;  // elements that a thread takes at a time

/// Distinct positions, found in parts at the same time: a part has those with its own hashes.
class DistinctPositions {
public:
    /// Sets for each corner of the soup the number of its position, in the order that the parts found them.
    DistinctPositions(std::span<const LatticeTriangle> soup, std::span<uint32_t> corners) {
        tbb::parallel_for(size_t{0}, kParts, [&](size_t part) { find(part, soup, corners); });
        uint32_t first = 0;
        for (Part& part : parts_) {
            part.first = first;
            first += uint32_t(part.positions.size());
        }
        count_ = first;
        tbb::parallel_for(tbb::blocked_range<size_t>(0, corners.size(), kGrain), [&](const auto& range) {
            for (size_t k = range.begin(); k < range.end(); ++k)
                corners[k] += parts_[partOf(soup[k / 3].corner[k % 3])].first;
        });
    }

    /// Returns the positions in the canonical order; sets the new number of each.
    std::vector<glm::i32vec3> sorted(std::vector<uint32_t>& renamed) {
        std::vector<OrderedVertex> order(count_);
        tbb::parallel_for(size_t{0}, kParts, [&](size_t i) {
            Part& part = parts_[i];
            for (uint32_t v = 0; v < part.positions.size(); ++v)
                order[part.first + v] = orderedVertex(part.positions[v], part.first + v);
            std::vector<glm::i32vec3>().swap(part.positions);
        });
        tbb::parallel_sort(order.begin(), order.end());
        std::vector<glm::i32vec3> positions(count_);
        renamed.resize(count_);
        tbb::parallel_for(tbb::blocked_range<size_t>(0, count_, kGrain), [&](const auto& range) {
            for (size_t v = range.begin(); v < range.end(); ++v) {
                positions[v] = order[v].position;
                renamed[order[v].number] = uint32_t(v);
            }
        });
        return positions;
    }

private:
    static constexpr size_t kParts = 4;
    struct Part {
        std::vector<glm::i32vec3> positions;
        uint32_t first = 0;
    };

    // An index takes low bits of the hash, and a part high ones.
    static size_t partOf(glm::i32vec3 p) { return PositionHash{}(p) >> 62; }

    void find(size_t part, std::span<const LatticeTriangle> soup, std::span<uint32_t> corners) {
        std::vector<glm::i32vec3>& positions = parts_[part].positions;
        PositionIndex index(soup.size() * 6 / 10 / kParts);
        for (size_t k = 0; k < corners.size(); ++k) {
            const glm::i32vec3 p = soup[k / 3].corner[k % 3];
            if (partOf(p) != part) continue;
            const uint32_t next = uint32_t(positions.size());
            corners[k] = index.findOrAdd(positions, p, next);
            if (corners[k] == next) positions.push_back(p);
        }
    }

    std::array<Part, kParts> parts_;
    size_t count_ = 0;
};

/// A triangle whose smallest vertex is known: the other two ascending. `turned`: they were swapped to ascend.
struct OrderedTriangle {
    uint32_t second, third;
    float stray;
    uint32_t source;  ///< twice the triangle's number in the soup, and 1 more where `turned`

    [[nodiscard]] uint64_t key() const { return uint64_t{second} << 32 | third; }
    [[nodiscard]] bool turned() const { return (source & 1u) != 0; }
    bool operator<(const OrderedTriangle& b) const {
        return key() != b.key() ? key() < b.key() : turned() < b.turned();
    }
};

bool hasOwnNormals(std::span<const LatticeTriangle> soup) {
    return std::ranges::any_of(soup, [](const LatticeTriangle& t) {
        return t.own[0] != kUnknownNormal || t.own[1] != kUnknownNormal || t.own[2] != kUnknownNormal;
    });
}

/// Returns a triangle's own normals at three of the mesh's vertices. `corners`: its corners' vertices.
std::array<uint32_t, 3> ownNormals(const LatticeTriangle& t, std::span<const uint32_t> corners,
                                   const std::array<uint32_t, 3>& vertices) {
    std::array<uint32_t, 3> normals{};
    for (size_t i = 0; i < 3; ++i)
        for (size_t k = 0; k < 3; ++k)
            if (corners[k] == vertices[i]) normals[i] = t.own[k];
    return normals;
}

/// Sorts triangles by smallest vertex, then by the others; of repeated ones keeps the first, with the largest stray
/// and the least own normals.
void sortTriangles(std::span<const LatticeTriangle> soup, const std::vector<uint32_t>& corners, LatticeMesh& mesh) {
    std::vector<uint32_t> begin(mesh.positions.size() + 1, 0);
    for (size_t k = 0; k < soup.size(); ++k)
        ++begin[std::min({corners[3 * k], corners[3 * k + 1], corners[3 * k + 2]}) + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    const bool withNormals = hasOwnNormals(soup);
    std::vector<OrderedTriangle> ordered(soup.size());
    std::vector<uint32_t> next(begin.begin(), begin.end() - 1);
    for (size_t k = 0; k < soup.size(); ++k) {
        std::array<uint32_t, 3> v{corners[3 * k], corners[3 * k + 1], corners[3 * k + 2]};
        std::rotate(v.begin(), std::min_element(v.begin(), v.end()), v.end());
        const bool turned = v[1] > v[2];
        ordered[next[v[0]]++] = {std::min(v[1], v[2]), std::max(v[1], v[2]), soup[k].stray, uint32_t(2 * k + turned)};
    }
    tbb::parallel_for(tbb::blocked_range<size_t>(0, begin.size() - 1, kGrain), [&](const auto& range) {
        for (size_t v = range.begin(); v < range.end(); ++v)
            std::sort(ordered.begin() + begin[v], ordered.begin() + begin[v + 1]);
    });
    mesh.triangles.reserve(soup.size());
    mesh.stray.reserve(soup.size());
    if (withNormals) mesh.cornerNormals.reserve(soup.size());
    const auto ownOf = [&](const OrderedTriangle& t) {
        const size_t k = t.source / 2;
        return ownNormals(soup[k], std::span(corners).subspan(3 * k, 3), mesh.triangles.back());
    };
    for (uint32_t v = 0; v + 1 < begin.size(); ++v) {
        const auto from = ordered.begin() + begin[v], to = ordered.begin() + begin[v + 1];
        for (auto t = from; t != to; ++t) {
            if (t != from && t->key() == (t - 1)->key()) {
                mesh.stray.back() = std::max(mesh.stray.back(), t->stray);
                if (withNormals) mesh.cornerNormals.back() = std::min(mesh.cornerNormals.back(), ownOf(*t));
                continue;
            }
            mesh.triangles.push_back(t->turned() ? std::array<uint32_t, 3>{v, t->third, t->second}
                                                 : std::array<uint32_t, 3>{v, t->second, t->third});
            mesh.stray.push_back(t->stray);
            if (withNormals) mesh.cornerNormals.push_back(ownOf(*t));
        }
    }
}

/// Returns the normals that triangles give their vertices. They agree, except where a kept thin part ends at another
/// triangle's vertex: then any of them will do that does not depend on the order.
std::vector<uint32_t> leastNormals(std::span<const LatticeTriangle> soup, const std::vector<uint32_t>& corners,
                                   size_t vertices) {
    std::vector<uint32_t> normals(vertices, 0xffffffffu);
    for (size_t k = 0; k < corners.size(); ++k)
        normals[corners[k]] = std::min(normals[corners[k]], soup[k / 3].normal[k % 3]);
    return normals;
}

/// Returns the means of the colours that triangles give their vertices.
std::vector<uint32_t> meanColours(std::span<const LatticeTriangle> soup, const std::vector<uint32_t>& corners,
                                  size_t vertices) {
    std::vector<std::array<uint32_t, 5>> sums(vertices, {0, 0, 0, 0, 0});
    for (size_t k = 0; k < corners.size(); ++k) {
        const uint32_t colour = soup[k / 3].colour[k % 3];
        auto& sum = sums[corners[k]];
        for (int c = 0; c < 4; ++c) sum[c] += colour >> 8 * c & 255u;
        ++sum[4];
    }
    std::vector<uint32_t> means(vertices, 0);
    for (size_t v = 0; v < vertices; ++v)
        for (int c = 0; c < 4; ++c) means[v] |= (sums[v][c] + sums[v][4] / 2) / sums[v][4] << 8 * c;
    return means;
}

/// Returns the part of each vertex, that of any triangle there; nothing where all are closed.
std::vector<uint32_t> partsOf(std::span<const LatticeTriangle> soup, const std::vector<uint32_t>& corners,
                              size_t vertices) {
    if (std::ranges::all_of(soup, [](const LatticeTriangle& t) { return t.part == kClosedPart; })) return {};
    std::vector<uint32_t> parts(vertices);
    for (size_t k = 0; k < corners.size(); ++k) parts[corners[k]] = std::max(parts[corners[k]], soup[k / 3].part);
    return parts;
}

}  // namespace

bool hasArea(glm::i32vec3 a, glm::i32vec3 b, glm::i32vec3 c) {
    // Coordinates may span 31 bits, so the products need more than 64.
    using Wide = __int128;
    const int64_t ux = int64_t{b.x} - a.x, uy = int64_t{b.y} - a.y, uz = int64_t{b.z} - a.z;
    const int64_t vx = int64_t{c.x} - a.x, vy = int64_t{c.y} - a.y, vz = int64_t{c.z} - a.z;
    return Wide{uy} * vz != Wide{uz} * vy || Wide{uz} * vx != Wide{ux} * vz || Wide{ux} * vy != Wide{uy} * vx;
}

LatticeMesh meshOf(std::span<const LatticeTriangle> soup, bool withColour) {
    LatticeMesh mesh;
    std::vector<uint32_t> corners(soup.size() * 3);
    {
        std::vector<uint32_t> renamed;
        mesh.positions = DistinctPositions(soup, corners).sorted(renamed);
        tbb::parallel_for(tbb::blocked_range<size_t>(0, corners.size(), kGrain), [&](const auto& range) {
            for (size_t k = range.begin(); k < range.end(); ++k) corners[k] = renamed[corners[k]];
        });
    }
    const size_t vertices = mesh.positions.size();
    tbb::parallel_invoke([&] { sortTriangles(soup, corners, mesh); },
                         [&] {
                             mesh.normals = leastNormals(soup, corners, vertices);
                             if (withColour) mesh.colours = meanColours(soup, corners, vertices);
                             mesh.parts = partsOf(soup, corners, vertices);
                         });
    return mesh;
}

void halveLattice(LatticeMesh& mesh) {
    for (glm::i32vec3& p : mesh.positions) p >>= 1;
    for (float& stray : mesh.stray) stray /= 2;
}

std::optional<uint32_t> findVertex(const LatticeMesh& mesh, glm::i32vec3 p) {
    const auto at =
        std::lower_bound(mesh.positions.begin(), mesh.positions.end(), orderedVertex(p, 0),
                         [&](glm::i32vec3 q, const OrderedVertex& wanted) { return orderedVertex(q, 0) < wanted; });
    if (at == mesh.positions.end() || *at != p) return {};
    return uint32_t(at - mesh.positions.begin());
}

void computeNormals(LatticeMesh& mesh) {
    std::vector<WideVector> sum(mesh.positions.size(), WideVector(0));
    std::vector<WideVector> faces(mesh.triangles.size());
    tbb::parallel_for(tbb::blocked_range<size_t>(0, faces.size(), kGrain), [&](const auto& range) {
        for (size_t k = range.begin(); k < range.end(); ++k) {
            const auto& [a, b, c] = mesh.triangles[k];
            faces[k] = areaNormal(mesh.positions[a], mesh.positions[b], mesh.positions[c]);
        }
    });
    for (size_t k = 0; k < faces.size(); ++k)
        for (const uint32_t v : mesh.triangles[k]) addNormal(sum[v], faces[k]);
    const std::vector<uint8_t> crease = creases(faces, sum, mesh.triangles, kCreaseShare);
    mesh.normals.resize(mesh.positions.size());
    tbb::parallel_for(tbb::blocked_range<size_t>(0, sum.size(), kGrain), [&](const auto& range) {
        for (size_t v = range.begin(); v < range.end(); ++v)
            mesh.normals[v] = packGridNormal(normalGridPoint(sum[v]), crease[v] != 0);
    });
}

void settleNormals(LatticeMesh& mesh) {
    const double nearest = std::pow(std::cos(glm::radians(kSettledDegrees)), 2);
    std::atomic<bool> anyCounts = false;
    tbb::parallel_for(tbb::blocked_range<size_t>(0, mesh.cornerNormals.size(), kGrain), [&](const auto& range) {
        bool counts = false;
        for (size_t k = range.begin(); k < range.end(); ++k) {
            const auto& [a, b, c] = mesh.triangles[k];
            const glm::dvec3 facet(areaNormal(mesh.positions[a], mesh.positions[b], mesh.positions[c]));
            for (size_t i = 0; i < 3; ++i) {
                uint32_t& own = mesh.cornerNormals[k][i];
                if (own == kUnknownNormal) continue;
                const glm::dvec3 n = f64::decodeNormal(own);
                const glm::dvec3 computed = f64::cornerNormal(mesh.normals[mesh.triangles[k][i]], facet);
                const double along = glm::dot(n, computed);
                if (along * along >= nearest * glm::dot(n, n) * glm::dot(computed, computed)) own = kUnknownNormal;
                counts |= own != kUnknownNormal;
            }
        }
        if (counts) anyCounts = true;
    });
    if (!anyCounts) std::vector<std::array<uint32_t, 3>>().swap(mesh.cornerNormals);
}

}  // namespace vcp
