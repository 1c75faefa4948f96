// The surface inside one leaf as flat polygons, with a bound on how far the two are apart.
//
//   slab leaf   The piece of the slab's middle plane in the leaf, where it lies in octants that are named, else a piece
//               in each of these; and where an octant's surface may be far from that, a piece of the plane nearest to
//               it which meets both octant and slab. Whatever lies in slab and octants is within the leaf's certified
//               error of the mesh, and so are the pieces; the other way, the mesh in an octant lies in the convex body
//               that slab and octant have in common, whose corners are the farthest from a convex piece.
//   soft leaf   f = 0 of docs/surface.md, by marching tetrahedra on a grid: f and its linear interpolant differ by at
//               most 3/8 k h^2, for a grid of edge h and second derivatives of f up to k; since its slope is at least
//               1/2, the surfaces differ by twice that. Walls that bridge a gap to a neighbour are reached over.
//   hard leaf   its triangles, cut off at its walls: exact.
//
// Lengths are in cells of the page's level, from the page's lowest corner. Colours are RGBA8 as they are stored.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "octree/page/page.h"
#include "octree/page/strips.h"

namespace vcp {

struct ColouredPoint {
    glm::dvec3 at{0};
    glm::dvec4 colour{255};  ///< 0 to 255 a channel
};

/// Triangles over points of their own.
struct PolygonMesh {
    std::vector<ColouredPoint> points;
    std::vector<Index3> triangles;

    /// Appends a convex polygon as a fan; fewer than three points are nothing.
    void addPolygon(const std::vector<ColouredPoint>& polygon);
};

struct LeafBox {
    glm::dvec3 low{0};
    double edge = 0;
};

/// Returns what a box has of a convex polygon.
std::vector<ColouredPoint> clippedTo(const LeafBox& box, std::vector<ColouredPoint> polygon);

/// How far polygons are from the mesh, in cells: within the leaf's own error and `added`, and the mesh from them within
/// `ofMesh` or as much, whichever is more.
struct PolygonError {
    double added = 0;
    double ofMesh = 0;
};

/// Appends the polygons of a soft or slab leaf of a checked page.
PolygonError addSoftLeaf(const PageView& page, uint32_t node, const LeafBox& box, PolygonMesh& out);
PolygonError addSlabLeaf(const PageView& page, uint32_t node, const LeafBox& box, PolygonMesh& out);

}  // namespace vcp
