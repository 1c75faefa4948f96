// What a picture shows that another does not: error of its light, isolated pixels, silhouettes, normals.
//
// Light is what a screen gets, encoded, 0 to 1. The picture compared with is the mesh's own, many samples a pixel.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "builder/measure/quantile.h"
#include "render/camera.h"

namespace vcp {

/// A picture of light: upper row first, all spans of width * height.
struct LightPicture {
    glm::ivec2 size{0};
    std::vector<float> light;        ///< encoded, 0 to 1
    std::vector<float> depth;        ///< world units along the unit ray; infinite where nothing is hit
    std::vector<glm::vec3> normals;  ///< unit, towards the viewer, world axes; 0 where nothing is hit
    std::vector<float> coverage;     ///< part of the pixel where something is hit
};

/// Returns the root of the mean square difference of light.
double lightError(const LightPicture& reference, const LightPicture& picture);

/// An isolated pixel differs in light from all eight neighbours by more than this, while its depth does not.
inline constexpr float kIsolatedLight = 40.0f / 255;
/// Depth does not differ where it is, from each neighbour's, less apart than so many footprints of a pixel over the
/// mean cosine between ray and normal of the neighbours; a cosine counts as at least kIsolatedCosine.
inline constexpr double kIsolatedFootprints = 4;
inline constexpr double kIsolatedCosine = 0.1;

/// Returns the isolated pixels, in order. All nine pixels must show something.
std::vector<glm::ivec2> isolatedPixels(const LightPicture& picture, const Camera& camera);

/// How the outlines of two pictures differ. A pixel is of the outline where it is covered, by half or more, and one of
/// its four neighbours is not.
struct SilhouetteDifference {
    uint64_t pixels = 0;       ///< covered in one picture and not in the other
    Quantiles distancePixels;  ///< from each pixel of an outline to the nearest of the other, both ways
};
SilhouetteDifference silhouetteDifference(const LightPicture& reference, const LightPicture& picture);

/// Returns the angles between normals, in degrees, of pixels that both pictures cover wholly. The reference's normals
/// are means over the pixel.
Quantiles normalDifference(const LightPicture& reference, const LightPicture& picture);

}  // namespace vcp
