// Draws remeshed surfaces (mesostructure/remesh/remesher.h): the processor remeshes the surface for the view, the
// device rasterizes the triangles into images of the picture's size, and a compute pass takes those of their pixels
// into the mesostructure's hits that are nearer (shaders/remesh.vert, remesh.frag, remesh_merge.comp).
//
// Reads vertices, hits; writes images, hits. Barriers are recorded here; begins and ends with barrierToAll.
#pragma once

#include <array>

#include "render/camera.h"
#include "render/meso_surface.h"
#include "render/passes/frame_resources.h"
#include "render/passes/meso_resources.h"
#include "render/vulkan/raster_pipeline.h"

namespace vcp {

/// Where a picture, or a tile of one, is seen from.
struct RemeshLook {
    Camera camera;            ///< of the whole picture
    PictureTile tile;         ///< of which `size` pixels are drawn
    glm::dvec2 upperLeft{0};  ///< as upperLeft() in frame_setup.h
    PictureSize size;
};

/// The mesh of one surface in one frame.
struct RemeshBuffers {
    Buffer vertices, indices;
    uint32_t indexCount = 0;
};

/// What a frame's remeshed surfaces are drawn into, one after the other.
struct RemeshTarget {
    RasterTarget images;
    std::array<MesoTexels, 2> copies;  ///< hits and normals, as remesh.frag writes them
    std::vector<RemeshBuffers> meshes;
    meso::RemeshMesh<float> mesh;  ///< of the last surface; kept for its memory
};

class RemeshRaster {
public:
    explicit RemeshRaster(Device& device) : device_(device) {}

    /// Makes the images. Errors: Device; Limit; Unsupported, as RasterPipeline::create.
    Result<void> prepare(RemeshTarget& target, PictureSize size, size_t surfaces);
    /// Remeshes a surface for a view. Precondition: no frame in flight uses the target. Errors: Device; those of
    /// meso::remesh.
    Result<void> remesh(RemeshTarget& target, size_t number, const RemeshedSurface& surface, const RemeshLook& look);
    /// Draws a surface into the images and copies them.
    void record(VkCommandBuffer commands, const RemeshTarget& target, size_t number, const RemeshedSurface& surface,
                const RemeshLook& look) const;

private:
    Result<void> upload(Buffer& buffer, std::span<const std::byte> bytes, VkBufferUsageFlags use) const;

    Device& device_;
    RasterPipeline pipeline_;
};

}  // namespace vcp
