// The mesh of the next coarser level, with a proof of how far it strayed.
//
//   1  clusterVertices   which vertices become one, and where (vertex_clusters.h)
//   2  coarseTriangles   the triangles' images; what would vanish as a whole is kept as thin triangles
//   3  boundStray        the distance between the two meshes, both ways, triangle by triangle (stray_bound.h)
//
// Nothing depends on the numbering of vertices or triangles but the order in which they come out; and that is by
// cluster, so it is the same for a part of the mesh as for the whole.
#pragma once

#include <cstdint>
#include <vector>

#include "builder/lattice/lattice_mesh.h"
#include "builder/level/vertex_clusters.h"

namespace vcp {

/// The coarse triangles of a mesh's short triangles (isLong). Long ones are stepped one by one, by longImage:
/// what surrounds their other end may not be at hand.
struct CoarseTriangles {
    /// Vertex i is that of cluster i; behind them come those of kept thin parts. No strays yet.
    LatticeMesh mesh;
    /// Of each fine triangle the coarse one that its corners' clusters span; VertexClusters::kNone: it is long, or
    /// they are on a line.
    std::vector<uint32_t> imageOf;
};

/// The image of a triangle is spanned by its corners' clusters. As the map is the same for all, what was
/// connected stays connected and no hole opens. Where triangles collapse to a line that no image has for an edge
/// (a wire, a ribbon) a thin triangle is kept along it, with the vertex farthest from the line for its third
/// corner; where a whole island collapses to a point, one triangle of its vertices is kept.
CoarseTriangles coarseTriangles(const LatticeMesh& fine, const VertexClusters& clusters);

/// Where a vertex goes.
struct VertexImage {
    glm::i32vec3 position;  ///< on the coarser lattice
    uint32_t colour, normal;
};

/// What becomes of a long triangle: the images of its corners, or where these are on a line, a thin triangle along
/// it. A point moves no farther than the corners: so far is its stray.
LatticeTriangle longImage(const LatticeTriangle& fine, const VertexImage (&image)[3]);

/// The step of a whole mesh at once. Strays are in cells of the coarser level and count from the input mesh.
LatticeMesh coarsen(const LatticeMesh& fine);

}  // namespace vcp
