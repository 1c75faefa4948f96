#include "mesostructure/base/half_edges.h"

#include <algorithm>
#include <tuple>

#include <fmt/format.h>

namespace vcp::meso {

namespace {

constexpr size_t kMostLinkedTriangles = size_t{1} << 29;  // OpenMesh numbers halfedges with 31 bits

std::string shownPlace(glm::dvec3 p) { return fmt::format("({:.9g}, {:.9g}, {:.9g})", p.x, p.y, p.z); }

constexpr uint32_t kNone = UINT32_MAX;

/// The side of a face from one corner to the next is numbered 3 face + corner; its ends lower position first.
struct Side {
    uint32_t low, high, number;
    bool isForward;  ///< whether the side runs from low to high
};

class Linker {
public:
    Linker(const BaseSurface& surface, LinkedSurface& made) : surface_(surface), made_(made) {}

    Result<void> link() {
        if (surface_.triangles.size() > kMostLinkedTriangles)
            return Error{.code = ErrorCode::Limit, .message = "the surface has too many triangles for half-edges"};
        chooseFaces();
        VCP_TRY(pairSides());
        numberVertices();
        linkFaces();
        linkBorder();
        return {};
    }

private:
    using Vertex = OpenMesh::VertexHandle;
    using Halfedge = OpenMesh::HalfedgeHandle;

    HalfEdges& mesh() { return made_.mesh; }
    static uint32_t next(uint32_t side) { return side % 3 == 2 ? side - 2 : side + 1; }
    static uint32_t previous(uint32_t side) { return side % 3 == 0 ? side + 2 : side - 1; }
    /// The position from which a side runs.
    [[nodiscard]] uint32_t start(uint32_t side) const {
        return surface_.triangles[made_.triangleOf[side / 3]][side % 3];
    }
    [[nodiscard]] Error wrong(uint32_t side, std::string message) const {
        return {.message = std::move(message), .element = fmt::format("triangle {}", made_.triangleOf[side / 3])};
    }

    void chooseFaces() {
        for (uint32_t i = 0; i < surface_.triangles.size(); ++i) {
            const auto& t = surface_.triangles[i];
            if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) made_.triangleOf.push_back(i);
        }
        sides_ = uint32_t(3 * made_.triangleOf.size());
    }

    [[nodiscard]] std::vector<Side> sortedSides() const {
        std::vector<Side> sides;
        sides.reserve(sides_);
        for (uint32_t i = 0; i < sides_; ++i) {
            const uint32_t from = start(i), to = start(next(i));
            sides.push_back({std::min(from, to), std::max(from, to), i, from < to});
        }
        std::ranges::sort(sides, {}, [](const Side& a) { return std::tie(a.low, a.high, a.number); });
        return sides;
    }

    /// Finds the other side of each edge, and the sides that begin an edge.
    Result<void> pairSides() {
        const std::vector<Side> sides = sortedSides();
        opposite_.assign(sides_, kNone);
        for (size_t first = 0, last; first < sides.size(); first = last) {
            const Side& side = sides[first];
            last = first + 1;
            while (last < sides.size() && sides[last].low == side.low && sides[last].high == side.high) ++last;
            const auto along = [&] {
                return shownPlace(surface_.positions[side.low]) + " to " + shownPlace(surface_.positions[side.high]);
            };
            if (last - first > 2)
                return wrong(sides[first + 2].number,
                             fmt::format("{} triangles meet at the edge from {}, where a surface has two at most; take "
                                         "apart what only touches, or remove what lies inside",
                                         last - first, along()));
            if (last - first == 2 && side.isForward == sides[first + 1].isForward)
                return wrong(sides[first + 1].number,
                             fmt::format("is turned against triangle {}, its neighbour over the edge from {}; turn the "
                                         "faces to one side (recalculate normals)",
                                         made_.triangleOf[side.number / 3], along()));
            edges_.push_back(side.number);
            if (last - first < 2) continue;
            opposite_[side.number] = sides[first + 1].number, opposite_[sides[first + 1].number] = side.number;
        }
        return {};
    }

    /// Gives each fan of triangles at a position a vertex. The first fans come first, in the order of the positions.
    void numberVertices() {
        std::vector<uint32_t> firstSide(surface_.positions.size(), kNone);
        for (uint32_t i = sides_; i-- > 0;) firstSide[start(i)] = i;
        vertexOf_.assign(sides_, kNone);
        for (const uint32_t side : firstSide)
            if (side != kNone) numberFan(side);
        for (uint32_t i = 0; i < sides_; ++i)
            if (vertexOf_[i] == kNone) numberFan(i);
    }
    void numberFan(uint32_t first) {
        const auto vertex = uint32_t(made_.positionOf.size());
        made_.positionOf.push_back(start(first));
        mesh().new_vertex(pointOf(surface_.positions[start(first)]));
        for (uint32_t side = first; side != kNone && vertexOf_[side] == kNone; side = opposite_[previous(side)])
            vertexOf_[side] = vertex;
        // From a border the fan goes on the other way.
        for (uint32_t other = opposite_[first]; other != kNone && vertexOf_[next(other)] == kNone;
             other = opposite_[next(other)])
            vertexOf_[next(other)] = vertex;
    }

    void linkFaces() {
        std::vector<Halfedge> halfedge(sides_);
        mesh().reserve(made_.positionOf.size(), edges_.size(), made_.triangleOf.size());
        for (const uint32_t side : edges_) {
            halfedge[side] = mesh().new_edge(Vertex(int(vertexOf_[side])), Vertex(int(vertexOf_[next(side)])));
            if (opposite_[side] != kNone) halfedge[opposite_[side]] = mesh().opposite_halfedge_handle(halfedge[side]);
        }
        for (uint32_t i = 0; i < sides_; ++i) {
            const OpenMesh::FaceHandle face = i % 3 == 0 ? OpenMesh::FaceHandle(mesh().new_face()) : faceOf(i);
            mesh().set_next_halfedge_handle(halfedge[i], halfedge[next(i)]);
            mesh().set_face_handle(halfedge[i], face);
            mesh().set_halfedge_handle(Vertex(int(vertexOf_[i])), halfedge[i]);
            if (i % 3 == 0) mesh().set_halfedge_handle(face, halfedge[i]);
        }
    }
    static OpenMesh::FaceHandle faceOf(uint32_t side) { return OpenMesh::FaceHandle(int(side / 3)); }

    /// Links the halfedges without a face into rings. A fan has none of them that leaves its corner, or one.
    void linkBorder() {
        std::vector<Halfedge> leaving(mesh().n_vertices());
        for (const auto halfedge : mesh().halfedges()) {
            if (!mesh().is_boundary(halfedge)) continue;
            const Vertex from = mesh().from_vertex_handle(halfedge);
            leaving[size_t(from.idx())] = halfedge;
            mesh().set_halfedge_handle(from, halfedge);
        }
        for (const auto halfedge : mesh().halfedges())
            if (mesh().is_boundary(halfedge))
                mesh().set_next_halfedge_handle(halfedge, leaving[size_t(mesh().to_vertex_handle(halfedge).idx())]);
    }

    const BaseSurface& surface_;
    LinkedSurface& made_;
    uint32_t sides_ = 0;
    std::vector<uint32_t> opposite_;  ///< number of the side on the other side of its edge, or kNone
    std::vector<uint32_t> edges_;     ///< a side of each edge
    std::vector<uint32_t> vertexOf_;  ///< the vertex from which a side runs
};

}  // namespace

Result<void> linkSurface(const BaseSurface& surface, LinkedSurface& linked) { return Linker(surface, linked).link(); }

}  // namespace vcp::meso
