// How a mesostructure looks where a pixel holds a whole tile: no place, only light.
//
// Seen from a direction, the visible points of a tile have many normals, and some lie in the shadow of others. For
// the light of one far lamp in direction l their mean is E(l) = mean over visible points of max(0, n . l), or of that
// times whether l is seen. E is smooth, whatever the surface: clamped cosines are nearly of three bands (Ramamoorthi
// and Hanrahan 2001), so nine coefficients of spherical harmonics hold it (with visibility as in precomputed radiance
// transfer, Sloan et al. 2002). They are stored for a grid of view directions over the upper hemisphere, with the mean
// normal.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/vec4.hpp>

#include "mesostructure/march_math.h"
#include "mesostructure/shape.h"

namespace vcp::meso {

struct Appearance {
    /// Views along an edge of the grid: view (i, j) is along (a, b, 1 - |a| - |b|) where a = (u + v) / 2, b = (u - v) /
    /// 2 and u, v run from -1 to 1 (the upper half of an octahedron, turned to fill the square), but never lower than 3
    /// degrees.
    static constexpr uint32_t kViews = f32::kAppearanceViews;
    /// A view has two times three texels: nine coefficients and the mean normal, without and with shadows.
    static constexpr uint32_t kTexels = f32::kAppearanceTexels;

    double height = 0;              ///< mean height of what is seen from above, tile units
    bool isOpaque = false;          ///< no ray came through to the slab's bottom: there need be no base
    std::vector<glm::vec4> texels;  ///< kTexels a view; x fastest
};

/// Casts `rays` rays from each view, and two shadow rays from each hit. `heightScale`: the slab's height over the
/// tile's edge in the world, divided by that in tile space; normals and lights are in the world, turned so that x is
/// the tile's and z leaves the surface. The slab's bottom counts as a surface. The same shape gives the same bits.
Appearance appearanceOf(const Shape& shape, double heightScale, uint32_t rays = 128);

/// Returns E(l) of one view and unit `light`, at least 0: what the shader computes, for tests. `withShadows`: with the
/// shadows of the mesostructure on itself.
double lightOf(const Appearance& appearance, glm::uvec2 view, glm::dvec3 light, bool withShadows);

}  // namespace vcp::meso
