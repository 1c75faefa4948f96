// Where points and lines of the world are in a picture.
#pragma once

#include <optional>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "render/camera.h"
#include "viewer/annotation/pixels.h"

namespace vcp {

/// Projects into a picture of `size` pixels.
class Projector {
public:
    Projector(const Camera& camera, glm::uvec2 size)
        : camera_(camera), basis_(cameraBasis(camera, size.x, size.y)), size_(size) {}

    /// Returns where a point is, in the picture or beside it; nothing where it is behind the eye.
    [[nodiscard]] std::optional<glm::dvec2> point(glm::dvec3 point) const;
    /// Returns the part of a line that is in front of the eye; nothing where there is none.
    [[nodiscard]] std::optional<Segment> segment(glm::dvec3 from, glm::dvec3 to) const;

private:
    [[nodiscard]] glm::dvec3 seen(glm::dvec3 point) const;
    [[nodiscard]] glm::dvec2 pixel(glm::dvec3 seen) const;

    Camera camera_;
    CameraBasis basis_;
    glm::dvec2 size_;
};

}  // namespace vcp
