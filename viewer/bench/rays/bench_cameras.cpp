#include "viewer/bench/rays/bench_cameras.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

namespace vcp {

namespace {

constexpr double kVerticalFov = 0.6;

/// Returns the direction from the target to the eye: points of a Fibonacci spiral, the first at +z.
glm::dvec3 viewDirection(int view, int views) {
    const double z = views > 1 ? 1 - 2.0 * view / (views - 1) : 1;
    const double angle = view * std::numbers::pi * (3 - std::sqrt(5.0));
    const double r = std::sqrt(std::max(0.0, 1 - z * z));
    return {r * std::cos(angle), r * std::sin(angle), z};
}

/// Returns an axis or diagonal of a cell, from -1 to 1: axes first, then the faces' diagonals.
glm::dvec3 latticeDirection(int view) {
    static const std::vector<glm::dvec3> directions = [] {
        std::vector<glm::dvec3> all;
        for (int zeros = 2; zeros >= 0; --zeros)
            for (int i = 0; i < 27; ++i) {
                const glm::ivec3 d(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
                if ((d.x == 0) + (d.y == 0) + (d.z == 0) == zeros) all.emplace_back(d);
            }
        return all;
    }();
    return directions[size_t(view) % directions.size()];
}

/// Returns the corner of the grid nearest to p.
glm::dvec3 nearestCorner(const CellGrid& grid, glm::dvec3 p) {
    return grid.origin + grid.cell * glm::round((p - grid.origin) / grid.cell);
}

Camera latticeCamera(const MeshBvh& mesh, const CellGrid& grid, glm::ivec2 size, int view) {
    const glm::dvec3 d = latticeDirection(view);
    const double radius = 0.5 * glm::distance(mesh.low(), mesh.high());
    Camera camera;
    camera.projection = Projection::Orthographic;
    camera.forward = glm::normalize(d);
    // Sideways, corners are a whole number of pixels apart.
    const glm::dvec3 side = d.x != 0 && d.y != 0 ? glm::dvec3(-d.y, d.x, 0)
                            : d.x != 0           ? glm::dvec3(0, 1, 0)
                                                 : glm::dvec3(1, 0, 0);
    camera.up = glm::cross(side, d);
    const double pixel = grid.cell * glm::length(side) / 4;
    camera.orthographicHeight = pixel * size.y;
    const CameraBasis basis = cameraBasis(camera, uint32_t(size.x), uint32_t(size.y));
    const glm::dvec3 corner = nearestCorner(grid, 0.5 * (mesh.low() + mesh.high()));
    const auto steps = std::ceil(1.5 * radius / (grid.cell * glm::length(d)));
    // The ray through the middle of a pixel goes through the corner.
    camera.eye = corner - steps * grid.cell * d +
                 0.5 * pixel * ((size.x % 2 == 0 ? 1.0 : 0.0) * basis.right + (size.y % 2 == 0 ? 1.0 : 0.0) * basis.up);
    return camera;
}

/// Returns a point of the mesh near the middle of what is seen from that side.
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
    static const std::vector<std::string> names = {"whole", "half", "close", "cells", "lattice", "grazing"};
    return names;
}

std::optional<Camera> benchCamera(std::string_view name, const MeshBvh& mesh, const CellGrid& grid, glm::ivec2 size,
                                  int view, int views) {
    const auto& names = benchCameraNames();
    if (std::find(names.begin(), names.end(), name) == names.end()) return {};
    if (name == "lattice") return latticeCamera(mesh, grid, size, view);
    const glm::dvec3 back = viewDirection(view, views);
    const glm::dvec3 up = std::abs(back.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1);
    Camera camera = fitCamera(mesh.low(), mesh.high(), -back, up, kVerticalFov, double(size.x) / size.y);
    if (name == "whole") return camera;
    const glm::dvec3 centre = 0.5 * (mesh.low() + mesh.high());
    if (name == "half") {
        camera.eye = 0.5 * (camera.eye + centre);
        return camera;
    }
    const double radius = 0.5 * glm::distance(mesh.low(), mesh.high());
    const glm::dvec3 target = surfacePoint(mesh, centre, radius, back, view);
    double distance = glm::distance(camera.eye, centre) / 8;
    if (name == "cells") distance = grid.cell * size.y / kCellsCameraPixels / (2 * std::tan(kVerticalFov / 2));
    if (name == "grazing") {
        const auto hit = mesh.nearestHit(target + distance * back, -back);
        const glm::dvec3 n = hit ? glm::normalize(hit->normal) : back;
        camera.forward = glm::normalize(glm::cross(n, std::abs(n.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0)));
        camera.up = n;
        camera.eye = target + grid.cell * (3.0 * n - 100.0 * camera.forward);
        return camera;
    }
    camera.eye = target + distance * back;
    return camera;
}

std::vector<Camera> diveCameras(const MeshBvh& mesh, const CellGrid& grid, glm::ivec2 size, int steps, int view,
                                int views) {
    const Camera whole = *benchCamera("whole", mesh, grid, size, view, views);
    const Camera cells = *benchCamera("cells", mesh, grid, size, view, views);
    const glm::dvec3 middle = 0.5 * (mesh.low() + mesh.high());
    const double perCell = size.y / (2 * std::tan(whole.verticalFov / 2));
    const glm::dvec3 forward = glm::normalize(whole.forward);
    const glm::dvec3 target = cells.eye + glm::normalize(cells.forward) * (grid.cell * perCell / kCellsCameraPixels);
    const double far = glm::distance(whole.eye, middle), near = std::min(grid.cell * perCell / kDiveCellPixels, far);
    std::vector<Camera> cameras;
    for (int step = 1; step <= steps; ++step) {
        const double distance = far * std::pow(near / far, double(step) / steps);
        const glm::dvec3 seen = target + (middle - target) * ((distance - near) / std::max(far - near, 1e-300));
        Camera camera = whole;
        camera.eye = seen - distance * forward;
        cameras.push_back(camera);
    }
    return cameras;
}

}  // namespace vcp
