#include "builder/lattice_mesh.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include <glm/geometric.hpp>

#include "octree/leaf_math.h"
#include "octree/vertex_normal.h"

namespace vcp {

namespace {

struct PositionHash {
    size_t operator()(glm::i32vec3 p) const {
        uint64_t h = uint32_t(p.x) * 0x9e3779b97f4a7c15u ^ uint32_t(p.y) * 0xc2b2ae3d27d4eb4fu ^ uint32_t(p.z) * 0x165667b19e3779f9u;
        return h ^ h >> 29;
    }
};

using Index3 = std::array<uint32_t, 3>;

/// Order-free name of a triangle.
Index3 sorted(Index3 t) {
    std::sort(t.begin(), t.end());
    return t;
}

struct Index3Hash {
    size_t operator()(const Index3& t) const {
        uint64_t h = t[0] * 0x9e3779b97f4a7c15u ^ t[1] * 0xc2b2ae3d27d4eb4fu ^ t[2] * 0x165667b19e3779f9u;
        return h ^ h >> 29;
    }
};

bool hasArea(glm::i32vec3 a, glm::i32vec3 b, glm::i32vec3 c) {
    // Coordinates may span 31 bits: the products need more than 64.
    using Wide = __int128;
    const int64_t ux = int64_t{b.x} - a.x, uy = int64_t{b.y} - a.y, uz = int64_t{b.z} - a.z;
    const int64_t vx = int64_t{c.x} - a.x, vy = int64_t{c.y} - a.y, vz = int64_t{c.z} - a.z;
    return Wide{uy} * vz != Wide{uz} * vy || Wide{uz} * vx != Wide{ux} * vz || Wide{ux} * vy != Wide{uy} * vx;
}

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
        const size_t mask = slots_.size() - 1;
        for (size_t i = PositionHash{}(p) & mask;; i = (i + 1) & mask) {
            if (slots_[i] == kEmpty) return slots_[i] = next;
            if (positions[slots_[i]] == p) return slots_[i];
        }
    }

private:
    static constexpr uint32_t kEmpty = 0xffffffff;
    std::vector<uint32_t> slots_;
};

/// The same for triangles whose corners are sorted.
class TriangleSet {
public:
    explicit TriangleSet(size_t count) {
        size_t size = 16;
        while (size < count * 2) size *= 2;
        slots_.assign(size, Index3{0xffffffff, 0, 0});
    }
    bool insert(const Index3& t) {
        const size_t mask = slots_.size() - 1;
        for (size_t i = Index3Hash{}(t) & mask;; i = (i + 1) & mask) {
            if (slots_[i][0] == 0xffffffff) {
                slots_[i] = t;
                return true;
            }
            if (slots_[i] == t) return false;
        }
    }

private:
    std::vector<Index3> slots_;
};

double edgeLengthSquared(const LatticeMesh& mesh, uint32_t a, uint32_t b) {
    const glm::dvec3 d = glm::dvec3(mesh.positions[a]) - glm::dvec3(mesh.positions[b]);
    return glm::dot(d, d);
}

/// Middle of two colours, channel by channel.
uint32_t middleColour(uint32_t a, uint32_t b) { return (a & b) + (((a ^ b) & 0xfefefefeu) >> 1); }

class EdgeSplitter {
public:
    explicit EdgeSplitter(LatticeMesh& mesh) : mesh_(mesh) {}

    void run() {
        std::vector<Index3> pending;
        std::vector<Index3> done;
        for (const Index3& t : mesh_.triangles) {
            pending.push_back(t);
            while (!pending.empty()) {
                const Index3 next = pending.back();
                pending.pop_back();
                if (!split(next, pending)) done.push_back(next);
            }
        }
        mesh_.triangles = std::move(done);
    }

private:
    bool tooLong(uint32_t a, uint32_t b) const {
        constexpr double limit = double(kMaxEdgeCells) * kLatticePerCell;
        return edgeLengthSquared(mesh_, a, b) > limit * limit;
    }

    uint32_t middle(uint32_t a, uint32_t b) {
        const uint64_t key = uint64_t{std::min(a, b)} << 32 | std::max(a, b);
        const auto [entry, isNew] = middles_.try_emplace(key, static_cast<uint32_t>(mesh_.positions.size()));
        if (isNew) {
            const glm::i32vec3 p = mesh_.positions[a], q = mesh_.positions[b];
            mesh_.positions.emplace_back((int64_t{p.x} + q.x) >> 1, (int64_t{p.y} + q.y) >> 1, (int64_t{p.z} + q.z) >> 1);
            mesh_.stray.push_back(std::max(mesh_.stray[a], mesh_.stray[b]) + static_cast<float>(kLatticeRounding));
            if (!mesh_.colours.empty()) mesh_.colours.push_back(middleColour(mesh_.colours[a], mesh_.colours[b]));
        }
        return entry->second;
    }

    /// Cuts each edge that is too long; whether it is does not depend on the triangle.
    bool split(const Index3& t, std::vector<Index3>& out) {
        const bool ab = tooLong(t[0], t[1]), bc = tooLong(t[1], t[2]), ca = tooLong(t[2], t[0]);
        const int cuts = ab + bc + ca;
        if (cuts == 0) return false;
        // Rotate so that the cut edges come first: (ab), (ab, bc) or all.
        Index3 r = t;
        if (cuts == 1) r = ab ? t : bc ? Index3{t[1], t[2], t[0]} : Index3{t[2], t[0], t[1]};
        if (cuts == 2) r = !ca ? t : !ab ? Index3{t[1], t[2], t[0]} : Index3{t[2], t[0], t[1]};
        const uint32_t m = middle(r[0], r[1]);
        if (cuts == 1) {
            out.insert(out.end(), {{r[0], m, r[2]}, {m, r[1], r[2]}});
            return true;
        }
        const uint32_t n = middle(r[1], r[2]);
        if (cuts == 2) {
            out.insert(out.end(), {{m, r[1], n}, {r[0], m, n}, {r[0], n, r[2]}});
            return true;
        }
        const uint32_t o = middle(r[2], r[0]);
        out.insert(out.end(), {{r[0], m, o}, {m, r[1], n}, {o, n, r[2]}, {m, n, o}});
        return true;
    }

    LatticeMesh& mesh_;
    std::unordered_map<uint64_t, uint32_t> middles_;
};

}  // namespace

void weld(LatticeMesh& mesh) {
    std::vector<glm::i32vec3> positions;
    std::vector<uint32_t> colours;
    std::vector<float> stray;
    positions.reserve(mesh.positions.size());
    PositionIndex index(mesh.positions.size());
    std::vector<uint32_t> renamed(mesh.positions.size());
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
        const uint32_t next = static_cast<uint32_t>(positions.size());
        const uint32_t name = index.findOrAdd(positions, mesh.positions[i], next);
        renamed[i] = name;
        if (name == next) {
            positions.push_back(mesh.positions[i]);
            stray.push_back(mesh.stray[i]);
            if (!mesh.colours.empty()) colours.push_back(mesh.colours[i]);
        } else {
            stray[name] = std::max(stray[name], mesh.stray[i]);
        }
    }
    std::vector<Index3> triangles;
    triangles.reserve(mesh.triangles.size());
    TriangleSet seen(mesh.triangles.size());
    for (const Index3& t : mesh.triangles) {
        const Index3 r{renamed[t[0]], renamed[t[1]], renamed[t[2]]};
        if (hasArea(positions[r[0]], positions[r[1]], positions[r[2]]) && seen.insert(sorted(r))) triangles.push_back(r);
    }
    mesh = {std::move(positions), std::move(colours), {}, std::move(stray), std::move(triangles)};
}

void splitLongEdges(LatticeMesh& mesh) {
    const double limit = double(kMaxEdgeCells) * kLatticePerCell;
    const bool any = std::any_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const Index3& t) {
        return edgeLengthSquared(mesh, t[0], t[1]) > limit * limit || edgeLengthSquared(mesh, t[1], t[2]) > limit * limit ||
               edgeLengthSquared(mesh, t[2], t[0]) > limit * limit;
    });
    if (!any) return;
    EdgeSplitter(mesh).run();
    weld(mesh);
}

void computeNormals(LatticeMesh& mesh) {
    std::vector<WideVector> sum(mesh.positions.size(), WideVector(0));
    std::vector<WideVector> faces(mesh.triangles.size());
    for (size_t k = 0; k < mesh.triangles.size(); ++k) {
        const Index3& t = mesh.triangles[k];
        faces[k] = areaNormal(mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]);
        for (const uint32_t v : t) addNormal(sum[v], faces[k]);
    }
    const std::vector<uint8_t> crease = creases(faces, sum, mesh.triangles);
    mesh.normals.resize(mesh.positions.size());
    for (size_t v = 0; v < sum.size(); ++v) mesh.normals[v] = packGridNormal(normalGridPoint(sum[v]), crease[v] != 0);
}

}  // namespace vcp
