// Mesostructure on surfaces, over the picture that the datasets left (shaders/meso_surface.comp, meso_shade.comp): for
// each surface a dispatch that finds first hits in its shell and keeps the nearest of all, or, where it is remeshed,
// what RemeshRaster does; then one that casts shadow rays, then one that shades. Remeshed surfaces get the shadows of
// the others and cast none. Normals are as the other passes pack them; depths are in world units, as those of the
// compose pass, from which they start.
//
// Reads shells, assets and the composed depths; writes hits, picture, counters. Barriers are recorded here; ends with
// barrierComputeToReadback. Without surfaces nothing is made: no pipeline, no buffer.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "mesostructure/appearance.h"
#include "mesostructure/shell.h"
#include "render/camera.h"
#include "render/frame_request.h"
#include "render/meso_texture.h"
#include "render/passes/frame_resources.h"
#include "render/passes/meso_resources.h"
#include "render/passes/remesh_raster.h"

namespace vcp {

/// One asset on one base surface: marched, with arrays and a shell, or remeshed.
struct MesoSurface {
    std::shared_ptr<const meso::MarchArrays> arrays;  ///< surfaces may share them
    meso::Shell shell;
    RemeshedSurface remeshed;  ///< its surface is null where this one is marched; of the rest, colour and colours count
    glm::vec3 colour{0.8f};    ///< encoded, as the screen has it
    bool withBase = true;      ///< the base is drawn where rays come through to it
    double lift = 0;           ///< world units by which shadow rays start above a hit
    /// A texture over the tile, at the hit's place in it, may be shared; its colours are linear and replace `colour`.
    std::shared_ptr<const MesoTexture> colours;
    /// A texture of unit vectors that bend the mesostructure's shading normals: x and y are along the tile, z points
    /// out of the mesostructure.
    std::shared_ptr<const MesoTexture> normals;
    std::shared_ptr<const meso::Appearance> far;  ///< what it looks like from far; null: it is marched from everywhere
};

/// Returns a good lift: some texels or a part of a cell. `tileEdge` in world units.
double shadowLift(const meso::MarchArrays& arrays, double tileEdge);

enum class MesoShading : uint32_t {
    Lit = frame::kMesoShowLit,
    Heat = frame::kMesoShowHeat,  ///< iterations of each pixel's ray, blue to red: 0 to 100
    Normals = frame::kMesoShowNormals,
    Unlit = frame::kMesoShowUnlit,
};

struct MesoLook {
    Camera camera;  ///< camera of the whole picture, where this one is a tile
    PictureTile tile;
    glm::dvec2 upperLeft{0};           ///< as upperLeft() in frame_setup.h
    glm::dvec3 light{0.5, 0.4, 0.75};  ///< towards the light, unit
    glm::dvec3 up{0, 0, 1};            ///< direction of the sky, unit
    bool shadows = false;
    std::vector<SectionPlane> sections;  ///< at most kMostSections
    MesoShading shading = MesoShading::Lit;
    double errorPixels =
        0.5;  ///< surfaces that stray less from their mean height are not marched (MesoSurface::far); 0: all are
};

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
    PictureSize size;       ///< 0: nothing is made
    uint64_t surfaces = 0;  ///< MesoSurfacePass::version() for which the sets were made
    Buffer hits, counters;
    Buffer reported;                    ///< MesoReport
    VkBuffer picture = VK_NULL_HANDLE;  ///< not owned; in the sets
    RemeshTarget remeshed;
    std::vector<MesoSet> sets;  ///< one for each surface

    /// Returns what a frame told. Precondition: the frame is done.
    [[nodiscard]] MesoReport report() const;
};

class MesoSurfacePass {
public:
    MesoSurfacePass(Device& device, MesoResources& resources)
        : device_(device), resources_(resources), raster_(device) {}

    /// Replaces the surfaces; waits for nothing: no frame may be in flight. On an error there are none. Errors: Device,
    /// Limit.
    Result<void> setSurfaces(std::span<const MesoSurface> surfaces);
    /// Makes buffers and pipelines, and remeshes. Precondition: there are surfaces, and no frame in flight uses the
    /// target. Errors: Device, Limit, Unsupported.
    Result<void> prepare(MesoTarget& target, PictureSize size, const Buffer& picture, const MesoLook& look);
    /// Records the surfaces' passes. Precondition: prepare(); the picture shows what is seen without mesostructure.
    /// `depths`: a float a pixel, world units along the unit ray, of what the picture shows.
    void record(VkCommandBuffer commands, const MesoTarget& target, const MesoLook& look, const Buffer& depths,
                const std::optional<PicturePixel>& cursor);

    [[nodiscard]] uint64_t version() const { return version_; }
    /// Bytes of assets, shells and textures.
    [[nodiscard]] uint64_t assetBytes() const;

private:
    struct Placed {
        std::shared_ptr<const meso::MarchArrays> arrays;
        std::shared_ptr<MesoTexels> words, look;  ///< look: null without textures
        MesoTexels shell;
        RemeshedSurface remeshed;
        size_t number = 0;  ///< among those that are remeshed
        Buffer constants;
        glm::dvec3 origin;
        frame::MesoView view{};  ///< what does not depend on the camera
        bool isFarDrawn = false;
        VkPipeline cast = VK_NULL_HANDLE, shadow = VK_NULL_HANDLE;
    };
    Result<void> makeTarget(MesoTarget& target, PictureSize size, const Buffer& picture);
    Result<void> choosePipelines(Placed& surface, bool shadows);
    MesoConstants constantsOf(const Placed& surface, PictureSize size, const MesoLook& look) const;
    void dispatch(VkCommandBuffer commands, VkPipeline pipeline, const MesoTarget& target, size_t surface) const;

    Device& device_;
    MesoResources& resources_;
    RemeshRaster raster_;
    std::vector<Placed> surfaces_;
    size_t remeshed_ = 0;  ///< number of those that are
    uint64_t version_ = 0;
    VkPipeline shade_ = VK_NULL_HANDLE;
};

}  // namespace vcp
