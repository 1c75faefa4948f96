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

using f32::ImagePlaces;
inline ImagePlaces placesOf(const ImageSet::Image& image, const f32::ImageFootprint& footprint) {
    return f32::imagePlaces(footprint, int(image.finest), int(image.levels.size() - image.finest));
}

/// Returns the mean over a footprint about `at`, in coordinates of the image ((0, 0): its upper left corner): encoded
/// for the screen and with alpha, 0 to 1. What is transparent lends no colour; where all is, it is 0. Any
/// numbers do: places more than 2^23 texels away, or that are no numbers, are taken for 0. Where a level's tiles are
/// not in memory, the next coarser one is read. Precondition: the image is shown. Any thread.
glm::vec4 filteredColour(const ImageSet::Image& image, ImageWraps wraps, glm::vec2 at, const ImagePlaces& places);

}  // namespace vcp
