// How far a coarser mesh is from the finer one that it was made of, proved both ways.
//
//   fine to coarse   every point of a fine triangle, against the coarse triangles at its corners' clusters
//   coarse to fine   every point of a coarse triangle, against the fine triangles that touch its corners' clusters
//
// both by triangle_cover.h. Long triangles (isLong) are not among them: see longImage.
#pragma once

#include <vector>

#include "builder/level/coarsen.h"

namespace vcp {

/// The stray of each coarse triangle: what its points and the fine triangles' points that were measured against
/// it are apart, with the fine triangles' own stray added, in cells of the coarser level. It depends on the
/// fine triangles that share a cluster with one that shares a cluster with it.
std::vector<float> boundStray(const LatticeMesh& fine, const VertexClusters& clusters, const CoarseTriangles& coarse);

}  // namespace vcp
