// What base surfaces do to light from everywhere before it reaches the mesostructure on them: they shade themselves and
// each other, and throw light on each other (the transfer of the base in Wang et al. 2004, 4.3, after Sloan et al.
// 2003, "Bi-scale radiance transfer").
//
// At a vertex the light over the base is linear in the light of the surroundings: l = M L, 16 coefficients of spherical
// harmonics each. The paper keeps l in the vertex' tangent frame; here it is in the world's axes, as L is, so that M is
// the identity where nothing is in the way, and neighbours can be blended whatever their frames are. M is found by rays
// over the vertex' hemisphere: what they bring is the surroundings' light, or, where they meet a base, what that gives
// back of its own. l are those 16 coefficients that come nearest to what the rays bring, over the hemisphere, weighted
// by the cosine; the rays with nothing in their way bring what L has already. So the light on a flat and open
// mesostructure, the mean over the rays, is kept, and nothing of the half of the sphere below has to be made up.
//
// A base counts as what it carries: it stands as high as the mesostructure on the mean, and gives back the part of the
// light that the mesostructure gives back of what falls on its slab (tileReflection), matt. The back of a triangle is
// dark. The light of a ray that meets a triangle is blended from those of its corners.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "mesostructure/base_surface.h"
#include "mesostructure/tile_paths.h"

namespace vcp::meso {

/// The transfer of the vertices of one base surface.
struct BaseTransfer {
    static constexpr size_t kValues = 256;
    static constexpr size_t kTexels = 12;  ///< of a vertex' light

    std::vector<uint32_t> numbers;  ///< one a vertex: 1 and more, without gaps; 0: nothing is in the way of its light
    std::vector<float> changes;     ///< kValues a number: M less the identity, column by column

    [[nodiscard]] size_t vertices() const { return numbers.size(); }
    /// Returns the light over each vertex as shaders read it, four values of 16 bits a texel (glm::packHalf4x16): 16
    /// coefficients of red, then of green and of blue. `light`: of the surroundings; w is not read.
    [[nodiscard]] std::vector<uint64_t> lightTexels(std::span<const glm::vec4, 16> light) const;
};

/// What a tile does to the light that falls on its slab.
struct TileReflection {
    double height = 0;  ///< mean height of what is seen from above, tile units
    double albedo = 0;  ///< part of the light that leaves the slab again, where it comes evenly from everywhere
};
/// Follows `paths` paths from the slab's top. The same shape gives the same bits.
TileReflection tileReflection(const TilePaths& paths, uint32_t count = 4096);

/// Base surfaces that shade each other, their vertices joined in a list.
struct BaseScene {
    std::vector<glm::dvec3> positions;  ///< world
    std::vector<glm::dvec3> normals;    ///< unit; 0: the vertex has none, and is open
    std::vector<std::array<uint32_t, 3>> triangles;
    std::vector<float> albedos;  ///< one a triangle

    /// Adds a surface and returns the number of its first vertex. `height`: of the mesostructure on the mean, over the
    /// base, world units.
    uint32_t add(const BaseSurface& surface, double height, double albedo);
};

/// Where a ray meets a base.
struct BaseHit {
    uint32_t triangle = 0;
    double t = 0;
};

struct BaseTransferOptions {
    uint32_t rays = 512;   ///< a vertex, 16 to 4096
    uint32_t bounces = 8;  ///< of light from base to base, at most
    uint64_t memoryBytes = uint64_t{1} << 30;
    /// Returns the first hit of a ray; called from several threads at once.
    std::function<std::optional<BaseHit>(glm::dvec3 origin, glm::dvec3 direction)> cast = {};
    /// As TransferOptions::shareOut, once for the rays, for each bounce and for what comes of them: `part` is how much
    /// of the whole is done before it and after it.
    struct Part {
        double before = 0, after = 1;
    };
    std::function<bool(size_t count, const std::function<void(size_t first, size_t last)>& fill, Part part)> shareOut =
        {};
};

/// Traces the transfer of `ranges` of vertices (first, count). The same scene and options give the same bits, in any
/// number of threads. Errors: Usage (options out of range), Limit (the memory cap), Cancelled.
Result<std::vector<BaseTransfer>> traceBaseTransfer(const BaseScene& scene,
                                                    std::span<const std::pair<uint32_t, uint32_t>> ranges,
                                                    const BaseTransferOptions& options);

}  // namespace vcp::meso
