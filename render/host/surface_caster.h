// Surfaces with mesostructure in a picture that the processor draws: what the camera's rays and rays of light hit in a
// surface's shell, with the mathematics of the shaders (render/shared/shell_cast.h). Rays are cast one by one.
#pragma once

#include <memory>
#include <span>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "mesostructure/march_arrays.h"
#include "mesostructure/shell.h"
#include "render/shared/meso_view.h"

namespace vcp {

/// A surface as a picture shows it.
struct HostSurface {
    const meso::MarchArrays& arrays;
    const meso::Shell& shell;
    frame::MesoView view;
    std::span<const uint64_t> looks;      ///< words of what is seen from far, and of textures
    uint32_t textures = 0;                ///< frame::kMesoColours, kMesoNormals
    bool isFarDrawn = false;              ///< it is seen from far where it is small
    std::span<const uint64_t> baseLight;  ///< over the base's positions (BaseTransfer::lightTexels); may be empty
};

/// What the ray of a pixel hit. Lengths are world units, directions have the world's axes.
struct MesoHit {
    float depth = 0;  ///< along the unit ray
    glm::vec3 normal{0};
    glm::vec3 colour{0};   ///< encoded for the screen
    float width = 0;       ///< of the pixel there
    int piece = 0;         ///< of the shell: the first of its texels
    bool isFar = false;    ///< not marched: it stands for many points
    float sky = 1;         ///< of a far hit: the part of the sky that its points face
    uint32_t arrives = 0;  ///< light from everywhere by the surface's transfer (f32::packedLight); 0: none is known
    glm::vec4 light{1};    ///< of a far hit: what each light gives, at strength 1
};

/// What was found out about rays, shadow rays too.
struct SurfaceWork {
    uint64_t unresolvedRays = 0, farHits = 0;
};

/// Casts rays through one surface. A copy belongs to one thread.
class SurfaceCaster {
public:
    explicit SurfaceCaster(const HostSurface& surface);
    SurfaceCaster(const SurfaceCaster& other);
    SurfaceCaster& operator=(const SurfaceCaster&) = delete;
    ~SurfaceCaster();

    /// Casts a pixel's ray no farther than hit.depth. Returns whether it hit; only then it writes `hit`. Adds to
    /// `iterations`.
    bool castPixel(glm::ivec2 pixel, MesoHit& hit, uint32_t& iterations, SurfaceWork& work);

    /// Where a ray of light begins: above what a pixel shows.
    struct Start {
        glm::ivec2 pixel;
        float depth;  ///< of the hit
        glm::vec3 normal;
        float lift;   ///< by which it begins above
        float width;  ///< of the pixel there
    };
    /// Returns how far a ray comes; `reach` where nothing is in its way. `any`: any distance below the reach will do.
    float castLight(const Start& start, glm::vec3 direction, float reach, bool any, SurfaceWork& work);

    [[nodiscard]] const HostSurface& surface() const { return surface_; }

private:
    struct Cast;
    const HostSurface& surface_;
    std::unique_ptr<Cast> cast_;
};

}  // namespace vcp
