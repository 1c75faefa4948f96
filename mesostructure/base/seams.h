// Where the texture map of a linked surface jumps. For this room alone.
#pragma once

#include "mesostructure/base/half_edges.h"

namespace vcp::meso {

/// Returns which corner of a face's triangle is at a vertex, from 0 to 2.
inline int cornerAt(const BaseSurface& surface, const LinkedSurface& linked, OpenMesh::FaceHandle face,
                    OpenMesh::VertexHandle vertex) {
    const auto& t = surface.triangles[linked.triangleOf[size_t(face.idx())]];
    const uint32_t position = linked.positionOf[size_t(vertex.idx())];
    return t[0] == position ? 0 : t[1] == position ? 1 : 2;
}

/// Whether the coordinates of the two triangles at an edge differ at one of its ends. A border is no seam.
inline bool isSeam(const BaseSurface& surface, const LinkedSurface& linked, OpenMesh::EdgeHandle edge) {
    const HalfEdges& mesh = linked.mesh;
    if (surface.uvs.empty() || mesh.is_boundary(edge)) return false;
    const auto side = mesh.halfedge_handle(edge, 0), other = mesh.halfedge_handle(edge, 1);
    for (const auto vertex : {mesh.to_vertex_handle(side), mesh.to_vertex_handle(other)}) {
        const auto map = [&](OpenMesh::HalfedgeHandle of) {
            const OpenMesh::FaceHandle face = mesh.face_handle(of);
            return surface.uvs[linked.triangleOf[size_t(face.idx())]][size_t(cornerAt(surface, linked, face, vertex))];
        };
        if (map(side) != map(other)) return true;
    }
    return false;
}

}  // namespace vcp::meso
