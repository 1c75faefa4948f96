#include "mesostructure/remesh/remesher.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mesostructure/remesh/piece_sweep.h"

namespace vcp::meso {

namespace {

// An edge gets shorter than a cell at the nearest depth before.
constexpr int kMostHalvings = 96;

template <class Real>
class Remesher {
public:
    using Math = RemeshMath<Real>;
    using Real2 = glm::vec<2, Real>;
    using Real3 = glm::vec<3, Real>;
    using Corner = RemeshCorner<Real>;
    using Piece = RemeshPiece<Real>;

    Remesher(const RemeshSurface& surface, const RemeshCamera& camera, const RemeshOptions& options,
             RemeshMesh<Real>& mesh)
        : camera_(camera),
          surface_(surface),
          view_{surface, options, gridOf(camera, options.cell), Real(options.cell / camera.focal)},
          mesh_(mesh),
          sweep_(view_, mesh) {}

    Result<void> run(uint64_t mostVertices) {
        addCorners();
        for (size_t i = 0; i < surface_.triangles.size(); ++i) {
            ++mesh_.counts.baseTriangles;
            Piece piece;
            for (int k = 0; k < 3; ++k) {
                piece.corners[k] = corners_[surface_.triangles[i][k]];
                piece.corners[k].uv = Real2(surface_.uvs[i][k]);
            }
            if (isOutside(piece)) {
                ++mesh_.counts.culled;
                continue;
            }
            for (int k = 0; k < 3; ++k) {
                measure(surface_.triangles[i][k]);
                piece.corners[k].height = corners_[surface_.triangles[i][k]].height;
                if (const uint32_t seam = surface_.seams[i][k]; seam != RemeshSurface::kNoSeam)
                    piece.seams[k] = {true, {Real2(surface_.seamUvs[seam][0]), Real2(surface_.seamUvs[seam][1])}};
            }
            frame_ = frameOf(piece);
            open_.push_back(piece);
            while (!open_.empty()) {
                step();
                if (mesh_.vertices.size() > mostVertices)
                    return Error{.code = ErrorCode::Limit,
                                 .message = fmt::format(
                                     "remeshing makes more than {} vertices: larger cells make fewer", mostVertices)};
            }
        }
        return {};
    }

private:
    static typename Math::RemeshGrid gridOf(const RemeshCamera& camera, double cell) {
        const double focal = camera.focal / cell;
        return {Real(focal), Real(camera.nearest), Real(1 / std::log1p(1 / focal)), camera.isParallel ? 1u : 0u};
    }

    void addCorners() {
        const auto turned = [&](glm::dvec3 v) {
            return Real3(Real(glm::dot(v, camera_.right)), Real(glm::dot(v, camera_.up)),
                         Real(glm::dot(v, camera_.forward)));
        };
        const glm::dvec3 from = surface_.origin - camera_.eye;
        corners_.resize(surface_.positions.size());
        isMeasured_.assign(corners_.size(), false);
        for (size_t i = 0; i < corners_.size(); ++i) {
            Corner& corner = corners_[i];
            corner.position = turned(from + glm::dvec3(surface_.positions[i]));
            corner.direction = turned(glm::dvec3(surface_.directions[i]));
            corner.density = Real(surface_.densities[i]);
            place(corner);
        }
    }
    void place(Corner& corner) const {
        corner.weight = 1 / Math::remeshDepth(view_.grid, corner.position);
        corner.grid = Math::remeshGridPoint(view_.grid, corner.position);
    }

    /// Fills in the height of a base corner: the most of those that its triangles have there.
    void measure(uint32_t number) {
        if (isMeasured_[number]) return;
        isMeasured_[number] = true;
        Corner& corner = corners_[number];
        corner.height = 0;
        for (uint32_t i = surface_.firstPlace[number]; i < surface_.firstPlace[number + 1]; ++i)
            corner.height = std::max(corner.height, view_.heightAt(Real2(surface_.places[i]), corner.position,
                                                                   corner.direction, corner.density));
    }

    /// Whether a piece, up to the highest that may stand on it, is outside one of the view's planes.
    [[nodiscard]] bool isOutside(const Piece& piece) const {
        std::array<glm::dvec3, 6> points;
        for (int k = 0; k < 3; ++k) {
            points[k] = glm::dvec3(piece.corners[k].position);
            points[k + 3] = points[k] + glm::dvec3(piece.corners[k].direction);
        }
        const auto isAllBelow = [&](glm::dvec3 normal, double least) {
            return std::ranges::all_of(points, [&](glm::dvec3 p) { return glm::dot(normal, p) < least; });
        };
        const glm::dvec4 seen = camera_.seen;
        if (camera_.isParallel)
            return isAllBelow({1, 0, 0}, seen.x) || isAllBelow({0, 1, 0}, seen.y) || isAllBelow({-1, 0, 0}, -seen.z) ||
                   isAllBelow({0, -1, 0}, -seen.w) || isAllBelow({0, 0, 1}, 0);
        return isAllBelow({0, 0, 1}, camera_.nearest) || isAllBelow({1, 0, -seen.x}, 0) ||
               isAllBelow({0, 1, -seen.y}, 0) || isAllBelow({-1, 0, seen.z}, 0) || isAllBelow({0, -1, seen.w}, 0);
    }

    /// Sweeps, drops or halves the last of the open pieces.
    void step() {
        const Piece piece = open_.back();
        open_.pop_back();
        if (piece.halvings > 0 && isOutside(piece)) return;
        int longest = -1, most = view_.options.mostCells;
        for (int k = 0; k < 3; ++k)
            if (const int cells = Math::remeshEdge(piece.corners[k].grid, piece.corners[(k + 1) % 3].grid).cells;
                cells > most)
                longest = k, most = cells;
        if (longest < 0) return sweep_.sweep(piece, frame_);
        if (piece.halvings == kMostHalvings) {
            ++mesh_.counts.tooDeep;
            return sweep_.keep(piece, frame_);
        }
        halve(piece, longest);
    }

    void halve(const Piece& piece, int k) {
        ++mesh_.counts.halvings;
        const int next = (k + 1) % 3, other = (k + 2) % 3;
        const Corner &a = piece.corners[k], &b = piece.corners[next];
        const RemeshSeam<Real>& seam = piece.seams[k];
        const auto middle = [](const auto& x, const auto& y) { return Real(0.5) * (x + y); };
        Corner m;
        m.position = middle(a.position, b.position), m.direction = middle(a.direction, b.direction);
        m.uv = middle(a.uv, b.uv), m.density = middle(a.density, b.density);
        m.height = view_.heightAt(m.uv, m.position, m.direction, m.density);
        const Real2 beyond = middle(seam.uvs[0], seam.uvs[1]);
        if (seam.is) m.height = std::max(m.height, view_.heightAt(beyond, m.position, m.direction, m.density));
        place(m);
        Piece first = piece, second = piece;
        first.halvings = second.halvings = piece.halvings + 1;
        first.corners[next] = m, second.corners[k] = m;
        first.seams[k].uvs[1] = second.seams[k].uvs[0] = beyond;
        // The edge between the halves is in no other triangle.
        first.seams[next] = second.seams[other] = {};
        open_.push_back(second), open_.push_back(first);
    }

    static RemeshFrame<Real> frameOf(const Piece& piece) {
        const auto& c = piece.corners;
        RemeshFrame<Real> frame;
        // Eye space is left-handed: products are turned.
        const Real3 flat = glm::cross(c[2].position - c[0].position, c[1].position - c[0].position);
        const Real length = glm::length(flat);
        frame.flat = length > 0 ? flat / length : glm::normalize(c[0].direction);
        const Real2 a = c[1].uv - c[0].uv, b = c[2].uv - c[0].uv;
        const Real area = a.x * b.y - a.y * b.x;
        if (!(std::abs(area) > Real(1e-12) * (glm::dot(a, a) + glm::dot(b, b)))) return frame;
        frame.turned = area > 0 ? Real(-1) : Real(1);
        const auto byU = [&](const Real3& x, const Real3& y) { return (b.y * x - a.y * y) / area; };
        const auto byV = [&](const Real3& x, const Real3& y) { return (a.x * y - b.x * x) / area; };
        const Real3 p1 = c[1].position - c[0].position, p2 = c[2].position - c[0].position,
                    d1 = c[1].direction - c[0].direction, d2 = c[2].direction - c[0].direction;
        frame.byU = byU(p1, p2), frame.byV = byV(p1, p2);
        frame.directionByU = byU(d1, d2), frame.directionByV = byV(d1, d2);
        return frame;
    }

    const RemeshCamera& camera_;
    const RemeshSurface& surface_;
    const RemeshFrameView<Real> view_;
    RemeshMesh<Real>& mesh_;
    PieceSweep<Real> sweep_;
    std::vector<Corner> corners_;
    std::vector<bool> isMeasured_;
    std::vector<Piece> open_;
    RemeshFrame<Real> frame_;
};

}  // namespace

template <class Real>
Result<void> remesh(const RemeshSurface& surface, const RemeshCamera& camera, const RemeshOptions& options,
                    RemeshMesh<Real>& mesh, uint64_t mostVertices) {
    if (!(options.cell > 0) || !std::isfinite(options.cell))
        return Error{.code = ErrorCode::Usage, .message = "cells of a remeshed surface must be above 0 pixels"};
    if (options.mostCells < 2 || options.mostCells > 1024)
        return Error{.code = ErrorCode::Usage, .message = "an edge has from 2 to 1024 cells before it is halved"};
    return Remesher<Real>(surface, camera, options, mesh).run(mostVertices);
}

template Result<void> remesh(const RemeshSurface&, const RemeshCamera&, const RemeshOptions&, RemeshMesh<float>&,
                             uint64_t);
template Result<void> remesh(const RemeshSurface&, const RemeshCamera&, const RemeshOptions&, RemeshMesh<double>&,
                             uint64_t);

}  // namespace vcp::meso
