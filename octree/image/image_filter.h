// Reads images of a file with a filter (octree/shared/image_lookup.h), in linear light.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "octree/image/image_set.h"
#include "octree/surface/image_lookup.h"

namespace vcp {

/// How an image goes on beyond its edges.
struct ImageWraps {
    uint32_t u = f32::kWrapRepeat, v = f32::kWrapRepeat;
};

/// A footprint as an image is read with it: at so many places along it, each from two levels.
struct ImagePlaces {
    int count = 1;
    glm::vec2 along{0};  ///< the footprint's length as a step of coordinates
    size_t finer = 0;    ///< number of the finer level among those in memory
    float coarser = 0;   ///< share of the level after it
};
ImagePlaces placesOf(const ImageSet::Image& image, const f32::ImageFootprint& footprint);

/// Returns the mean over a footprint about `at`, in coordinates of the image ((0, 0): its upper left corner): encoded
/// for the screen and with alpha, 0 to 1. What is transparent lends no colour; where all is, it is 0. Any
/// numbers do: places more than 2^23 texels away, or that are no numbers, are taken for 0. Any thread.
glm::vec4 filteredColour(const ImageSet& set, const ImageSet::Image& image, ImageWraps wraps, glm::vec2 at,
                         const ImagePlaces& places);

}  // namespace vcp
