// Evaluates f of a soft leaf, in double and in batches, and bounds it over a cube (docs/surface.md).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <glm/vec3.hpp>

namespace vcp {

/// f of a leaf, from its packed corners; in leaf space. It does not depend on the axis order of the faces.
class LeafSurface {
public:
    explicit LeafSurface(const std::array<uint32_t, 8>& codes);
    [[nodiscard]] double value(glm::dvec3 x) const;

    /// Evaluates `count` points (a multiple of kBatchStep) at once, in float: within kBatchRounding of value() for |x|
    /// up to 2.
    void evaluate(const float* x, const float* y, const float* z, float* value, size_t count) const;
    static constexpr size_t kBatchStep = 8;
    static constexpr double kBatchRounding = 4e-6;

    /// 16 points and their values.
    struct Batch {
        alignas(64) float x[16], y[16], z[16], value[16];
    };
    void evaluate(Batch& b) const { evaluate(b.x, b.y, b.z, b.value, 16); }

private:
    friend class BernsteinCube;
    std::array<double, 8> constant_;  ///< f = sum w_i (constant_i + slope_i . x)
    std::array<glm::dvec3, 8> slope_;
    std::array<float, 32> coefficients_;  ///< the same in float: constants, then slopes by axis
};

/// f over a cube as a tensor-product Bernstein polynomial of degree 2 an axis, which f is.
class BernsteinCube {
public:
    BernsteinCube(const LeafSurface& surface, double lower, double upper);
    /// Returns the least derivative in direction n, per leaf edge.
    [[nodiscard]] double minDerivative(glm::dvec3 n) const;
    /// Returns a bound on the second derivative in any direction.
    [[nodiscard]] double maxCurvature() const;
    /// The least and largest value on the face of `axis` at its lower (0) or upper (1) end.
    struct Range {
        double min, max;
    };
    [[nodiscard]] Range faceRange(int axis, int end) const;

private:
    [[nodiscard]] double at(int x, int y, int z) const { return c_[x + 3 * y + 9 * z]; }
    std::array<double, 27> c_;
    double width_;
};

}  // namespace vcp
