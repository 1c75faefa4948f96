// Loop subdivision of base surfaces (Loop 1987, with the border rule of Hoppe et al. 1994), by OpenMesh.
#pragma once

#include "mesostructure/base_surface.h"

namespace vcp::meso {

inline constexpr int kMostSubdivisions = 8;
inline constexpr size_t kMostSubdivided = 5'000'000;  ///< triangles afterwards

/// Cuts each triangle into four, `times` times, and moves the corners towards Loop's limit surface; borders become
/// cubic B-splines of their own, so surfaces with a common border stay together. Texture coordinates are halved along
/// the edges of each triangle, so seams of the map stay seams and charts keep their outlines. Triangle i becomes
/// triangles 4 i to 4 i + 3 (those at its corners, the middle one), and the corners that were there come first, in
/// their order; triangles with equal corners are left out first, and so are positions without a triangle. Corners must
/// be joined (joinPositions). Errors: those of edgesOf; Usage (times not from 0 to kMostSubdivisions); Limit
/// (kMostSubdivided); InvalidInput (no triangle with three different corners; two on the
/// same three).
Result<BaseSurface> subdivided(const BaseSurface& surface, int times);

}  // namespace vcp::meso
