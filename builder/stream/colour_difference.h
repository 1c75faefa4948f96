// How different two colours look: the distance in OKLab (Ottosson 2020, "A perceptual color space for image
// processing"), times 100. Differences below 2 are hard to see side by side.
#pragma once

#include <glm/vec3.hpp>

#include "builder/stream/material.h"

namespace vcp {

/// Converts linear light in the primaries of sRGB, 0 to 1, to OKLab: lightness 0 to 1, and two axes of hue.
glm::dvec3 okLabOf(glm::dvec3 light);
/// Converts a stored colour; its alpha does not count.
glm::dvec3 okLabOfStored(Rgba8 colour);

/// Returns 100 times the distance of two lights in OKLab: black and white differ by 100.
double colourDifference(glm::dvec3 light, glm::dvec3 other);

}  // namespace vcp
