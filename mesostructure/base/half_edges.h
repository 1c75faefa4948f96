// The half-edge structure of a base surface: OpenMesh's, in double precision. For this room alone; others ask
// surface_edges.h.
//
// OpenMesh's own readers and add_face are not used: the readers allocate what a header claims and take broken files for
// whole ones, add_face looks for an edge among all that meet at a corner and prints what it refuses. Here the edges are
// sorted once, what is not manifold is named, and the links are set in linear time.
#pragma once

#include <cstdint>
#include <vector>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <glm/vec3.hpp>

#include "mesostructure/base_surface.h"
#include "octree/io/result.h"

namespace vcp::meso {

using HalfEdges = OpenMesh::TriMesh_ArrayKernelT<OpenMesh::DefaultTraitsDouble>;

struct LinkedSurface {
    HalfEdges mesh;
    std::vector<uint32_t> triangleOf;  ///< number of a face's triangle in the surface
    std::vector<uint32_t> positionOf;  ///< number of a vertex' position in the surface; the first of each in order
};

inline glm::dvec3 placeOf(const HalfEdges::Point& p) { return {p[0], p[1], p[2]}; }
inline HalfEdges::Point pointOf(glm::dvec3 p) { return {p.x, p.y, p.z}; }

/// Links, in an empty `linked`, the triangles that have three different corners; the others, and positions without a
/// triangle, are left out. Where parts of a surface touch at a corner and share no edge there, each has a vertex of its
/// own. Halfedge k of a face in OpenMesh's order runs from corner k of its triangle to the next. Errors: InvalidInput
/// (an edge of three triangles, or of two that run along it in one direction), with the triangle and the place; Limit
/// (2^29 triangles).
Result<void> linkSurface(const BaseSurface& surface, LinkedSurface& linked);

}  // namespace vcp::meso
