// A file of the method `paper` in subvolumes, built out of core (Demir and Westermann 2015, 4.3).
//
// The grid is cut into cubes of PaperOptions::subvolumeCells cells, one root each; so is a grid of larger cells. Each
// triangle goes to the cubes of both that it is near, on temporary files. Each cube's octree is built from its
// triangles alone (CornerRegion); the octrees of the larger cells are put together to one page, the root's, and the
// others are packed with the longest vector of all and become the pages of the subvolumes.
#pragma once

#include "builder/build.h"
#include "builder/paper/paper_octree.h"

namespace vcp {

/// The sizes that subvolumes may have, cells an edge; a power of two.
inline constexpr int kLeastSubvolumeCells = 1 << CornerRegion::kLeastRootLevel, kMostSubvolumeCells = 256;
/// The grid of larger cells has at most so many across, and they are at least four cells wide.
inline constexpr int kMostCoarseCells = 512, kLeastCoarseShift = 2;

/// Builds meshes into such a file within `options.memoryBytes`. It uses the same options as buildPaperFile, and memory
/// and temp; an interrupted build leaves nothing to resume. The bytes are the same for any number of threads and any
/// order of the triangles. Errors: those of readInputs, chooseFrame and VcpWriter; Limit (too many cells; too little
/// memory; a page of over 256 MiB), Io, Cancelled.
Result<BuildReport> buildPaperSubvolumes(const BuildOptions& options, const PaperOptions& paper);

}  // namespace vcp
