#include "viewer/bench_cameras.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

namespace vcp {

namespace {

constexpr double kVerticalFov = 0.6;

/// Direction from the target to the eye: points of a Fibonacci spiral, the first at +z.
glm::dvec3 viewDirection(int view, int views) {
    const double z = views > 1 ? 1 - 2.0 * view / (views - 1) : 1;
    const double angle = view * std::numbers::pi * (3 - std::sqrt(5.0));
    const double r = std::sqrt(std::max(0.0, 1 - z * z));
    return {r * std::cos(angle), r * std::sin(angle), z};
}

/// A point of the mesh about the middle of what is seen from that side.
glm::dvec3 surfacePoint(const MeshBvh& mesh, glm::dvec3 centre, double radius, glm::dvec3 back, int view) {
    const glm::dvec3 side =
        glm::normalize(glm::cross(back, std::abs(back.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0)));
    const glm::dvec3 from = centre + 3 * radius * back + side * (0.1 * radius * (view % 3 - 1));
    const auto hit = mesh.nearestHit(from, -back);
    if (hit) return from - hit->t * back;
    const auto nearest = mesh.nearestPoint(centre + radius * back);
    return nearest ? nearest->point : centre;
}

}  // namespace

const std::vector<std::string>& benchCameraNames() {
    static const std::vector<std::string> names = {"whole", "half", "close", "cells"};
    return names;
}

std::optional<Camera> benchCamera(std::string_view name, const MeshBvh& mesh, double cell, glm::ivec2 size, int view,
                                  int views) {
    const auto& names = benchCameraNames();
    if (std::find(names.begin(), names.end(), name) == names.end()) return {};
    const glm::dvec3 back = viewDirection(view, views);
    const glm::dvec3 up = std::abs(back.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1);
    Camera camera = fitCamera(mesh.low(), mesh.high(), -back, up, kVerticalFov, static_cast<double>(size.x) / size.y);
    if (name == "whole") return camera;
    const glm::dvec3 centre = 0.5 * (mesh.low() + mesh.high());
    if (name == "half") {
        camera.eye = 0.5 * (camera.eye + centre);
        return camera;
    }
    const double radius = 0.5 * glm::distance(mesh.low(), mesh.high());
    const glm::dvec3 target = surfacePoint(mesh, centre, radius, back, view);
    double distance = glm::distance(camera.eye, centre) / 8;
    if (name == "cells") distance = cell * size.y / kCellsCameraPixels / (2 * std::tan(kVerticalFov / 2));
    camera.eye = target + distance * back;
    return camera;
}

}  // namespace vcp
