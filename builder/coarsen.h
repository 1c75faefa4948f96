// The mesh of the next coarser level, by vertex clustering.
#pragma once

#include "builder/lattice_mesh.h"

namespace vcp {

/// Clusters' edge, in cells of the coarser level.
inline constexpr double kClusterCells = 0.25;

/// Moves all vertices within a cube of kClusterCells to their mean, on the coarser level's lattice (twice the
/// step), and drops what collapses. Every point of a triangle moves at most as far as its corners do, so the
/// stray of the corners bounds the distance between the meshes, both ways (collapsed triangles count as the
/// segments they became). Strays are in cells of the coarser level. Deterministic.
LatticeMesh coarsen(const LatticeMesh& fine);

}  // namespace vcp
