// The step from the snapped triangles to the finest level: a vertex stays where it is, and gets its normal and colour.
//
// A bin has all triangles at its own vertices, so it knows what becomes of these. The lowest bin that has one of a
// triangle's corners hands the triangle on, with what it knows (kUnknownNormal elsewhere); each other bin that has a
// corner sends that vertex to the same bins, which follow from the triangle. There both meet (joinVertices). So bins
// may be worked on in any order, or at the same time on different machines.
#pragma once

#include <vector>

#include "builder/lattice/lattice_mesh.h"
#include "builder/lattice/page_partition.h"
#include "builder/lattice/soup.h"
#include "builder/level/coarsen.h"
#include "builder/level/level_step.h"
#include "builder/spill/record_bins.h"
#include "octree/io/result.h"

namespace vcp {

class VertexStep {
public:
    /// `grid`, `partition`: those of the deepest level. `vertices` takes what bins know of each other's triangles.
    VertexStep(const PageGrid& grid, const PagePartition& partition, RecordBins<VertexImage>& vertices, LevelSink& sink)
        : grid_(grid), partition_(partition), vertices_(vertices), sink_(sink) {}

    /// Hands on the triangles and vertices of a bin. `mesh`: all triangles at its vertices, with their normals. The
    /// calling arena's threads do the work. Errors: Io.
    Result<void> run(size_t bin, const LatticeMesh& mesh);

private:
    const PageGrid& grid_;
    const PagePartition& partition_;
    RecordBins<VertexImage>& vertices_;
    LevelSink& sink_;
};

/// Gives the corners of triangles that lack them their normals and colours, which are among `vertices`. Returns whether
/// all were there. The calling arena's threads do the work.
bool joinVertices(std::vector<LatticeTriangle>& triangles, std::vector<VertexImage> vertices);

}  // namespace vcp
