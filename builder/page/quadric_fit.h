// Measures how far points are from any quadric height field over a plane.
#pragma once

#include <cstddef>

#include <glm/vec3.hpp>

namespace vcp {

/// Returns the root mean square of what a least-squares quadric, in the two coordinates across the unit direction `n`,
/// leaves of the points' heights along n. The points are within a few units of (1/2, 1/2, 1/2); `count` is a multiple
/// of 8. In float: good to about 1e-4 of the points' extent. A ridge, for points that determine no quadric, adds 1e-6
/// of the sum of the coefficients' squares to the mean square.
double quadricResidual(const float* x, const float* y, const float* z, size_t count, glm::dvec3 n);

}  // namespace vcp
