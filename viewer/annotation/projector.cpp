#include "viewer/annotation/projector.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace vcp {

namespace {

// A segment is cut off where it is nearer to the eye's plane than this part of its length, or of its distance.
constexpr double kNear = 1e-6;

}  // namespace

/// Returns a point in the camera's axes: right, up, forward.
glm::dvec3 Projector::seen(glm::dvec3 point) const {
    const glm::dvec3 from = point - camera_.eye;
    return {glm::dot(from, basis_.right), glm::dot(from, basis_.up), glm::dot(from, basis_.forward)};
}

glm::dvec2 Projector::pixel(glm::dvec3 seen) const {
    const double depth = camera_.projection == Projection::Perspective ? seen.z : 1;
    return size_ * 0.5 * glm::dvec2(1 + seen.x / (depth * basis_.halfWidth), 1 - seen.y / (depth * basis_.halfHeight));
}

std::optional<glm::dvec2> Projector::point(glm::dvec3 point) const {
    const glm::dvec3 at = seen(point);
    if (camera_.projection == Projection::Perspective && !(at.z > kNear * glm::length(at))) return std::nullopt;
    return pixel(at);
}

std::optional<Segment> Projector::segment(glm::dvec3 from, glm::dvec3 to) const {
    glm::dvec3 a = seen(from), b = seen(to);
    if (camera_.projection == Projection::Perspective) {
        const double near = kNear * (glm::length(a) + glm::length(b));
        if (!(a.z > near) && !(b.z > near)) return std::nullopt;
        if (!(a.z > near)) a = glm::mix(b, a, (b.z - near) / (b.z - a.z));
        if (!(b.z > near)) b = glm::mix(a, b, (a.z - near) / (a.z - b.z));
    }
    return Segment{pixel(a), pixel(b)};
}

}  // namespace vcp
