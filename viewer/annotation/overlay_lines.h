// Lines in the world, painted over a picture: nothing in it hides them.
#pragma once

#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "render/camera.h"
#include "render/picture.h"

namespace vcp {

struct OverlayLine {
    std::vector<glm::dvec3> points;  ///< world; the line runs from each to the next
    glm::vec3 colour{1, 1, 1};       ///< as in pictures, 0 to 1
    float opacity = 1;               ///< 0 to 1
    float width = 2;                 ///< pixels of the picture
};

/// Paints the lines, with smooth edges, in their order. `camera`: the one that the picture was drawn for. What is
/// behind the eye is cut off. A line that crosses itself is as opaque there as elsewhere. All widths are multiplied by
/// `scale`.
void paintLines(std::span<const OverlayLine> lines, const Camera& camera, Picture& picture, float scale = 1);

}  // namespace vcp
