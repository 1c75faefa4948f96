#include "viewer/asset/tile_mesh.h"

#include <algorithm>
#include <array>
#include <limits>

#include <glm/common.hpp>

#include "builder/mesh/open_mesh.h"

namespace vcp {

Result<TileMesh> readTileMesh(const std::filesystem::path& path, const TileMeshOptions& options) {
    const auto fail = [&](ErrorCode code, std::string message) {
        return Error{.code = code, .message = std::move(message), .file = path.string()};
    };
    constexpr size_t kMost = 10'000'000;
    MeshOpenOptions open;
    open.materials = false;
    VCP_TRY_ASSIGN(auto stream, openMesh(path, open));
    std::vector<glm::dvec3> positions;
    std::vector<std::array<uint64_t, 3>> triangles;
    for (MeshChunk chunk;;) {
        VCP_TRY_ASSIGN(const auto more, stream->next(chunk));
        if (!more) break;
        for (const glm::dvec3 p : chunk.positions)
            positions.push_back(options.up == 'x'   ? glm::dvec3(p.y, p.z, p.x)
                                : options.up == 'y' ? glm::dvec3(p.z, p.x, p.y)
                                                    : p);
        triangles.insert(triangles.end(), chunk.triangles.begin(), chunk.triangles.end());
        if (triangles.size() > kMost || positions.size() > kMost)
            return fail(ErrorCode::Limit, "a mesostructure has at most 10^7 triangles");
    }
    if (triangles.empty()) return fail(ErrorCode::InvalidInput, "has no triangle");
    glm::dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
    for (const auto& triangle : triangles)
        for (const uint64_t corner : triangle)
            low = glm::min(low, positions[corner]), high = glm::max(high, positions[corner]);
    const glm::dvec3 size = high - low;
    if (!(std::max(size.x, size.y) > 0))
        return fail(ErrorCode::InvalidInput, "has no size across the tile; is another axis up (--up)?");

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
