// The mesh of the next coarser level, by vertex clustering.
#pragma once

#include "builder/lattice_mesh.h"

namespace vcp {

/// Clusters' edge, in cells of the coarser level.
inline constexpr double kClusterCells = 0.25;

/// Where the vertices of a level go on the next coarser one.
struct Clusters {
    std::vector<uint32_t> of;            ///< cluster of each vertex of the finer mesh
    std::vector<glm::i32vec3> position;  ///< on the coarser level's lattice, each within its cube
    std::vector<uint32_t> colour;        ///< empty where the mesh has none
    std::vector<uint32_t> normal;
};

/// Moves all vertices within a cube of kClusterCells to their mean, on the coarser level's lattice (twice the
/// step). A cluster depends on nothing but the vertices in its cube, in any order.
Clusters clusterVertices(const LatticeMesh& fine);

}  // namespace vcp
