#include "viewer/section_handle.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace vcp {

namespace {

// These lengths are in units of the layout.
constexpr double kArrow = 80, kRing = 48, kLeastArrow = 16, kReach = 8, kFootReach = 11;
constexpr int kRingPoints = 48;
// The part of the ring's radius by which the far side begins deeper than the foot.
constexpr double kFarSide = 0.3;

/// Returns world units per pixel at a point, or 0 behind the eye.
double unitsPerPixelAt(glm::dvec3 point, const OrbitCamera& camera, glm::ivec2 size) {
    const double depth = camera.depthOf(point);
    if (depth <= 0) return 0;
    const double height = camera.projection == Projection::Perspective
                              ? camera.viewHeight() * depth / camera.focusDistance
                              : camera.viewHeight();
    return height / std::max(1, size.y);
}

/// Returns two unit vectors of the plane.
std::pair<glm::dvec3, glm::dvec3> axesOf(glm::dvec3 normal) {
    const glm::dvec3 other = std::abs(normal.x) < 0.7 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    const glm::dvec3 u = glm::normalize(glm::cross(normal, other));
    return {u, glm::cross(normal, u)};
}

double distanceToSegment(glm::dvec2 p, glm::dvec2 a, glm::dvec2 b) {
    const glm::dvec2 ab = b - a;
    const double t = glm::dot(ab, ab) > 0 ? std::clamp(glm::dot(p - a, ab) / glm::dot(ab, ab), 0.0, 1.0) : 0;
    return glm::distance(p, a + t * ab);
}

double distanceToRing(glm::dvec2 p, const std::vector<glm::dvec2>& ring) {
    double least = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < ring.size(); ++i)
        least = std::min(least, distanceToSegment(p, ring[i], ring[(i + 1) % ring.size()]));
    return least;
}

}  // namespace

glm::dvec3 onPlane(const SectionPlane& plane, glm::dvec3 point) {
    return point -
           plane.normal * ((glm::dot(plane.normal, point) - plane.offset) / glm::dot(plane.normal, plane.normal));
}

std::optional<SectionHandle> sectionHandle(const SectionPlane& plane, size_t number, glm::dvec3 anchor,
                                           const OrbitCamera& camera, glm::ivec2 size, double scale) {
    const double units = unitsPerPixelAt(anchor, camera, size) * scale;
    const auto foot = camera.pixelOf(anchor, size);
    if (!(units > 0) || !foot) return std::nullopt;
    const glm::dvec3 normal = glm::normalize(plane.normal);
    SectionHandle handle{.plane = number, .anchor = anchor, .foot = *foot, .tip = *foot, .ring = {}};
    if (const auto tip = camera.pixelOf(anchor + normal * (kArrow * units), size)) handle.tip = *tip;
    handle.isAlongView = glm::distance(handle.tip, handle.foot) < kLeastArrow * scale;
    const auto [u, v] = axesOf(normal);
    for (int i = 0; i < kRingPoints; ++i) {
        const double angle = 2 * std::numbers::pi * i / kRingPoints;
        const auto at = camera.pixelOf(anchor + (u * std::cos(angle) + v * std::sin(angle)) * (kRing * units), size);
        if (at) handle.ring.push_back(*at);
    }
    return handle;
}

SectionGrab grabAt(std::span<const SectionHandle> handles, glm::dvec2 pixel, double scale) {
    SectionGrab grab;
    double nearest = kReach * scale;
    for (const SectionHandle& handle : handles) {
        const double toFoot = glm::distance(pixel, handle.foot) * kReach / kFootReach;
        const double toArrow =
            handle.isAlongView ? toFoot : std::min(toFoot, distanceToSegment(pixel, handle.foot, handle.tip));
        if (toArrow < nearest) grab = {SectionGrip::Move, handle.plane}, nearest = toArrow;
    }
    if (grab.grip != SectionGrip::None) return grab;
    for (const SectionHandle& handle : handles) {
        const double toRing = distanceToRing(pixel, handle.ring);
        if (toRing < nearest) grab = {SectionGrip::Turn, handle.plane}, nearest = toRing;
    }
    return grab;
}

SectionDrag::SectionDrag(const SectionHandle& handle, SectionGrip grip, const SectionPlane& plane, glm::dvec2 pressed,
                         const OrbitCamera& camera, glm::ivec2 size, double scale)
    : grip_(grip),
      plane_(handle.plane),
      before_(plane),
      anchor_(handle.anchor),
      normal_(glm::normalize(plane.normal)),
      isAlongView_(handle.isAlongView),
      pressed_(pressed),
      camera_(camera),
      size_(size),
      radius_(kRing * scale),
      unitsPerPixel_(unitsPerPixelAt(handle.anchor, camera, size)) {
    const auto [u, v] = axesOf(normal_);
    double nearest = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < handle.ring.size(); ++i) {
        const double distance = glm::distance(handle.ring[i], pressed);
        if (distance >= nearest) continue;
        nearest = distance;
        const double angle = 2 * std::numbers::pi * double(i) / kRingPoints;
        const glm::dvec3 arm = u * std::cos(angle) + v * std::sin(angle);
        side_ = glm::dot(arm, camera.forwardVector()) > kFarSide ? -1 : 1;
    }
}

/// Returns where along the normal, from the foot, the cursor is: nearest to its ray.
double SectionDrag::along(glm::dvec2 pixel) const {
    if (isAlongView_) return (pressed_.y - pixel.y) * unitsPerPixel_;
    const CameraRay ray = camera_.rayThrough(pixel, size_);
    const glm::dvec3 between = anchor_ - ray.origin;
    const double cosine = glm::dot(ray.direction, normal_);
    const double sine2 = std::max(1 - cosine * cosine, 1e-4);
    return (cosine * glm::dot(ray.direction, between) - glm::dot(normal_, between)) / sine2;
}

SectionPlane SectionDrag::at(glm::dvec2 pixel, double farthest) const {
    SectionPlane plane = before_;
    if (pixel == pressed_) return plane;
    if (grip_ == SectionGrip::Move) {
        plane.offset += std::clamp(along(pixel) - along(pressed_), -farthest, farthest) * glm::length(before_.normal);
    } else if (grip_ == SectionGrip::Turn) {
        const glm::dvec2 by = (pixel - pressed_) * (side_ / radius_);
        const glm::dvec3 axis = camera_.upVector() * by.x + camera_.rightVector() * by.y;
        plane.normal = glm::angleAxis(glm::length(by), glm::normalize(axis)) * before_.normal;
        plane.offset = glm::dot(plane.normal, anchor_);
    }
    return plane;
}

}  // namespace vcp
