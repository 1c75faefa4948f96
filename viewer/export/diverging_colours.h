// Colours for signed numbers: blue below, grey at zero, red above.
//
// The three ends are those of Moreland 2009, "Diverging color maps for scientific visualization"; between them colours
// go straight through CIELAB, so equal steps of the number look equally large, both sides are equally light, and people
// who do not tell red from green read it, too.
#pragma once

#include <cstdint>

#include <glm/vec3.hpp>

namespace vcp {

/// Returns the colour of a number from -1 to 1, clamped: sRGB, 0 to 1. Not a number: a plain grey.
glm::dvec3 divergingColour(double value);

}  // namespace vcp
