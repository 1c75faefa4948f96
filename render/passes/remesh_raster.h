// Draws remeshed surfaces (mesostructure/remesh/remesher.h): the device sweeps their pieces for the view
// (passes/remesh_sweep.h) and rasterizes the triangles into images of the picture's size; a compute pass takes those of
// their pixels into the mesostructure's hits that are nearer (shaders/remesh.vert, remesh.frag, remesh_merge.comp).
//
// Reads levels, pieces, hits; writes images, hits. Barriers are recorded here; begins and ends with barrierToAll.
#pragma once

#include <array>

#include "render/camera.h"
#include "render/meso_surface.h"
#include "render/passes/frame_resources.h"
#include "render/passes/meso_resources.h"
#include "render/passes/remesh_sweep.h"
#include "render/vulkan/raster_pipeline.h"

namespace vcp {

/// Where a picture, or a tile of one, is seen from.
struct RemeshLook {
    Camera camera;            ///< of the whole picture
    PictureTile tile;         ///< of which `size` pixels are drawn
    glm::dvec2 upperLeft{0};  ///< as upperLeft() in frame_setup.h
    PictureSize size;
};

/// What remesh.vert and remesh.frag are pushed (shaders/remesh_view.glsl).
struct RemeshProjection {
    glm::vec4 plane, depth;
};

/// Makes the pipeline that draws what was remeshed: depth along the unit ray, the place in the tile and the base
/// triangle's number. Errors: as RasterPipeline::create.
Result<RasterPipeline> createRemeshPipeline(const Device& device);
inline constexpr std::array<VkFormat, 1> kRemeshColours{VK_FORMAT_R32G32B32A32_SFLOAT};

/// One surface in one frame.
struct RemeshDrawing {
    std::vector<RemeshSwept> batches;
    meso::RemeshMath<float>::RemeshView view{};
};

/// What a frame's remeshed surfaces are drawn into, one after the other.
struct RemeshTarget {
    RasterTarget images;
    MesoTexels hits;  ///< a copy, as remesh.frag writes them
    std::vector<RemeshDrawing> drawings;
    meso::RemeshPieces pieces;   ///< of the last surface; kept for its memory
    double certifiedPixels = 0;  ///< of all surfaces, as meso::RemeshCounts has them
    uint64_t uncertified = 0;
};

class RemeshRaster {
public:
    explicit RemeshRaster(Device& device) : device_(device), sweep_(device) {}

    /// Chooses a surface's certified cells, as remesh() does. `shareOut`: in place of the surface's own. Errors:
    /// Cancelled.
    static Result<void> chooseCells(const RemeshedSurface& surface, const RemeshLook& look,
                                    const RemeshShareOut& shareOut);

    /// Makes the images. Errors: Device; Limit; Unsupported, as RasterPipeline::create.
    Result<void> prepare(RemeshTarget& target, PictureSize size, size_t surfaces);
    /// Makes and uploads the pieces of a surface for a view. `heights`: the surface's.
    /// Precondition: no frame in flight uses the target. Errors: Device; those of meso::makeRemeshPieces.
    Result<void> remesh(RemeshTarget& target, size_t number, const RemeshedSurface& surface, const HeightPool& heights,
                        const RemeshLook& look);
    /// Sweeps a surface's pieces, draws them into the images and copies these.
    void record(VkCommandBuffer commands, const RemeshTarget& target, size_t number, const RemeshedSurface& surface,
                const RemeshLook& look) const;

private:
    Device& device_;
    RemeshSweepPass sweep_;
    RasterPipeline pipeline_;
};

}  // namespace vcp
