#include "mesostructure/base/surface_edges.h"

#include <fmt/format.h>

#include "mesostructure/base/half_edges.h"
#include "mesostructure/base/seams.h"

namespace vcp::meso {

namespace {

uint64_t countParts(const HalfEdges& mesh) {
    uint64_t parts = 0;
    std::vector<bool> isSeen(mesh.n_faces());
    std::vector<OpenMesh::FaceHandle> open;
    for (const auto start : mesh.faces()) {
        if (isSeen[size_t(start.idx())]) continue;
        ++parts;
        isSeen[size_t(start.idx())] = true;
        open.push_back(start);
        while (!open.empty()) {
            const OpenMesh::FaceHandle face = open.back();
            open.pop_back();
            for (auto beside = mesh.cff_iter(face); beside.is_valid(); ++beside) {
                if (isSeen[size_t(beside->idx())]) continue;
                isSeen[size_t(beside->idx())] = true;
                open.push_back(*beside);
            }
        }
    }
    return parts;
}

}  // namespace

Result<SurfaceEdges> edgesOf(const BaseSurface& surface) {
    LinkedSurface linked;
    VCP_TRY(linkSurface(surface, linked));
    const HalfEdges& mesh = linked.mesh;
    SurfaceEdges edges;
    edges.triangles = mesh.n_faces(), edges.all = mesh.n_edges();
    for (const auto edge : mesh.edges()) {
        edges.seams += isSeam(surface, linked, edge);
        if (!mesh.is_boundary(edge) || edges.border++ > 0) continue;
        OpenMesh::HalfedgeHandle side = mesh.halfedge_handle(edge, 0);
        if (mesh.is_boundary(side)) side = mesh.opposite_halfedge_handle(side);
        const glm::dvec3 from = placeOf(mesh.point(mesh.from_vertex_handle(side))),
                         to = placeOf(mesh.point(mesh.to_vertex_handle(side)));
        edges.firstBorderTriangle = linked.triangleOf[size_t(mesh.face_handle(side).idx())];
        edges.firstBorder = fmt::format("from ({:.9g}, {:.9g}, {:.9g}) to ({:.9g}, {:.9g}, {:.9g})", from.x, from.y,
                                        from.z, to.x, to.y, to.z);
    }
    edges.parts = countParts(mesh);
    return edges;
}

}  // namespace vcp::meso
