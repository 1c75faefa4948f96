// A triangle of a page in an image of its file.
#pragma once

#include <optional>

#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include "octree/image/image_filter.h"
#include "octree/page/page.h"

namespace vcp {

struct ImagedTriangle {
    uint32_t material;  ///< its row in the file's table
    const ImageSet::Image* image;
    ImageWraps wraps;
    glm::vec4 factor;           ///< RGBA, 0 to 1: multiplies what the image shows
    glm::vec2 place, toB, toC;  ///< coordinates of the first corner; from there to the others

    /// Returns the coordinates at a point, by the weights of the second and the third corner.
    [[nodiscard]] glm::vec2 at(float weightB, float weightC) const { return place + weightB * toB + weightC * toC; }
};

/// Returns a triangle in its image; nothing where it has none, or that is not shown. `corners`: its vertices
/// in the page, which may name materials that there are not. `images` must outlive the result.
std::optional<ImagedTriangle> imagedTriangle(const ImageSet& images, const PageView& page, const Index3& corners);

}  // namespace vcp
