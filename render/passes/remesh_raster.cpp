#include "render/passes/remesh_raster.h"

#include <algorithm>
#include <cstddef>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include "render/remesh_frag_spirv.h"
#include "render/remesh_vert_spirv.h"

namespace vcp {

namespace {

using Vertex = meso::RemeshVertex<float>;
static_assert(sizeof(Vertex) == 24);

// Nearer than this part of a surface's size to the eye nothing is drawn.
constexpr double kNearestPart = 1e-5;

double sizeOf(const meso::RemeshSurface& surface) { return glm::length(surface.high - surface.low); }

double nearestOf(const meso::RemeshSurface& surface) { return kNearestPart * sizeOf(surface); }

meso::RemeshCamera cameraOf(const meso::RemeshSurface& surface, const RemeshLook& look) {
    const PictureTile& tile = look.tile;
    const CameraBasis basis = cameraBasis(look.camera, tile.fullWidth, tile.fullHeight);
    meso::RemeshCamera camera;
    camera.eye = look.camera.eye;
    camera.right = basis.right, camera.up = basis.up, camera.forward = basis.forward;
    camera.focal = tile.fullHeight / (2 * basis.halfHeight);
    camera.isParallel = look.camera.projection == Projection::Orthographic;
    const double stepX = 2 * basis.halfWidth / tile.fullWidth, stepY = 2 * basis.halfHeight / tile.fullHeight;
    // A pixel more on each side holds what rounding moves.
    const double left = look.upperLeft.x - 1, top = look.upperLeft.y - 1;
    camera.seen = {left * stepX - basis.halfWidth, basis.halfHeight - (top + look.size.height + 2) * stepY,
                   (left + look.size.width + 2) * stepX - basis.halfWidth, basis.halfHeight - top * stepY};
    // Cells are the whole picture's, so that tiles agree.
    camera.picture = glm::dvec4(-basis.halfWidth - stepX, -basis.halfHeight - stepY, basis.halfWidth + stepX,
                                basis.halfHeight + stepY);
    camera.nearest = nearestOf(surface);
    return camera;
}

Error tooMany(uint64_t pixels, uint64_t most) {
    return {.code = ErrorCode::Limit,
            .message = fmt::format("{} pixels of a remeshed surface; this device reads {} at most", pixels, most)};
}

}  // namespace

Result<RasterPipeline> createRemeshPipeline(const Device& device) {
    return RasterPipeline::create(device, {.vertex = kRemeshVertSpirv,
                                           .fragment = kRemeshFragSpirv,
                                           .vertexBytes = sizeof(Vertex),
                                           .attributes = {{VK_FORMAT_R32G32B32_SFLOAT, offsetof(Vertex, position)},
                                                          {VK_FORMAT_R32G32_SFLOAT, offsetof(Vertex, uv)},
                                                          {VK_FORMAT_R32_UINT, offsetof(Vertex, triangle)}},
                                           .pushBytes = sizeof(RemeshProjection),
                                           .colours = {kRemeshColours.begin(), kRemeshColours.end()}});
}

Result<void> RemeshRaster::chooseCells(const RemeshedSurface& surface, const RemeshLook& look,
                                       const RemeshShareOut& shareOut) {
    if (!surface.cells) return {};
    meso::RemeshOptions options = surface.options;
    options.shareOut = shareOut;
    meso::RemeshCounts counts;
    return surface.cells->choose(cameraOf(*surface.surface, look), options, counts);
}

Result<void> RemeshRaster::prepare(RemeshTarget& target, PictureSize size, size_t surfaces) {
    if (!pipeline_.exists()) {
        VCP_TRY_ASSIGN(pipeline_, createRemeshPipeline(device_));
    }
    target.drawings.resize(surfaces);
    const VkExtent2D extent{size.width, size.height};
    if (target.images.size().width == extent.width && target.images.size().height == extent.height) return {};
    if (size.pixels() > device_.limits().maxTexelBufferElements)
        return tooMany(size.pixels(), device_.limits().maxTexelBufferElements);
    target.images = {};
    const uint64_t bytes = size.pixels() * sizeof(glm::vec4);
    VCP_TRY_ASSIGN(
        target.hits.buffer,
        device_.createBuffer(bytes, VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                             MemoryUse::Local));
    VCP_TRY_ASSIGN(target.hits.view, device_.createTexelView(target.hits.buffer, kRemeshColours[0], bytes));
    VCP_TRY_ASSIGN(target.images, RasterTarget::create(device_, pipeline_, kRemeshColours, extent));
    return {};
}

Result<void> RemeshRaster::remesh(RemeshTarget& target, size_t number, const RemeshedSurface& surface,
                                  const HeightPool& heights, const RemeshLook& look) {
    RemeshDrawing& drawing = target.drawings[number];
    const meso::RemeshCamera camera = cameraOf(*surface.surface, look);
    if (surface.cells) {
        VCP_TRY(meso::makeRemeshPieces(*surface.cells, camera, surface.options, target.pieces, sweep_.limits()));
    } else {
        VCP_TRY(meso::makeRemeshPieces(*surface.surface, camera, surface.options, target.pieces, sweep_.limits()));
    }
    drawing.view = target.pieces.view;
    target.certifiedPixels = std::max(target.certifiedPixels, target.pieces.counts.boundPixels);
    target.uncertified += target.pieces.counts.uncertified;
    return sweep_.prepare(drawing.batches, target.pieces, heights);
}

void RemeshRaster::record(VkCommandBuffer commands, const RemeshTarget& target, size_t number,
                          const RemeshedSurface& surface, const RemeshLook& look) const {
    const PictureTile& tile = look.tile;
    const CameraBasis basis = cameraBasis(look.camera, tile.fullWidth, tile.fullHeight);
    const double width = look.size.width, height = look.size.height;
    // Pixels from the left are (x / halfWidth + 1) * fullWidth / 2 - upperLeft.x; from above, with y turned.
    RemeshProjection projection{};
    projection.plane = {tile.fullWidth / basis.halfWidth / width, -(tile.fullHeight / basis.halfHeight / height),
                        (tile.fullWidth - 2 * look.upperLeft.x) / width - 1,
                        (tile.fullHeight - 2 * look.upperLeft.y) / height - 1};
    const meso::RemeshSurface& drawn = *surface.surface;
    if (look.camera.projection == Projection::Orthographic) {
        const double far = glm::distance(0.5 * (drawn.low + drawn.high), look.camera.eye) + sizeOf(drawn);
        projection.depth = {-1 / far, 1, 0, 1};
    } else {
        projection.depth = {0, nearestOf(drawn), 1, 0};
    }
    const RemeshDrawing& drawing = target.drawings[number];
    barrierToAll(commands);
    sweep_.record(commands, drawing.batches, *drawn.heights, drawing.view);
    pipeline_.begin(commands, target.images.framebuffer(), target.images.size());
    vkCmdPushConstants(commands, pipeline_.layout(), pipeline_.pushStages(), 0, sizeof projection, &projection);
    drawSwept(commands, drawing.batches);
    vkCmdEndRenderPass(commands);
    target.images.copy(commands, 0, target.hits.buffer);
    barrierToAll(commands);
}

}  // namespace vcp
