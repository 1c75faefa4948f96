// Builds the octree of a page whose leaves are slabs: planes with a thickness, one for each cell that has surface.
#pragma once

#include <cstdint>

#include "builder/page/page_builder.h"
#include "builder/slab/page_surface.h"

namespace vcp {

/// A cell is parted into eight where its surface folds: where the mean of its normals' squared sines to their axis is
/// larger than this.
inline constexpr double kMostNormalSpread = 0.03;
/// Also where a slab's error would be larger than this, in cells.
inline constexpr double kMostSlabError = 0.45;

/// Builds a page's octree from its surface. Leaves are cells, or halves of them where a whole one would not do.
/// Precondition: each cell has halves, and each half quarters, as PageFold makes them. `withColour`: finds the colour
/// error, too.
PageTree buildSlabTree(const PageSurface& surface, uint32_t log2Cells, bool withColour = false);

}  // namespace vcp
