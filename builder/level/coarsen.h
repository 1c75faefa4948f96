// The mesh of the next coarser level, with a proof of how far it strayed.
//
//   1  clusterVertices   which vertices become one, and where (vertex_clusters.h)
//   2  coarseTriangles   the triangles' images; what would vanish as a whole is kept as thin triangles
//   3  boundStray        the distance between the two meshes, both ways, triangle by triangle (stray_bound.h)
//
// Apart from the order in which they come out, nothing depends on the numbering of vertices or triangles; and that
// order is by cluster, so it is the same for a part of the mesh as for the whole.
#pragma once

#include <cstdint>
#include <vector>

#include "builder/lattice/lattice_mesh.h"
#include "builder/level/vertex_clusters.h"

namespace vcp {

/// The coarse triangles of a mesh's short triangles (isLong). Long ones are stepped one by one, by longImage:
/// what surrounds their other end may not be at hand.
struct CoarseTriangles {
    /// Vertex i is that of cluster i; behind them come those of kept thin parts. Strays are not set yet.
    LatticeMesh mesh;
    /// For each fine triangle, the coarse one that its corners' clusters span; VertexClusters::kNone where it is long,
    /// or the clusters are on a line.
    std::vector<uint32_t> imageOf;
};

/// The image of a triangle is spanned by its corners' clusters. As the map is the same for all, what was
/// connected stays connected and no hole opens. Where triangles collapse to a line that no image has for an edge
/// (a wire, a ribbon) a thin triangle is kept along it, with the vertex farthest from the line for its third
/// corner; where a whole island collapses to a point, one triangle of its vertices is kept.
CoarseTriangles coarseTriangles(const LatticeMesh& fine, const VertexClusters& clusters);

/// Where a vertex of the finer level goes.
struct VertexImage {
    glm::i32vec3 position;  ///< on the coarser lattice
    uint32_t colour, normal;
};

/// Returns what becomes of a long triangle: the images of its corners, or where these are on a line, a thin triangle
/// along it. No point moves farther than the corners do, so that distance is its stray.
LatticeTriangle longImage(const LatticeTriangle& fine, const VertexImage (&image)[3]);

/// Coarsens a whole mesh at once. Strays are in cells of the coarser level and count from the input mesh.
LatticeMesh coarsen(const LatticeMesh& fine);

}  // namespace vcp
