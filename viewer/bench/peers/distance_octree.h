// Signed distances at the corners, 32-bit floats, in the structure of corner_octree.h.
//
//   DistanceCaster   the signed-distance octree that Demir and Westermann compare with. Their Table 1 gives both the
//                    same bytes at the same resolution, so it is the same tree, merged alike, with distances for
//                    vectors. Sphere tracing (Hart 1996) by the trilinear distance; hit where it changes sign, or
//                    falls below kHitDistance
//   AnalyticCaster   leaves only where the corners differ in sign; inside a leaf the ray meets the trilinear distance
//                    as a cubic, whose coefficients and first root are computed (Hansson-Soderlund, Evans and
//                    Akenine-Moller 2022; the root between the closed-form extrema, as in Marmitt et al. 2004)
//
// Signs: mesh_sides.h. What sets AnalyticCaster apart from the sparse voxel octree of that paper: 32 bits a distance
// instead of 8, corners shared along x.
#pragma once

#include <bit>

#include "builder/paper/corner_octree.h"
#include "builder/paper/node_finder.h"

namespace vcp {

/// A trilinear function of x, y and z from 0 to 1.
struct Trilinear {
    float k, x, y, z, xy, xz, yz, xyz;

    /// Takes the values at corners 4 x + 2 z + y.
    explicit Trilinear(const std::array<float, 8>& v)
        : k(v[0]),
          x(v[4] - v[0]),
          y(v[1] - v[0]),
          z(v[2] - v[0]),
          xy(v[5] - v[4] - y),
          xz(v[6] - v[4] - z),
          yz(v[3] - v[1] - z),
          xyz(v[7] - v[6] - v[5] + v[4] - yz) {}
    [[nodiscard]] float at(glm::vec3 p) const {
        return k + x * p.x + (y + xy * p.x) * p.y + (z + xz * p.x + (yz + xyz * p.x) * p.y) * p.z;
    }
    [[nodiscard]] glm::vec3 gradient(glm::vec3 p) const {
        return {x + xy * p.y + (xz + xyz * p.y) * p.z, y + xy * p.x + (yz + xyz * p.x) * p.z,
                z + xz * p.x + (yz + xyz * p.x) * p.y};
    }
};

/// c[0] + c[1] u + c[2] u^2 + c[3] u^3.
struct Cubic {
    std::array<float, 4> c;
    [[nodiscard]] float at(float u) const { return c[0] + u * (c[1] + u * (c[2] + u * c[3])); }
};
/// Returns what the function is at p + u d.
Cubic cubicAlong(const Trilinear& f, glm::vec3 p, glm::vec3 d);
/// The least root in [0, end]; infinite where there is none. Roots where the function only touches 0 may be missed.
float firstRoot(const Cubic& f, float end);

struct DistanceOptions {
    float band = 3.4641016f;       ///< in cells; for DistanceCaster
    float mergeThreshold = 0.05f;  ///< in cells; below 0: no merging; for DistanceCaster
};

class DistanceCaster {
public:
    static Result<DistanceCaster> create(const MeshBvh& mesh, const MeshSides& sides, const DistanceOptions& options,
                                         const CornerOctreeOptions& build);

    [[nodiscard]] const RootGrid& frame() const { return tree_.frame; }
    [[nodiscard]] uint64_t bytes() const { return tree_.bytes(); }
    /// Casts a ray. Any thread.
    template <class Work>
    [[nodiscard]] GridHit cast(const GridRay& ray, Work& work) const;

private:
    static constexpr int kMaxSteps = 4096;
    static constexpr float kHitDistance = 1e-3f, kLeastStep = 1e-3f;  // cells

    explicit DistanceCaster(CornerOctree tree) : tree_(std::move(tree)) {}

    CornerOctree tree_;
};

class AnalyticCaster {
public:
    static Result<AnalyticCaster> create(const MeshBvh& mesh, const MeshSides& sides, const CornerOctreeOptions& build);

    [[nodiscard]] const RootGrid& frame() const { return tree_.frame; }
    [[nodiscard]] uint64_t bytes() const { return tree_.bytes(); }
    /// Casts a ray. Any thread.
    template <class Work>
    [[nodiscard]] GridHit cast(const GridRay& ray, Work& work) const;

private:
    explicit AnalyticCaster(CornerOctree tree) : tree_(std::move(tree)) {}

    CornerOctree tree_;
};

inline Trilinear leafDistances(const CornerOctree& tree, int32_t leaf) {
    const uint32_t* codes = tree.leafCodes(leaf);
    std::array<float, 8> values;
    for (size_t i = 0; i < 8; ++i) values[i] = std::bit_cast<float>(codes[i]);
    return Trilinear(values);
}

template <class Work>
GridHit DistanceCaster::cast(const GridRay& ray, Work& work) const {
    NodeFinder finder(tree_);
    Trilinear f({});
    int32_t known = 0;
    float t = 0, lastT = 0, lastValue = 0;
    const glm::ivec3 last = tree_.frame.cells() - 1;
    for (int step = 0; step < kMaxSteps && t <= ray.tMax; ++step) {
        work.step();
        const glm::vec3 p = ray.origin + t * ray.direction;
        const int32_t word = finder.find(cellAt(p, last), work);
        if (!CornerOctree::isLeaf(word)) {
            lastValue = 0;
            t += std::max(tree_.emptyDistance(word), kLeastStep);
            continue;
        }
        if (word != known) {
            f = leafDistances(tree_, word);
            known = word;
            work.cell();
            work.fetch(2);
        }
        const auto size = float(1 << finder.level());
        const glm::vec3 at = (p - glm::vec3(finder.low())) / size;
        const float value = f.at(at);
        // 0 stands for an empty node, whose side is not stored.
        if (lastValue * value < 0) return {lastT + (t - lastT) * lastValue / (lastValue - value), f.gradient(at)};
        if (std::abs(value) < kHitDistance) return {t + std::abs(value), f.gradient(at)};
        lastT = t;
        lastValue = value;
        t += std::abs(value);
    }
    if (t <= ray.tMax) return {std::numeric_limits<float>::quiet_NaN(), {}};
    return {};
}

template <class Work>
GridHit AnalyticCaster::cast(const GridRay& ray, Work& work) const {
    GridHit hit;
    // The side at the exit of the leaf before, where it adjoins: it finds roots that rounding loses at the face.
    float side = 0, sideAt = -1;
    walkOctree(tree_, ray, work, [&](const WalkedNode& node) {
        if (!CornerOctree::isLeaf(node.word)) return node.tExit + tree_.emptyDistance(node.word);
        work.cell();
        work.fetch(2);
        const Trilinear f = leafDistances(tree_, node.word);
        const glm::vec3 entry = glm::clamp(ray.origin + node.t * ray.direction - glm::vec3(node.low), 0.0f, 1.0f);
        const Cubic cubic = cubicAlong(f, entry, ray.direction);
        const float length = node.tExit - node.t;
        const bool crossed = sideAt == node.t && side * cubic.c[0] < 0;
        const float u = crossed ? 0 : firstRoot(cubic, length);
        if (u <= length) {
            hit = {node.t + u, f.gradient(entry + u * ray.direction)};
            return kStopWalk;
        }
        side = cubic.at(length);
        sideAt = node.tExit;
        return node.tExit;
    });
    return hit;
}

}  // namespace vcp
