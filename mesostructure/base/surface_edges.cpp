#include "mesostructure/base/surface_edges.h"

#include <algorithm>

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

std::vector<uint32_t> oppositeEdges(const std::vector<std::array<uint32_t, 3>>& triangles, size_t positions) {
    std::vector<uint32_t> first(positions + 1, 0), from(3 * triangles.size()), opposite(from.size(), kNoEdge);
    for (const auto& t : triangles)
        for (const uint32_t corner : t) ++first[corner + 1];
    for (size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
    std::vector<uint32_t> next(first.begin(), first.end() - 1);
    for (size_t i = 0; i < from.size(); ++i) from[next[triangles[i / 3][i % 3]]++] = uint32_t(i);
    const auto endOf = [&](uint32_t edge) { return triangles[edge / 3][(edge + 1) % 3]; };
    // The edges of corners at which many meet are in the order of their ends.
    constexpr uint32_t kMany = 32;
    const auto hasMany = [&](size_t corner) { return first[corner + 1] - first[corner] > kMany; };
    const auto at = [&](size_t place) { return from.begin() + std::ptrdiff_t(place); };
    for (size_t i = 0; i < positions; ++i)
        if (hasMany(i)) std::ranges::sort(at(first[i]), at(first[i + 1]), {}, endOf);
    for (uint32_t i = 0; i < from.size(); ++i) {
        const uint32_t start = triangles[i / 3][i % 3], end = endOf(i);
        const auto last = at(first[end + 1]);
        const auto found = hasMany(end) ? std::ranges::lower_bound(at(first[end]), last, start, {}, endOf)
                                        : std::ranges::find(at(first[end]), last, start, endOf);
        if (found != last && endOf(*found) == start) opposite[i] = *found;
    }
    return opposite;
}

}  // namespace vcp::meso
