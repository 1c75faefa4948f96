// The leaves of pages of slabs: planes with a thickness, one for each cell of the level below that has surface, so that
// a page has leaves of half of its own level's cells.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "builder/page/page_builder.h"
#include "builder/slab/surface_below.h"

namespace vcp {

/// A cell is parted into eight where its surface folds: where the mean of its normals' squared sines to their axis is
/// larger than this.
inline constexpr double kMostNormalSpread = 0.03;
/// Also where a slab's error would be larger than this, in cells.
inline constexpr double kMostSlabError = 0.45;

/// Returns the slabs that stand for a page's surface in the page above: one for each cell, or for each half where a
/// whole one would not do. Precondition: each cell has halves, and each half quarters, as foldSurface makes them.
/// `withColour`: finds the colour errors, too.
std::vector<CellSlab> slabsOf(const PageSurface& surface, bool withColour = false);

/// Builds a page's octree from the slabs that the pages below hand up, as PageFold puts them together.
PageTree slabTree(std::span<const CellSlab> slabs, uint32_t log2Cells);

}  // namespace vcp
