#include "viewer/bench/peers/distance_octree.h"

#include <cmath>

#include "builder/paper/paper_octree.h"

namespace vcp {

namespace {

class BandField final : public CornerField {
public:
    explicit BandField(const DistanceOptions& options) : options_(options) {}
    [[nodiscard]] float band() const override { return options_.band; }
    [[nodiscard]] bool isSigned() const override { return true; }
    [[nodiscard]] float mergeThreshold() const override { return options_.mergeThreshold; }
    [[nodiscard]] float mergeError(const CornerSamples& corners, float size, glm::vec3 at,
                                   const CornerSample& exact) const override {
        return vectorMergeError(corners, size, at, exact);
    }
    [[nodiscard]] uint32_t pack(const CornerSample& sample, float) const override {
        return std::bit_cast<uint32_t>(sample.distance);
    }

private:
    const DistanceOptions& options_;
};

class CrossingField final : public CornerField {
public:
    /// The corners of a cell that the surface crosses are all this near.
    [[nodiscard]] float band() const override { return 1.7320509f; }
    [[nodiscard]] bool isSigned() const override { return true; }
    [[nodiscard]] bool keepCell(const CornerSamples& corners) const override {
        int behind = 0, before = 0;
        for (const CornerSample& corner : corners) {
            behind += corner.distance <= 0 ? 1 : 0;
            before += corner.distance >= 0 ? 1 : 0;
        }
        return behind > 0 && before > 0;
    }
    [[nodiscard]] uint32_t pack(const CornerSample& sample, float) const override {
        return std::bit_cast<uint32_t>(sample.distance);
    }
};

/// Returns the root in [a, b] of a function that is monotone there and changes sign: Newton's steps, halved where they
/// leave.
float rootBetween(const Cubic& f, float a, float b, float fa) {
    const auto [c0, c1, c2, c3] = f.c;
    float u = 0.5f * (a + b);
    for (int iteration = 0; iteration < 12; ++iteration) {
        const float value = f.at(u), slope = c1 + u * (2 * c2 + 3 * c3 * u);
        if ((value < 0) == (fa < 0))
            a = u;
        else
            b = u;
        float next = u - value / slope;
        if (!(next >= a && next <= b)) next = 0.5f * (a + b);
        if (std::abs(next - u) <= 1e-6f) return next;
        u = next;
    }
    return u;
}

}  // namespace

Cubic cubicAlong(const Trilinear& f, glm::vec3 p, glm::vec3 d) {
    // Along the ray: f = A(u) + B(u) z with z = p.z + u d.z; A and B quadratic.
    const float a0 = f.k + f.x * p.x + (f.y + f.xy * p.x) * p.y;
    const float a1 = f.x * d.x + f.y * d.y + f.xy * (p.x * d.y + d.x * p.y), a2 = f.xy * d.x * d.y;
    const float b0 = f.z + f.xz * p.x + (f.yz + f.xyz * p.x) * p.y;
    const float b1 = f.xz * d.x + f.yz * d.y + f.xyz * (p.x * d.y + d.x * p.y), b2 = f.xyz * d.x * d.y;
    return {{a0 + b0 * p.z, a1 + b1 * p.z + b0 * d.z, a2 + b2 * p.z + b1 * d.z, b2 * d.z}};
}

float firstRoot(const Cubic& f, float end) {
    const auto [c0, c1, c2, c3] = f.c;
    if (c0 == 0) return 0;
    // Where the slope is 0: 3 c3 u^2 + 2 c2 u + c1, by the form that does not cancel.
    std::array<float, 3> until = {end, end, end};
    int pieces = 1;
    const float discriminant = c2 * c2 - 3 * c3 * c1;
    if (discriminant > 0) {
        const float q = -(c2 + std::copysign(std::sqrt(discriminant), c2));
        float first = c1 / q, second = q / (3 * c3);
        if (first > second) std::swap(first, second);
        for (const float u : {first, second})
            if (u > 0 && u < end) {
                until[pieces] = end;
                until[pieces++ - 1] = u;
            }
    }
    float a = 0, fa = c0;
    for (int piece = 0; piece < pieces; ++piece) {
        const float b = until[piece], fb = f.at(b);
        if ((fa < 0) != (fb < 0) || fb == 0) return rootBetween(f, a, b, fa);
        a = b;
        fa = fb;
    }
    return std::numeric_limits<float>::infinity();
}

Result<DistanceCaster> DistanceCaster::create(const MeshBvh& mesh, const MeshSides& sides,
                                              const DistanceOptions& options, const CornerOctreeOptions& build) {
    VCP_TRY_ASSIGN(auto tree, buildCornerOctree(mesh, &sides, BandField(options), build));
    return DistanceCaster(std::move(tree));
}

Result<AnalyticCaster> AnalyticCaster::create(const MeshBvh& mesh, const MeshSides& sides,
                                              const CornerOctreeOptions& build) {
    // Empty nodes are left at their exit, and beyond it by the distance that may be stepped from there.
    CornerOctreeOptions safe = build;
    safe.safeEmpty = true;
    VCP_TRY_ASSIGN(auto tree, buildCornerOctree(mesh, &sides, CrossingField(), safe));
    return AnalyticCaster(std::move(tree));
}

}  // namespace vcp
