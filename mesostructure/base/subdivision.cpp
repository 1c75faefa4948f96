#include "mesostructure/base/subdivision.h"

#include <algorithm>

#include <fmt/format.h>
#include <OpenMesh/Tools/Subdivider/Uniform/LoopT.hh>

#include "mesostructure/base/half_edges.h"

namespace vcp::meso {

namespace {

/// Loop's rules, with weights for as many neighbours as there are: OpenMesh's own table ends at 50.
class LoopRules : public OpenMesh::Subdivider::Uniform::LoopT<HalfEdges> {
public:
    explicit LoopRules(const HalfEdges& mesh) {
        size_t most = 0;
        for (const auto vertex : mesh.vertices()) most = std::max(most, size_t(mesh.valence(vertex)));
        init_weights(most + 1);
    }
};

/// The numbers of the edges from each corner of a face to the next, in the order of its triangle.
std::array<uint32_t, 3> edgesOfFace(const HalfEdges& mesh, OpenMesh::FaceHandle face) {
    std::array<uint32_t, 3> edges;
    auto side = mesh.halfedge_handle(face);
    for (uint32_t& edge : edges) {
        edge = uint32_t(mesh.edge_handle(side).idx());
        side = mesh.next_halfedge_handle(side);
    }
    return edges;
}

/// Checks that no two triangles stand back to back on the same three corners: the edges within them would become one.
Result<void> checkNoTwins(const LinkedSurface& linked) {
    const HalfEdges& mesh = linked.mesh;
    for (const auto face : mesh.faces()) {
        const auto side = mesh.halfedge_handle(face);
        const auto other = mesh.opposite_face_handle(side);
        if (other.is_valid() && other == mesh.opposite_face_handle(mesh.next_halfedge_handle(side)))
            return Error{.message = "another triangle stands on the same three corners, back to back; remove both",
                         .element = fmt::format("triangle {}", linked.triangleOf[size_t(face.idx())])};
    }
    return {};
}

/// Adds the four triangles of one: a, b and c are its corners; ab, bc and ca between them.
template <class Corner>
void addQuarters(const std::array<Corner, 3>& corner, const std::array<Corner, 3>& middle,
                 std::vector<std::array<Corner, 3>>& to) {
    for (int k = 0; k < 3; ++k) {
        std::array<Corner, 3> quarter;
        quarter[k] = corner[k], quarter[(k + 1) % 3] = middle[k], quarter[(k + 2) % 3] = middle[(k + 2) % 3];
        to.push_back(quarter);
    }
    to.push_back(middle);
}

Result<BaseSurface> subdividedOnce(const BaseSurface& surface) {
    LinkedSurface linked;
    VCP_TRY(linkSurface(surface, linked));
    VCP_TRY(checkNoTwins(linked));
    HalfEdges& mesh = linked.mesh;
    const auto vertices = uint32_t(mesh.n_vertices());
    BaseSurface made;
    made.triangles.reserve(4 * mesh.n_faces());
    for (const auto face : mesh.faces()) {
        const uint32_t triangle = linked.triangleOf[size_t(face.idx())];
        std::array<uint32_t, 3> corner, middle = edgesOfFace(mesh, face);
        auto side = mesh.halfedge_handle(face);
        for (int k = 0; k < 3; ++k, side = mesh.next_halfedge_handle(side)) {
            corner[k] = uint32_t(mesh.from_vertex_handle(side).idx());
            middle[k] += vertices;  // OpenMesh adds a vertex an edge, in the edges' order
        }
        addQuarters(corner, middle, made.triangles);
        if (surface.uvs.empty()) continue;
        const auto& map = surface.uvs[triangle];
        addQuarters(map, {0.5 * (map[0] + map[1]), 0.5 * (map[1] + map[2]), 0.5 * (map[2] + map[0])}, made.uvs);
    }
    LoopRules rules(mesh);
    rules(mesh, 1);
    made.positions.reserve(mesh.n_vertices());
    for (const auto vertex : mesh.vertices()) made.positions.push_back(placeOf(mesh.point(vertex)));
    return made;
}

}  // namespace

Result<BaseSurface> subdivided(const BaseSurface& surface, int times) {
    if (times < 0 || times > kMostSubdivisions)
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("a surface is subdivided 0 to {} times", kMostSubdivisions)};
    if (surface.triangles.size() > kMostSubdivided >> (2 * times))
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("subdividing {} times would make more than {} triangles; subdivide less",
                                            times, kMostSubdivided)};
    BaseSurface made = surface;
    for (int i = 0; i < times; ++i) {
        auto finer = subdividedOnce(made);
        if (!finer) return finer;
        made = *std::move(finer);
        if (made.triangles.empty()) return Error{.message = "no triangle has three different corners"};
    }
    return made;
}

}  // namespace vcp::meso
