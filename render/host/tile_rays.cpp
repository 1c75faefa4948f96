#include "render/host/tile_rays.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

namespace vcp {

namespace {

/// How far beyond its outermost rays a group of rays reaches, in pixels. It bridges rounding.
constexpr double kMargin = 1.0 / 64;

/// A section plane so near to a leaf's wall, in leaf edges, is in the wall: rays begin in the leaf on the side that is
/// kept.
constexpr double kInWall = 1e-6;

double sumOf(glm::dvec3 v) { return std::abs(v.x) + std::abs(v.y) + std::abs(v.z); }

/// Returns how far a cube's corner that is lowest over a plane lies over it, or below.
double lowestIn(const SectionCut& plane, glm::dvec3 lowest, double edge) {
    const glm::dvec3 n(plane);
    return glm::dot(n, lowest) + edge * (glm::min(n.x, 0.0) + glm::min(n.y, 0.0) + glm::min(n.z, 0.0)) - plane.w;
}

/// The plane through the rays `at` steps along `step` from the middle. `across`: the other step.
void setPlane(TilePlanes& planes, int index, const TileRays& rays, double at, bool alongX) {
    const glm::dvec3 originStep = alongX ? rays.originPerX : rays.originPerY;
    const glm::dvec3 directionStep = alongX ? rays.directionPerX : rays.directionPerY;
    const glm::dvec3 across = alongX ? rays.originPerY + rays.directionPerY : rays.originPerX + rays.directionPerX;
    glm::dvec3 n = glm::normalize(glm::cross(rays.direction + at * directionStep, across));
    if (glm::dot(n, originStep + directionStep) < 0) n = -n;
    planes.x[index] = float(n.x);
    planes.y[index] = float(n.y);
    planes.z[index] = float(n.z);
    planes.w[index] = float(-at * glm::dot(n, originStep));
    planes.sum[index] = float(sumOf(n));
}

}  // namespace

TileRays tileRays(const PictureRays& rays, const HostGrid& grid, glm::ivec2 corner) {
    const double x = corner.x + 0.5 * kTileWidth, y = corner.y + 0.5 * kTileHeight;
    const glm::dvec3 origin = rays.originAt(x, y), direction = rays.directionAt(x, y);
    const double perCell = 1 / grid.cell, perLength = 1 / glm::length(direction);
    return {(origin - grid.origin) * perCell,
            rays.originPerX * perCell,
            rays.originPerY * perCell,
            direction * perLength,
            rays.directionPerX * perLength,
            rays.directionPerY * perLength,
            rays.directionPerX == glm::dvec3(0) && rays.directionPerY == glm::dvec3(0),
            inCells(rays.sections, origin, grid.cell)};
}

TileSides tileSides(const TileRays& rays, int groupHeight) {
    TileSides sides{};
    const int rows = kTileHeight / groupHeight;
    for (int i = 0; i < kGroupColumns; ++i) {
        const double at = double(kFirstColumn) + i * kGroupWidth;
        setPlane(sides.first, i, rays, at - kMargin, true);
        setPlane(sides.last, i, rays, at + kGroupWidth - 1 + kMargin, true);
    }
    for (int j = 0; j < rows; ++j) {
        const double at = double(kFirstRow) + j * groupHeight;
        setPlane(sides.first, kGroupColumns + j, rays, at - kMargin, false);
        setPlane(sides.last, kGroupColumns + j, rays, at + groupHeight - 1 + kMargin, false);
    }
    return sides;
}

LeafRays leafRays(const TileRays& rays, glm::dvec3 lowest, double edge) {
    const double perEdge = 1 / edge;
    LeafRays leaf;
    leaf.distance = std::max(0.0f, float(glm::dot(lowest + 0.5 * edge, rays.direction)));
    const double distance = leaf.distance;
    leaf.start = glm::vec3((distance * rays.direction - lowest) * perEdge);
    leaf.startPerX = glm::vec3((distance * rays.directionPerX + rays.originPerX) * perEdge);
    leaf.startPerY = glm::vec3((distance * rays.directionPerY + rays.originPerY) * perEdge);
    leaf.tauMin = float(-distance * perEdge);
    leaf.edge = float(edge);
    const auto largest = [](glm::vec3 v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); };
    const float reach =
        1 + largest(leaf.start) + rays.reach.x * largest(leaf.startPerX) + rays.reach.y * largest(leaf.startPerY);
    leaf.rounding = 0x1p-22f * reach;
    leaf.cutCount = 0;
    leaf.hasSpans = rays.hasSpans;
    return leaf;
}

bool cutLeaf(const TileRays& rays, glm::dvec3 lowest, double edge, LeafRays& leaf) {
    for (const SectionCut& plane : rays.sections) {
        const glm::dvec3 normal(plane);
        const double height = lowestIn(plane, lowest, edge);
        if (height + edge * sumOf(normal) <= kInWall * edge) return false;
        if (height < kInWall * edge)
            leaf.cuts[leaf.cutCount++] = glm::vec4(normal, (plane.w - glm::dot(normal, lowest)) / edge);
    }
    return true;
}

}  // namespace vcp
