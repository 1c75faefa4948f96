// Makes the pieces of a view: culls base triangles, and halves those with edges of too many cells; or takes the patches
// of certified cells. For this room alone.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mesostructure/remesh/certified_cells.h"
#include "mesostructure/remesh/piece_sweep.h"

namespace vcp::meso {

/// Errors: Usage, those of remesh().
Result<void> checkRemeshing(const RemeshOptions& options);
Error tooManyVertices(uint64_t most);

// An edge gets shorter than a cell at the nearest depth before.
inline constexpr int kMostHalvings = 96;

template <class Real>
typename RemeshMath<Real>::RemeshView remeshViewOf(const RemeshCamera& camera, const RemeshOptions& options) {
    const double focal = camera.focal / options.cell;
    return {{Real(focal), Real(camera.nearest), Real(1 / std::log1p(1 / focal)), camera.isParallel ? 1u : 0u},
            Real(options.cell / camera.focal),
            uint32_t(options.access)};
}

/// Whether all of some points, in eye space, are outside one of the planes of what is seen.
template <size_t n>
bool isOutsideView(const RemeshCamera& camera, const glm::dvec4& seen, const std::array<glm::dvec3, n>& points) {
    const auto isAllBelow = [&](glm::dvec3 normal, double least) {
        return std::ranges::all_of(points, [&](glm::dvec3 p) { return glm::dot(normal, p) < least; });
    };
    if (camera.isParallel)
        return isAllBelow({1, 0, 0}, seen.x) || isAllBelow({0, 1, 0}, seen.y) || isAllBelow({-1, 0, 0}, -seen.z) ||
               isAllBelow({0, -1, 0}, -seen.w) || isAllBelow({0, 0, 1}, 0);
    return isAllBelow({0, 0, 1}, camera.nearest) || isAllBelow({1, 0, -seen.x}, 0) || isAllBelow({0, 1, -seen.y}, 0) ||
           isAllBelow({-1, 0, seen.z}, 0) || isAllBelow({0, -1, seen.w}, 0);
}

/// `counts` get what is culled and halved. With `cells`, the surface is that of their patches, whose cells were chosen.
template <class Real>
class PieceMaker {
public:
    using Math = RemeshMath<Real>;
    using Real2 = glm::vec<2, Real>;
    using Real3 = glm::vec<3, Real>;
    using Corner = RemeshCorner<Real>;
    using Piece = RemeshPiece<Real>;

    PieceMaker(const RemeshSurface& surface, const RemeshCamera& camera, const RemeshOptions& options,
               RemeshCounts& counts, const CertifiedCells* cells = nullptr)
        : camera_(camera),
          surface_(surface),
          options_(options),
          view_(remeshViewOf<Real>(camera, options)),
          counts_(counts),
          cells_(cells) {
        points_.heights.from = surface.heights.get(), points_.view = view_;
    }

    /// Hands each piece to `add`, which returns a Result; ends at its first error.
    template <class Add>
    Result<void> run(const Add& add) {
        addCorners();
        for (size_t i = 0; i < surface_.triangles.size(); ++i) {
            ++counts_.baseTriangles;
            Piece piece;
            piece.triangle = surface_.baseTriangles[i];
            for (int k = 0; k < 3; ++k) {
                piece.corners[k] = corners_[surface_.triangles[i][k]];
                piece.corners[k].uv = Real2(surface_.uvs[i][k]);
            }
            if (isOutside(piece)) {
                ++counts_.culled;
                continue;
            }
            for (int k = 0; k < 3; ++k) {
                measure(surface_.triangles[i][k]);
                piece.corners[k].height = corners_[surface_.triangles[i][k]].height;
                if (const uint32_t seam = surface_.seams[i][k]; seam != RemeshSurface::kNoSeam)
                    piece.seams[k] = {true, Real2(surface_.seamUvs[seam][0]), Real2(surface_.seamUvs[seam][1])};
            }
            if (cells_ != nullptr) {
                takeCells(piece, i);
                VCP_TRY(add(piece));
                continue;
            }
            open_.push_back(piece);
            while (!open_.empty()) VCP_TRY(step(add));
        }
        return {};
    }

private:
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
    [[nodiscard]] Real heightAt(const Real2& uv, const Real3& position, const Real3& direction, Real density) {
        const Real texels = points_.remeshTexelsAt(position, density);
        return points_.remeshHeightAt(points_.remeshHeightFootprint(texels, 0), texels, uv, position, direction);
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
        corner.height = cells_ != nullptr ? cells_->template height<Real>(number) : Real(0);
        if (cells_ != nullptr) return;
        for (uint32_t i = surface_.firstPlace[number]; i < surface_.firstPlace[number + 1]; ++i)
            corner.height = std::max(
                corner.height, heightAt(Real2(surface_.places[i]), corner.position, corner.direction, corner.density));
    }

    /// Whether a piece, up to the highest that may stand on it, is outside one of the view's planes.
    [[nodiscard]] bool isOutside(const Piece& piece) const {
        std::array<glm::dvec3, 6> points;
        for (int k = 0; k < 3; ++k) {
            points[k] = glm::dvec3(piece.corners[k].position);
            points[k + 3] = points[k] + glm::dvec3(piece.corners[k].direction);
        }
        return isOutsideView(camera_, camera_.seen, points);
    }

    /// Gives a patch its cells of the map, over which nothing is in perspective.
    void takeCells(Piece& piece, size_t patch) const {
        const PatchCells chosen = cells_->cells(patch);
        const auto corners = cells_->corners(patch, chosen.step);
        for (size_t k = 0; k < 3; ++k) piece.corners[k].grid = corners[k], piece.corners[k].weight = 1;
        piece.parts = chosen.parts, piece.levels = chosen.levels;
    }

    /// Hands on, drops or halves the last of the open pieces.
    template <class Add>
    Result<void> step(const Add& add) {
        Piece piece = open_.back();
        open_.pop_back();
        if (piece.halvings > 0 && isOutside(piece)) return {};
        int longest = -1, most = options_.mostCells;
        for (int k = 0; k < 3; ++k)
            if (const int cells = Math::remeshEdge(piece.corners[k].grid, piece.corners[(k + 1) % 3].grid).cells;
                cells > most)
                longest = k, most = cells;
        if (longest < 0) return add(piece);
        if (piece.halvings == kMostHalvings) {
            ++counts_.tooDeep;
            // It is not parted: as if its corners were rounded to one grid point.
            for (Corner& corner : piece.corners) corner.grid = piece.corners[0].grid;
            return add(piece);
        }
        halve(piece, longest);
        return {};
    }

    void halve(const Piece& piece, int k) {
        ++counts_.halvings;
        const int next = (k + 1) % 3, other = (k + 2) % 3;
        const Corner &a = piece.corners[k], &b = piece.corners[next];
        const auto& seam = piece.seams[k];
        const auto middle = [](const auto& x, const auto& y) { return Real(0.5) * (x + y); };
        Corner m{};
        m.position = middle(a.position, b.position), m.direction = middle(a.direction, b.direction);
        m.uv = middle(a.uv, b.uv), m.density = middle(a.density, b.density);
        m.height = heightAt(m.uv, m.position, m.direction, m.density);
        const Real2 beyond = middle(seam.start, seam.end);
        if (seam.is) m.height = std::max(m.height, heightAt(beyond, m.position, m.direction, m.density));
        place(m);
        Piece first = piece, second = piece;
        first.halvings = second.halvings = piece.halvings + 1;
        first.corners[next] = m, second.corners[k] = m;
        first.seams[k].end = second.seams[k].start = beyond;
        // The edge between the halves is in no other triangle.
        first.seams[next] = second.seams[other] = {};
        open_.push_back(second), open_.push_back(first);
    }

    const RemeshCamera& camera_;
    const RemeshSurface& surface_;
    const RemeshOptions& options_;
    const typename Math::RemeshView view_;
    RemeshCounts& counts_;
    const CertifiedCells* cells_;
    typename PieceSweep<Real>::Sweeping points_;
    std::vector<Corner> corners_;
    std::vector<bool> isMeasured_;
    std::vector<Piece> open_;
};

}  // namespace vcp::meso
