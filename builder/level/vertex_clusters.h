// Vertex clustering (Rossignac and Borrel 1993) in cubes that are as large as the shape allows: which vertices
// of a level become one vertex of the next coarser level, and where it lies.
//
// A cluster's vertex minimises the quadric error (Garland and Heckbert 1997) of the planes of the triangles at
// its vertices and, where the mesh has a border, of planes upright on the border. A cube starts at one coarse
// cell; it is cut into eight where the vertex would lie too far from those planes.
//
// A cluster depends only on the triangles at the vertices in its cube, and not on the order of anything.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

#include "builder/lattice/lattice_mesh.h"

namespace vcp {

/// Largest and smallest cube, in cells of the coarser level. They nest: edges are powers of two.
inline constexpr double kLargestClusterCells = 1;
inline constexpr double kSmallestClusterCells = 0.25;

/// A cube is cut while its vertex would be farther than this from the surface, in cells of the coarser level.
inline constexpr double kClusterErrorCells = 0.15;

/// Triangles whose bounding box is wider than this, in cells of their level, count as long: they are compared by how
/// far their corners moved, since the surroundings of their other end are not at hand.
inline constexpr int kShortTriangleCells = 2;

struct VertexClusters {
    static constexpr uint32_t kNone = 0xffffffff;
    std::vector<uint32_t> ofVertex;       ///< cluster of each fine vertex; kNone where no triangle uses it
    std::vector<glm::i32vec3> positions;  ///< distinct, on the coarser lattice (twice the step)
    std::vector<uint32_t> colours;        ///< mean of the vertices' colours; empty where the mesh has none
    std::vector<uint32_t> normals;        ///< mean of the vertices' normals; empty where the mesh has none
};

/// Clusters vertices; clusters are numbered cube by cube, in Morton order.
VertexClusters clusterVertices(const LatticeMesh& fine);

/// Whether a fine triangle is long.
bool isLong(glm::i32vec3 a, glm::i32vec3 b, glm::i32vec3 c);

}  // namespace vcp
