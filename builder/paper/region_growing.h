// Closest triangles of grid points as Demir and Westermann 2015, 3.1 find them: every triangle is given to the grid
// points of its bounding box, then points take over what their 26 neighbours have, round after round.
//
// It is not exact: a point whose closest triangle lies outside of the neighbours' choices keeps one that is farther, so
// its vector is too long. Where the paper is silent: boxes are rounded out to grid points (else triangles smaller than
// a cell would have none), neighbours are those that share a cell, and a round sees what the round before left, so
// that the result depends on no order. The distance to a triangle is exact (their formula fails on slivers).
#pragma once

#include <cstdint>
#include <vector>

#include "builder/measure/indexed_mesh.h"
#include "builder/paper/corner_octree.h"
#include "builder/paper/grid_points.h"

namespace vcp {

/// Fills the values of `points`; a point that no triangle reaches in `rounds` rounds is CornerSample::unreached().
/// Distances have no sign.
void growClosestPoints(const IndexedMesh& mesh, const RootGrid& frame, int rounds, unsigned threads,
                       GridPoints<CornerSample>& points);

}  // namespace vcp
