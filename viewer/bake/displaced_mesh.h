// A displaced base as a mesh: what a scene draws by "remesh", in as fine triangles as its map has texels, in double
// precision. It is made of what was written, so that it can be measured against the scan.
#pragma once

#include "builder/measure/indexed_mesh.h"
#include "mesostructure/base_surface.h"
#include "mesostructure/shape.h"

namespace vcp {

/// Cuts each triangle into parts no longer than a texel and moves their corners by the heights, from `offset` (world
/// units) on, along the shell's directions. The surface's coordinates are in tile units, with one tile. Errors: Limit
/// (more than 2^26 triangles).
Result<IndexedMesh> displacedMesh(const meso::BaseSurface& surface, const meso::HeightMap& heights, double offset);

}  // namespace vcp
