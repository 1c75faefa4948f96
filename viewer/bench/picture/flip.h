// LDR-FLIP: how different two pictures look to a person who flips between them (Andersson, Nilsson, Akenine-Moller,
// Oskarsson, Astrom, Fairchild 2020, "FLIP: A Difference Evaluator for Alternating Images"). Sections and equations of
// that paper are named where they are computed; constants are the paper's.
#pragma once

#include <vector>

#include <glm/vec3.hpp>

namespace vcp {

/// The paper's viewer: 0.7 m before a screen of 3840 pixels and 0.7 m across.
inline constexpr double kFlipPixelsPerDegree = 67.020643276582254;

/// A picture in sRGB, encoded, each value 0 to 1: width * height pixels, upper row first.
struct ColourPicture {
    int width = 0, height = 0;
    std::vector<glm::dvec3> pixels;
};

/// Returns the difference at each pixel, from 0, no difference, to 1. It is symmetric in its pictures. Precondition:
/// both have the same size, at least 1 x 1.
std::vector<double> flip(const ColourPicture& reference, const ColourPicture& test,
                         double pixelsPerDegree = kFlipPixelsPerDegree);

}  // namespace vcp
