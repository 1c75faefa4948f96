#include "builder/lattice_mesh.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <oneapi/tbb/parallel_sort.h>

#include "octree/leaf_math.h"
#include "octree/packing.h"
#include "octree/vcp_file.h"

namespace vcp {

namespace {

struct PositionHash {
    size_t operator()(glm::i32vec3 p) const {
        uint64_t h = uint32_t(p.x) * 0x9e3779b97f4a7c15u ^ uint32_t(p.y) * 0xc2b2ae3d27d4eb4fu ^ uint32_t(p.z) * 0x165667b19e3779f9u;
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
    /// Index of `p` in `positions`, or `next` after entering it.
    uint32_t findOrAdd(const std::vector<glm::i32vec3>& positions, glm::i32vec3 p, uint32_t next) {
        if (next * 3ull >= slots_.size() * 2) grow(positions);
        const size_t mask = slots_.size() - 1;
        for (size_t i = PositionHash{}(p) & mask;; i = (i + 1) & mask) {
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

/// Vertex numbers of `corners` in the canonical order of the vertices, which are sorted into it.
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

/// Sorts the vertices; returns the new number of each.
std::vector<uint32_t> sortVertices(std::vector<glm::i32vec3>& positions) {
    std::vector<OrderedVertex> order(positions.size());
    for (uint32_t v = 0; v < order.size(); ++v) order[v] = {mortonEncode(glm::u32vec3(positions[v] >> 11)), positions[v], v};
    tbb::parallel_sort(order.begin(), order.end());
    std::vector<uint32_t> renamed(order.size());
    for (uint32_t v = 0; v < order.size(); ++v) {
        positions[v] = order[v].position;
        renamed[order[v].number] = v;
    }
    return renamed;
}

/// A triangle by its vertices, smallest first; `turned`: the other two were swapped to ascend.
struct OrderedTriangle {
    std::array<uint32_t, 3> vertices;
    bool turned;
    float stray;

    OrderedTriangle(std::array<uint32_t, 3> v, float strayed) : vertices(v), stray(strayed) {
        std::rotate(vertices.begin(), std::min_element(vertices.begin(), vertices.end()), vertices.end());
        turned = vertices[1] > vertices[2];
        if (turned) std::swap(vertices[1], vertices[2]);
    }
    bool operator<(const OrderedTriangle& b) const { return vertices != b.vertices ? vertices < b.vertices : turned < b.turned; }
};

/// Means of the colours that triangles give their vertices.
std::vector<uint32_t> meanColours(std::span<const LatticeTriangle> soup, const std::vector<uint32_t>& corners, size_t vertices) {
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

}  // namespace

bool hasArea(glm::i32vec3 a, glm::i32vec3 b, glm::i32vec3 c) {
    // Coordinates may span 31 bits: the products need more than 64.
    using Wide = __int128;
    const int64_t ux = int64_t{b.x} - a.x, uy = int64_t{b.y} - a.y, uz = int64_t{b.z} - a.z;
    const int64_t vx = int64_t{c.x} - a.x, vy = int64_t{c.y} - a.y, vz = int64_t{c.z} - a.z;
    return Wide{uy} * vz != Wide{uz} * vy || Wide{uz} * vx != Wide{ux} * vz || Wide{ux} * vy != Wide{uy} * vx;
}

LatticeMesh meshOf(std::span<const LatticeTriangle> soup, bool withColour) {
    LatticeMesh mesh;
    std::vector<uint32_t> corners(soup.size() * 3);
    {
        PositionIndex index(soup.size() * 6 / 10);
        for (size_t k = 0; k < corners.size(); ++k) {
            const glm::i32vec3 p = soup[k / 3].corner[k % 3];
            const uint32_t next = static_cast<uint32_t>(mesh.positions.size());
            corners[k] = index.findOrAdd(mesh.positions, p, next);
            if (corners[k] == next) mesh.positions.push_back(p);
        }
    }
    {
        const std::vector<uint32_t> renamed = sortVertices(mesh.positions);
        for (uint32_t& v : corners) v = renamed[v];
    }
    mesh.normals.resize(mesh.positions.size());
    std::vector<OrderedTriangle> triangles;
    triangles.reserve(soup.size());
    for (size_t k = 0; k < soup.size(); ++k) {
        const std::array<uint32_t, 3> v{corners[3 * k], corners[3 * k + 1], corners[3 * k + 2]};
        for (int i = 0; i < 3; ++i) mesh.normals[v[i]] = soup[k].normal[i];
        triangles.emplace_back(v, soup[k].stray);
    }
    if (withColour) mesh.colours = meanColours(soup, corners, mesh.positions.size());
    std::vector<uint32_t>().swap(corners);
    tbb::parallel_sort(triangles.begin(), triangles.end());
    mesh.triangles.reserve(triangles.size());
    mesh.stray.reserve(triangles.size());
    for (size_t k = 0; k < triangles.size(); ++k) {
        const OrderedTriangle& t = triangles[k];
        if (k > 0 && t.vertices == triangles[k - 1].vertices) {
            mesh.stray.back() = std::max(mesh.stray.back(), t.stray);
            continue;
        }
        mesh.triangles.push_back(t.turned ? std::array<uint32_t, 3>{t.vertices[0], t.vertices[2], t.vertices[1]} : t.vertices);
        mesh.stray.push_back(t.stray);
    }
    return mesh;
}

std::optional<uint32_t> findVertex(const LatticeMesh& mesh, glm::i32vec3 p) {
    const auto named = [](glm::i32vec3 q) { return OrderedVertex{mortonEncode(glm::u32vec3(q >> 11)), q, 0}; };
    const auto at = std::lower_bound(mesh.positions.begin(), mesh.positions.end(), named(p), [&](glm::i32vec3 q, const OrderedVertex& wanted) { return named(q) < wanted; });
    if (at == mesh.positions.end() || *at != p) return {};
    return static_cast<uint32_t>(at - mesh.positions.begin());
}

void computeNormals(LatticeMesh& mesh) {
    constexpr float kCreaseCosine = 0.766f;  // 40 degrees
    std::vector<glm::vec3> sum(mesh.positions.size(), glm::vec3(0));
    std::vector<glm::vec3> faces(mesh.triangles.size());
    for (size_t k = 0; k < mesh.triangles.size(); ++k) {
        const std::array<uint32_t, 3>& t = mesh.triangles[k];
        glm::dvec3 p[3];
        for (int i = 0; i < 3; ++i) p[i] = glm::dvec3(mesh.positions[t[i]] - mesh.positions[t[0]]);
        const glm::vec3 n = glm::vec3(glm::normalize(glm::cross(p[1], p[2])));
        faces[k] = n;
        for (int i = 0; i < 3; ++i) {
            const glm::vec3 u = glm::vec3(glm::normalize(p[(i + 1) % 3] - p[i])), v = glm::vec3(glm::normalize(p[(i + 2) % 3] - p[i]));
            const float angle = std::acos(std::clamp(glm::dot(u, v), -1.0f, 1.0f));
            glm::vec3& s = sum[t[i]];
            s += glm::dot(s, n) < 0 ? -angle * n : angle * n;
        }
    }
    std::vector<uint8_t> crease(mesh.positions.size(), 0);
    for (glm::vec3& s : sum) {
        const float length = glm::length(s);
        s = length > 0 ? s / length : glm::vec3(0, 0, 1);
    }
    for (size_t k = 0; k < mesh.triangles.size(); ++k)
        for (const uint32_t v : mesh.triangles[k])
            if (std::abs(glm::dot(faces[k], sum[v])) < kCreaseCosine) crease[v] = 1;
    mesh.normals.resize(mesh.positions.size());
    for (size_t v = 0; v < sum.size(); ++v) mesh.normals[v] = packNormal(glm::dvec3(sum[v]), crease[v] != 0);
}

}  // namespace vcp
