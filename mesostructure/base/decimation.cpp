#include "mesostructure/base/decimation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#include <OpenMesh/Tools/Decimater/Observer.hh>
#include <glm/common.hpp>

#include "mesostructure/base/half_edges.h"
#include "mesostructure/base/seams.h"

namespace vcp::meso {

namespace {

using OpenMesh::EdgeHandle, OpenMesh::FaceHandle, OpenMesh::HalfedgeHandle, OpenMesh::VertexHandle;
using Point = HalfEdges::Point;
using Quadric = OpenMesh::Geometry::QuadricT<double>;

constexpr size_t kMostDecimatedTriangles = 20'000'000;
constexpr uint32_t kMostAtCorner = 4096;  // each collapse looks at all neighbours of neighbours
// What it costs to move a corner within its plane, so that flat parts get no slivers.
constexpr double kWithinPlane = 1e-6;
constexpr double kMostTurn = 0.5;  // the cosine of 60 degrees

/// The texture coordinates of the faces' corners while corners move.
class MovingMap {
public:
    MovingMap(const BaseSurface& surface, const LinkedSurface& linked) {
        if (surface.uvs.empty()) return;
        for (const auto face : linked.mesh.faces()) {
            auto& corners = corners_.emplace_back();
            int k = 0;
            for (auto vertex = linked.mesh.cfv_iter(face); vertex.is_valid(); ++vertex, ++k)
                corners[k] = {vertex->idx(), surface.uvs[linked.triangleOf[size_t(face.idx())]]
                                                        [size_t(cornerAt(surface, linked, face, *vertex))]};
        }
    }
    [[nodiscard]] bool exists() const { return !corners_.empty(); }
    [[nodiscard]] glm::dvec2 at(FaceHandle face, VertexHandle vertex) const {
        for (const Corner& corner : corners_[size_t(face.idx())])
            if (corner.vertex == vertex.idx()) return corner.uv;
        return {};
    }
    void move(FaceHandle face, VertexHandle from, VertexHandle to, glm::dvec2 uv) {
        for (Corner& corner : corners_[size_t(face.idx())])
            if (corner.vertex == from.idx()) corner = {to.idx(), uv};
    }

private:
    struct Corner {
        int vertex = -1;
        glm::dvec2 uv{0};
    };
    std::vector<std::array<Corner, 3>> corners_;
};

/// What a collapse costs, and what it does to the map. Borders and seams have planes of their own, which stand on the
/// surface.
template <class MeshT>
class SurfaceModule : public OpenMesh::Decimater::ModBaseT<MeshT> {
public:
    DECIMATING_MODULE(SurfaceModule, MeshT, Surface)

    explicit SurfaceModule(MeshT& mesh) : Base(mesh, false) {}
    /// `weights`: of the faces; empty: 1.
    void use(MovingMap& map, std::vector<float> weights) { map_ = &map, weights_ = std::move(weights); }

    void initialize() override {
        MeshT& mesh = this->mesh();
        quadrics_.assign(mesh.n_vertices(), Quadric());
        for (const auto face : mesh.faces()) {
            const Point normal = mesh.calc_face_normal(face);
            const auto first = mesh.halfedge_handle(face);
            const double weight = weights_.empty() ? 1 : double(weights_[size_t(face.idx())]);
            const double area = weight * mesh.calc_sector_area(first);
            if (!(area > 0)) continue;
            const Point place = mesh.point(mesh.to_vertex_handle(first));
            for (auto vertex = mesh.cfv_iter(face); vertex.is_valid(); ++vertex) {
                add(*vertex, Quadric(normal, place) * area);
                add(*vertex, Quadric(mesh.point(*vertex)) * (area * kWithinPlane));
            }
            auto side = first;
            for (int k = 0; k < 3; ++k, side = mesh.next_halfedge_handle(side))
                if (mesh.is_boundary(mesh.edge_handle(side)) || mesh.status(mesh.edge_handle(side)).feature())
                    holdEdge(side, normal, weight);
        }
    }

    float collapse_priority(const CollapseInfo& info) override {
        if (turns(info)) return float(Base::ILLEGAL_COLLAPSE);
        Quadric both = quadrics_[size_t(info.v0.idx())];
        both += quadrics_[size_t(info.v1.idx())];
        // On a plane rounding makes it less than nothing, which would forbid it.
        return float(std::max(both(info.p1), 0.0));
    }

    void preprocess_collapse(const CollapseInfo& info) override {
        if (map_->exists()) moveMap(info);
    }

    void postprocess_collapse(const CollapseInfo& info) override { add(info.v1, quadrics_[size_t(info.v0.idx())]); }

private:
    void add(VertexHandle vertex, const Quadric& quadric) { quadrics_[size_t(vertex.idx())] += quadric; }

    void holdEdge(HalfedgeHandle side, const Point& normal, double weight) {
        MeshT& mesh = this->mesh();
        const Point along = mesh.calc_edge_vector(side);
        Point across = normal % along;
        const double length = across.norm();
        if (!(length > 0)) return;
        across /= length;
        const Quadric quadric = Quadric(across, mesh.point(mesh.to_vertex_handle(side))) * (weight * along.sqrnorm());
        add(mesh.to_vertex_handle(side), quadric), add(mesh.from_vertex_handle(side), quadric);
    }

    /// Whether a triangle that stays would turn too far. One without area may turn to any side.
    bool turns(const CollapseInfo& info) {
        MeshT& mesh = this->mesh();
        bool any = false;
        for (auto face = mesh.cvf_iter(info.v0); face.is_valid() && !any; ++face) {
            if (*face == info.fl || *face == info.fr) continue;
            const Point before = mesh.calc_face_normal(*face);
            mesh.set_point(info.v0, info.p1);
            const Point after = mesh.calc_face_normal(*face);
            mesh.set_point(info.v0, info.p0);
            any = before.sqrnorm() > 0 && dot(before, after) < kMostTurn;
        }
        return any;
    }

    /// Gives the faces that v0 leaves the coordinates of v1: those of the side of the seam on which they lie.
    void moveMap(const CollapseInfo& info) {
        MeshT& mesh = this->mesh();
        const FaceHandle left = info.fl.is_valid() ? info.fl : info.fr, right = info.fr.is_valid() ? info.fr : info.fl;
        const glm::dvec2 atLeft = map_->at(left, info.v1), atRight = map_->at(right, info.v1);
        bool isRight = false;
        HalfedgeHandle side = info.v0v1;
        do {
            isRight = isRight || (side != info.v0v1 && mesh.status(mesh.edge_handle(side)).feature());
            const FaceHandle face = mesh.face_handle(side);
            if (face.is_valid() && face != info.fl && face != info.fr)
                map_->move(face, info.v0, info.v1, isRight ? atRight : atLeft);
            side = mesh.ccw_rotated_halfedge_handle(side);
        } while (side != info.v0v1);
        if (info.fl.is_valid()) joinFeatures(info.v0vl, info.vlv1);
        if (info.fr.is_valid()) joinFeatures(info.vrv0, info.v1vr);
    }

    /// Two edges become one, which is a seam where one of them was.
    void joinFeatures(HalfedgeHandle one, HalfedgeHandle other) {
        MeshT& mesh = this->mesh();
        auto &a = mesh.status(mesh.edge_handle(one)), &b = mesh.status(mesh.edge_handle(other));
        const bool isSeam = a.feature() || b.feature();
        a.set_feature(isSeam), b.set_feature(isSeam);
    }

    std::vector<Quadric> quadrics_;
    std::vector<float> weights_;
    MovingMap* map_ = nullptr;
};

class Progress : public OpenMesh::Decimater::Observer {
public:
    Progress(const DecimationOptions& options, size_t steps) : Observer(256), options_(options), steps_(steps) {}
    void notify(size_t step) override {
        isCancelled_ =
            options_.progress && !options_.progress(std::min(1.0, double(step) / double(std::max<size_t>(steps_, 1))));
    }
    [[nodiscard]] bool abort() const override { return isCancelled_; }

private:
    const DecimationOptions& options_;
    size_t steps_;
    bool isCancelled_ = false;
};

/// Moves the mesh to the middle and into a box of one: quadrics lose digits far from their origin.
void centre(HalfEdges& mesh) {
    glm::dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
    for (const auto vertex : mesh.vertices()) {
        low = glm::min(low, placeOf(mesh.point(vertex)));
        high = glm::max(high, placeOf(mesh.point(vertex)));
    }
    const glm::dvec3 size = 0.5 * high - 0.5 * low, middle = low + size;
    const double edge = std::max({size.x, size.y, size.z});
    for (const auto vertex : mesh.vertices())
        mesh.set_point(vertex, pointOf((placeOf(mesh.point(vertex)) - middle) / (edge > 0 ? edge : 1)));
}

/// Marks seams, and holds corners where a seam ends, comes to a border, or meets another one.
void markSeams(const BaseSurface& surface, LinkedSurface& linked) {
    HalfEdges& mesh = linked.mesh;
    for (const auto edge : mesh.edges()) mesh.status(edge).set_feature(isSeam(surface, linked, edge));
    for (const auto vertex : mesh.vertices()) {
        int seams = 0;
        for (auto edge = mesh.cve_iter(vertex); edge.is_valid(); ++edge) seams += mesh.status(*edge).feature();
        const bool goesThrough = seams == 2 && !mesh.is_boundary(vertex);
        mesh.status(vertex).set_feature(goesThrough);
        mesh.status(vertex).set_locked(seams > 0 && !goesThrough);
    }
}

BaseSurface whatIsLeft(const BaseSurface& surface, const LinkedSurface& linked, const MovingMap& map) {
    const HalfEdges& mesh = linked.mesh;
    BaseSurface made;
    std::vector<uint32_t> numbers(mesh.n_vertices(), UINT32_MAX);
    for (const auto face : mesh.faces()) {
        if (mesh.status(face).deleted()) continue;
        std::array<uint32_t, 3> triangle;
        std::array<glm::dvec2, 3> coordinates;
        int k = 0;
        for (auto vertex = mesh.cfv_iter(face); vertex.is_valid(); ++vertex, ++k) {
            uint32_t& number = numbers[size_t(vertex->idx())];
            if (number == UINT32_MAX) {
                number = uint32_t(made.positions.size());
                made.positions.push_back(surface.positions[linked.positionOf[size_t(vertex->idx())]]);
            }
            triangle[k] = number;
            if (map.exists()) coordinates[k] = map.at(face, *vertex);
        }
        made.triangles.push_back(triangle);
        if (map.exists()) made.uvs.push_back(coordinates);
    }
    return made;
}

Result<void> checkSize(const LinkedSurface& linked) {
    const HalfEdges& mesh = linked.mesh;
    if (mesh.n_faces() == 0) return Error{.message = "no triangle has three different corners"};
    if (mesh.n_faces() > kMostDecimatedTriangles)
        return Error{
            .code = ErrorCode::Limit,
            .message = fmt::format("has more than {} triangles to decimate in memory", kMostDecimatedTriangles)};
    for (const auto vertex : mesh.vertices())
        if (mesh.valence(vertex) > kMostAtCorner)
            return Error{.code = ErrorCode::Limit,
                         .message = fmt::format("more than {} triangles meet at one of its corners; cut the fan in two",
                                                kMostAtCorner),
                         .element = fmt::format("vertex {}", linked.positionOf[size_t(vertex.idx())])};
    return {};
}

}  // namespace

Result<BaseSurface> decimated(const BaseSurface& surface, const DecimationOptions& options) {
    LinkedSurface linked;
    VCP_TRY(linkSurface(surface, linked));
    VCP_TRY(checkSize(linked));
    HalfEdges& mesh = linked.mesh;
    MovingMap map(surface, linked);
    centre(mesh);
    OpenMesh::Decimater::DecimaterT<HalfEdges> decimater(mesh);
    markSeams(surface, linked);
    SurfaceModule<HalfEdges>::Handle module;
    decimater.add(module);
    std::vector<float> weights;
    if (!options.weights.empty())
        for (const uint32_t triangle : linked.triangleOf) weights.push_back(options.weights[triangle]);
    decimater.module(module).use(map, std::move(weights));
    if (!decimater.initialize()) return Error{.message = "the mesh cannot be decimated"};
    Progress progress(options, (mesh.n_faces() - std::min(options.triangles, mesh.n_faces())) / 2);
    decimater.set_observer(&progress);
    progress.notify(0);
    if (!progress.abort() && options.triangles < mesh.n_faces()) decimater.decimate_to_faces(0, options.triangles);
    if (progress.abort()) return Error::cancelled();
    return whatIsLeft(surface, linked, map);
}

}  // namespace vcp::meso
