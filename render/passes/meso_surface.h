// Mesostructure on surfaces, over the picture that the datasets left (shaders/meso_surface.comp, meso_shade.comp): for
// each surface a dispatch that finds first hits in its shell and keeps the nearest of all, or, where it is remeshed,
// what RemeshRaster does; then one that casts shadow rays, then one that shades. Rays of light march remeshed surfaces,
// too, where these have what it takes, and start from them where rays that march would meet them. Normals are as the
// other passes pack them; depths are in world units, as those of the compose pass, from which they start.
//
// Where surfaces and datasets shade each other, the hits are found before any ray of light is cast (recordHits) and
// stand in the whole picture's depths and planes of light (passes/scene_light.h); each ray goes through the surfaces
// after the datasets (recordRay), and the shading comes last.
//
// Reads shells, assets and the composed depths; writes hits, picture, counters. Barriers are recorded here; ends with
// barrierComputeToReadback. Without surfaces nothing is made: no pipeline, no buffer.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "render/frame_request.h"
#include "render/meso_surface.h"
#include "render/passes/frame_resources.h"
#include "render/passes/meso_resources.h"
#include "render/passes/remesh_raster.h"

namespace vcp {

/// What is counted in a frame (shaders/meso_bindings.glsl).
struct MesoCounts {
    uint32_t unresolvedRays = 0, farHits = 0, hitPixels = 0, unused = 0;
};

/// What a frame tells the CPU: the counts, and the depth and normal at the pixel that record() was given.
struct MesoReport {
    MesoCounts counts;
    uint32_t cursorDepth = 0, cursorNormal = 0;
};

/// What one view's pictures of the surfaces are drawn into.
struct MesoTarget {
    /// What one surface is drawn with. `sun` and `sky` cast one ray from all that is seen.
    struct Drawing {
        Buffer constants;
        /// The light over the surface's base; empty where it is that of the surroundings.
        struct BaseLight {
            MesoTexels texels;
            Buffer filled;                                ///< what is copied to them
            std::optional<std::array<glm::vec4, 16>> of;  ///< the surroundings that it was filled for
            bool isCopied = false;                        ///< a recorded frame copies what was filled
        } baseLight;
        MesoSet set, lightSet;  ///< lightSet: of rays of light through what is remeshed
        VkPipeline cast = VK_NULL_HANDLE, shadow = VK_NULL_HANDLE, sun = VK_NULL_HANDLE, sky = VK_NULL_HANDLE;
    };
    PictureSize size;       ///< 0: nothing is made
    uint64_t surfaces = 0;  ///< MesoSurfacePass::version() for which the sets were made
    Buffer hits, counters;
    Buffer reported;                       ///< MesoReport
    uint32_t planes = 0;                   ///< of the hits
    bool keepsTransfer = false;            ///< one of them is of transfer
    VkBuffer picture = VK_NULL_HANDLE;     ///< not owned; in the sets
    VkBuffer sceneLight = VK_NULL_HANDLE;  ///< the same; null where surfaces and datasets do not shade each other
    VkBuffer depths = VK_NULL_HANDLE;      ///< the same
    RemeshTarget remeshed;
    /// What a frame wrote into the marks of a map (HeightPool).
    struct Marks {
        Buffer words;
        uint32_t picture = 0;
        uint64_t version = 0;
    };
    std::vector<Marks> marks;       ///< one for each map
    std::vector<Drawing> drawings;  ///< one for each surface
    VkPipeline shade = VK_NULL_HANDLE;

    /// Returns what a frame told. Precondition: the frame is done.
    [[nodiscard]] MesoReport report() const;
};

class MesoSurfacePass {
public:
    MesoSurfacePass(Device& device, MesoResources& resources)
        : device_(device), resources_(resources), raster_(device) {}

    /// Replaces the surfaces: no frame may be in flight. Heights take at most `heightBytes`. On an error there are
    /// none. Errors: Device, Limit.
    Result<void> setSurfaces(std::span<const MesoSurface> surfaces, uint64_t heightBytes);
    /// What the surfaces are drawn over.
    struct Picture {
        const Buffer* colours;     ///< what is seen without mesostructure, when the surfaces are shaded
        const Buffer* depths;      ///< a float a pixel, world units along the unit ray
        const Buffer* sceneLight;  ///< planes of light; null where surfaces and datasets do not shade each other
    };
    /// Makes buffers and pipelines, and the pieces of what is remeshed. Precondition: there are surfaces, and no frame
    /// in flight uses the target. Errors: Device, Limit, Unsupported.
    Result<void> prepare(MesoTarget& target, const Picture& picture, const FrameRequest& request);
    /// Does ahead what takes long in prepare(): chooses the certified cells of what is remeshed. Errors: Cancelled.
    Result<void> chooseCells(const FrameRequest& request, const RemeshShareOut& shareOut) const;
    /// Records what finds the hits. Precondition: prepare() with the same picture.
    void recordHits(VkCommandBuffer commands, MesoTarget& target, const FrameRequest& request, const Picture& picture);
    /// Records a ray of light from all that the picture shows. `ray.isLast`: nothing comes after the surfaces.
    /// Precondition: recordHits() with planes of light.
    void recordRay(VkCommandBuffer commands, const MesoTarget& target, const frame::MesoLightRay& ray);
    /// Records shading, and without planes of light the shadows before it.
    void recordShade(VkCommandBuffer commands, const MesoTarget& target, const FrameRequest& request,
                     const std::optional<PicturePixel>& cursor);

    /// The maps of what is remeshed.
    [[nodiscard]] std::span<const std::unique_ptr<HeightPool>> heights() const { return heights_; }
    /// Takes in which tiles of heights a view's frame read, and returns how many of them were not there. Precondition:
    /// the frame is done.
    uint32_t look(ViewNumber view, const MesoTarget& target);
    /// Bytes of the tiles of heights that are there.
    [[nodiscard]] uint64_t heightBytes() const;

    [[nodiscard]] uint64_t version() const { return version_; }
    /// Bytes of assets, shells and textures.
    [[nodiscard]] uint64_t assetBytes() const;

private:
    struct Placed {
        std::shared_ptr<const meso::MarchArrays> arrays;
        std::shared_ptr<MesoTexels> words, look;                 ///< look: null without textures
        std::shared_ptr<const meso::BaseTransfer> baseTransfer;  ///< null where it changes nothing
        MesoTexels shell;
        RemeshedSurface remeshed;
        HeightPool* heights = nullptr;  ///< of what is remeshed
        MesoTexels frames;              ///< of its base triangles
        size_t number = 0;              ///< among those that are remeshed
        glm::dvec3 origin;
        frame::MesoView view{};  ///< what does not depend on the picture
        uint32_t textures = 0;
        bool isFarDrawn = false, hasTransfer = false;
    };
    /// Whether a picture has a plane of the light that comes through volumes of transfer.
    [[nodiscard]] bool keepsTransfer(const Shading& shading) const;
    /// Returns the first plane of what rays of light start at; 0 where there is none.
    [[nodiscard]] uint32_t startPlanes(const Shading& shading, bool inScene) const;
    /// Returns the heights of a surface, made for the first that has them.
    Result<HeightPool*> heightsFor(const RemeshedSurface& surface, uint64_t mostBytes);
    static void fillBaseLight(const Placed& surface, MesoTarget::Drawing::BaseLight& light, const Shading& shading);
    Result<void> makeTarget(MesoTarget& target, PictureSize size, uint32_t planes, bool keepsTransfer,
                            const Picture& picture);
    Result<void> choosePipelines(const Placed& surface, MesoTarget::Drawing& drawing, const Shading& shading,
                                 bool inScene);
    MesoConstants constantsOf(size_t number, const FrameRequest& request) const;
    /// Records the ray that the next dispatches cast.
    void push(VkCommandBuffer commands, const frame::MesoLightRay& ray) const;
    enum class Rays { OfPicture, OfLight };
    void dispatch(VkCommandBuffer commands, VkPipeline pipeline, const MesoTarget& target, size_t surface,
                  Rays rays = Rays::OfPicture) const;

    Device& device_;
    MesoResources& resources_;
    RemeshRaster raster_;
    std::vector<Placed> surfaces_;
    std::vector<std::unique_ptr<HeightPool>> heights_;
    size_t remeshed_ = 0;  ///< number of those that are
    uint64_t version_ = 0;
};

}  // namespace vcp
