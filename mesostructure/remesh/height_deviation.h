// How far a triangle is from the height map that it stands for. For this room alone.
#pragma once

#include <array>

#include <glm/vec2.hpp>

#include "mesostructure/remesh/height_levels.h"

namespace vcp::meso {

/// A corner of a triangle over the map.
struct HeightCorner {
    glm::dvec2 at;  ///< tile units
    double height;  ///< as HeightLevel
};

/// Returns the most by which the map, bilinear between its texels, differs from what is linear between three corners,
/// anywhere in the triangle: exact but for rounding, also where the corners lie on a line. Ends at the first difference
/// above `enough`, which it returns.
double heightDeviation(const HeightLevels& levels, const std::array<HeightCorner, 3>& corners, double enough = 1e300);

}  // namespace vcp::meso
