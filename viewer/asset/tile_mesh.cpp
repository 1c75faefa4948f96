#include "viewer/asset/tile_mesh.h"

#include <algorithm>
#include <array>
#include <limits>

#include <fmt/format.h>
#include <glm/common.hpp>

#include "builder/measure/indexed_mesh.h"
#include "mesostructure/base/surface_edges.h"

namespace vcp {

namespace {

glm::dvec3 turned(glm::dvec3 p, char up) {
    return up == 'x' ? glm::dvec3(p.y, p.z, p.x) : up == 'y' ? glm::dvec3(p.z, p.x, p.y) : p;
}

/// Joins corners at one place and refuses what is no surface, or has a border although it does not go on beyond the
/// tile. Whether what repeats is closed is for meso::meshShape to say.
Result<void> checkEdges(meso::BaseSurface& surface, const TileMeshOptions& options, const std::filesystem::path& path) {
    const auto named = [&](Error error) {
        error.file = path.string();
        return error;
    };
    meso::joinPositions(surface);
    const auto edges = meso::edgesOf(surface);
    if (!edges) return named(edges.error());
    if (edges->border > 0 && !options.period)
        return named({.message = fmt::format("the mesh is not closed: {} of its edges have a triangle on one side "
                                             "only, the first {}; close it, or say how far it repeats",
                                             edges->border, edges->firstBorder),
                      .element = fmt::format("triangle {}", edges->firstBorderTriangle)});
    return {};
}

}  // namespace

Result<TileMesh> readTileMesh(const std::filesystem::path& path, const TileMeshOptions& options) {
    const auto fail = [&](ErrorCode code, std::string message) {
        return Error{.code = code, .message = std::move(message), .file = path.string()};
    };
    LoadOptions loading;
    loading.mostTriangles = loading.mostPositions = 10'000'000;
    VCP_TRY_ASSIGN(auto loaded, loadMesh(path, loading));
    meso::BaseSurface surface{std::move(loaded.positions), std::move(loaded.triangles), {}};
    for (glm::dvec3& p : surface.positions) p = turned(p, options.up);
    VCP_TRY(checkEdges(surface, options, path));
    const auto& positions = surface.positions;
    const auto& triangles = surface.triangles;
    glm::dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
    for (const auto& triangle : triangles)
        for (const uint32_t corner : triangle)
            low = glm::min(low, positions[corner]), high = glm::max(high, positions[corner]);
    const glm::dvec3 size = high - low;
    if (!(std::max(size.x, size.y) > 0))
        return fail(ErrorCode::InvalidInput, "has no size across the tile; is another axis up?");

    TileMesh mesh;
    const double scale = options.period ? 1 / options.period->x : 0.9 / std::max(size.x, size.y);
    constexpr double kMargin = 0.02;
    mesh.extent = {1, options.period ? options.period->y * scale : 1, size.z * scale + 2 * kMargin};
    if (!(mesh.extent.z <= 16) || !(mesh.extent.y <= 64))
        return fail(ErrorCode::Limit, "the tile would be more than 16 times as high or 64 times as deep as it is wide");
    const glm::dvec3 shift = options.period
                                 ? glm::dvec3(0, 0, kMargin)
                                 : glm::dvec3(0.5 - 0.5 * size.x * scale, 0.5 - 0.5 * size.y * scale, kMargin);
    for (const auto& triangle : triangles) {
        meso::TileTriangle placed;
        for (int i = 0; i < 3; ++i)
            placed[i] = glm::clamp((positions[triangle[i]] - low) * scale + shift, glm::dvec3(-64, -64, 0),
                                   glm::dvec3(64, 64, mesh.extent.z));
        mesh.triangles.push_back(placed);
    }
    return mesh;
}

}  // namespace vcp
