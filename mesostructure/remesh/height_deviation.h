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

/// What a search starts and ends with, and what it takes.
struct DeviationSearch {
    double known = 0;       ///< what is known already
    double enough = 1e300;  ///< the search ends at the first difference above it
    uint64_t looked = 0;    ///< the texels that were looked at are added
};

/// Returns the greater of what is known and the most by which the map, bilinear between its texels, differs from what
/// is linear between three corners, anywhere in the triangle: exact but for rounding, also where the corners lie on a
/// line. Above `enough` it is some difference that is.
double heightDeviation(const HeightLevels& levels, const std::array<HeightCorner, 3>& corners, DeviationSearch& search);

/// The same without a search to go on with.
inline double heightDeviation(const HeightLevels& levels, const std::array<HeightCorner, 3>& corners) {
    DeviationSearch all;
    return heightDeviation(levels, corners, all);
}

}  // namespace vcp::meso
