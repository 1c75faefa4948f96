// How far the surface that is drawn of a slab leaf and the mesh in it can be apart.
#pragma once

#include <cstdint>
#include <span>

#include <glm/vec3.hpp>

#include "builder/slab/cell_surface.h"

namespace vcp {

/// Bounds the error of any slab leaf, in its edges: what is drawn and a part of the mesh share an octant, whose corners
/// are so far apart. With room for rounding.
inline constexpr double kAnySlabError = 0.8664;

/// A quarter of a leaf that has surface; `code`: its Morton code among the 64.
struct SurfaceQuarter {
    uint32_t code;
    EighthBox box;
};

/// Bounds the error of a slab leaf, both ways, in its edges. `direction`: as it is decoded; `slab`: the slab as it is
/// decoded; `quarters`: all that have surface. Each point that is drawn lies in a quarter that the slab meets, and the
/// mesh in that quarter or in one beside it is near; each point of the mesh is in the slab, and a ray across the slab
/// through that point is stopped within the thickness.
double slabError(glm::dvec3 direction, Extent slab, std::span<const SurfaceQuarter> quarters);

}  // namespace vcp
