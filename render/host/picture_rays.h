// The rays of a picture as the host casts them: linear in the pixel's place.
#pragma once

#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "render/host/section_cut.h"

namespace vcp {

/// The rays of a pinhole or an orthographic camera, in world space. The ray at (x, y), in pixels from the picture's
/// upper left corner, begins at origin + x originPerX + y originPerY and runs along direction + x directionPerX + y
/// directionPerY, which need not have unit length. A pinhole's rays share their origin (originPerX and originPerY are
/// zero), an orthographic camera's their direction, which is at right angles to both steps of the origin.
struct PictureRays {
    glm::dvec3 origin{0}, originPerX{0}, originPerY{0};
    glm::dvec3 direction{0}, directionPerX{0}, directionPerY{0};
    glm::ivec2 size{0};                ///< pixels
    std::vector<SectionCut> sections;  ///< only what all of them keep is seen; at most frame::kMaxSections

    [[nodiscard]] glm::dvec3 originAt(double x, double y) const { return origin + x * originPerX + y * originPerY; }
    [[nodiscard]] glm::dvec3 directionAt(double x, double y) const {
        return direction + x * directionPerX + y * directionPerY;
    }
};

}  // namespace vcp
