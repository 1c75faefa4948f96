// Sweeps one piece on the processor (mesostructure/shared/remesh_sweep.h): its vertices and the strips between its
// columns. For this room alone.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <glm/geometric.hpp>

#include "mesostructure/remesh/height_deviation.h"
#include "mesostructure/remesh/remesh_piece.h"
#include "mesostructure/remesh/remesher.h"

namespace vcp::meso {

/// The piece, the surface's heights and the mesh, as the sweep reads and writes them.
template <class Real>
struct SweptPiece {
    using Real2 = glm::vec<2, Real>;
    using Real3 = glm::vec<3, Real>;

    using RemeshFootprint = typename RemeshHeights<Real>::RemeshFootprint;

    RemeshHeights<Real> heights{};
    typename RemeshMath<Real>::RemeshView view{};
    RemeshMesh<Real>* mesh = nullptr;
    const RemeshPiece<Real>* piece = nullptr;
    std::vector<Real> displaced;  ///< heights of the piece's vertices
    uint32_t numberedFrom = 0;    ///< number of the piece's first vertex

    [[nodiscard]] const RemeshCorner<Real>& remeshCorner(int k) const { return piece->corners[size_t(k)]; }
    [[nodiscard]] glm::ivec3 remeshCell(int k) const { return piece->corners[size_t(k)].grid; }
    [[nodiscard]] const auto& remeshSeam(int k) const { return piece->seams[size_t(k)]; }
    [[nodiscard]] int remeshParts(int k, int cells) const { return piece->parts[k] > 0 ? piece->parts[k] : cells; }
    [[nodiscard]] int remeshHeightLevel(int k) const { return piece->levels[k]; }
    [[nodiscard]] RemeshFootprint remeshFootprint(Real texels) { return heights.remeshFootprint(texels); }
    [[nodiscard]] Real remeshHeight(const RemeshFootprint& footprint, const Real2& uv) {
        return heights.remeshHeight(footprint, uv);
    }
    [[nodiscard]] int remeshLevels() const { return heights.remeshLevels(); }
    [[nodiscard]] Real remeshMapWidth() const { return Real(heights.from->levels().front().size.x); }
    void remeshAddVertex(uint32_t number, const Real3& position, const Real2& uv, Real height) {
        mesh->vertices[number] = {position, uv, piece->triangle};
        displaced[number - numberedFrom] = height;
    }
    void remeshAddTriangle(uint32_t a, uint32_t b, uint32_t c) {
        for (const uint32_t corner : {a, b, c}) mesh->indices.push_back(corner);
    }
};

template <class Real>
class PieceSweep {
public:
    using Sweeping = remeshing::RemeshSweeping<Real, SweptPiece<Real>>;

    PieceSweep(const RemeshSurface& surface, const RemeshOptions& options,
               const typename RemeshMath<Real>::RemeshView& view, RemeshMesh<Real>& mesh)
        : surface_(surface), options_(options), mesh_(mesh) {
        sweeping_.heights.from = surface.heights.get(), sweeping_.view = view, sweeping_.mesh = &mesh;
    }

    void sweep(const RemeshPiece<Real>& piece) {
        sweeping_.piece = &piece;
        ++mesh_.counts.pieces;
        sweeping_.numberedFrom = uint32_t(mesh_.vertices.size());
        firstIndex_ = mesh_.indices.size();
        const auto s = sweeping_.remeshSweep(sweeping_.numberedFrom);
        count(s);
        const int from = s.first.x, columns = sweeping_.remeshColumns(s.plan, s.first, s.second);
        firstInside_.assign(1, s.firstVertex + uint32_t(s.firstInside));
        for (int c = from; c < from + columns; ++c)
            firstInside_.push_back(firstInside_.back() + uint32_t(sweeping_.remeshInside(s, c).count));
        mesh_.vertices.resize(firstInside_.back());
        sweeping_.displaced.resize(firstInside_.back() - s.firstVertex);
        for (int c = 0; c < columns; ++c) sweeping_.remeshAddColumn(s, from + c, firstInside_[size_t(c)]);
        if (options_.bounds) addBound();
    }

    /// Heights of the last piece's vertices.
    [[nodiscard]] const std::vector<Real>& heights() const { return sweeping_.displaced; }

private:
    void count(const typename Sweeping::RemeshSweep& s) {
        RemeshCounts& counts = mesh_.counts;
        if (s.plan.isWhole != 0) {
            ++counts.whole;
            return;
        }
        int axes[3];
        for (int k = 0; k < 3; ++k)
            axes[k] = RemeshMath<Real>::remeshEdge(sweeping_.remeshCell(k), sweeping_.remeshCell((k + 1) % 3)).axis;
        counts.threeAxes += axes[0] != axes[1] && axes[1] != axes[2] && axes[2] != axes[0];
        for (int c = s.first.x; c < s.second.x; ++c) {
            const auto strip = sweeping_.remeshStrip(s, c, 0, 0);
            ++counts.strips;
            counts.quads +=
                uint64_t(std::max(sweeping_.remeshCount(strip.left), sweeping_.remeshCount(strip.right)) - 1);
        }
    }

    /// Takes the piece's triangles into the bound, as certified_cells.h says.
    void addBound() {
        const auto& view = sweeping_.view;
        double longest = 0, apart = 0;
        for (int k = 0; k < 3; ++k) {
            const glm::dvec3 a(sweeping_.remeshCorner(k).direction), b(sweeping_.remeshCorner((k + 1) % 3).direction);
            longest = std::max(longest, glm::length(a)), apart = std::max(apart, glm::distance(a, b));
        }
        for (size_t i = firstIndex_; i < mesh_.indices.size(); i += 3) {
            std::array<HeightCorner, 3> corners;
            double least = 1, most = 0, depth = 1e300, slope = 0;
            for (int k = 0; k < 3; ++k) {
                const RemeshVertex<Real>& v = mesh_.vertices[mesh_.indices[i + k]];
                const double height = sweeping_.displaced[mesh_.indices[i + k] - sweeping_.numberedFrom];
                corners[size_t(k)] = {glm::dvec2(v.uv), height};
                least = std::min(least, height), most = std::max(most, height);
                depth = std::min(depth, double(v.position.z));
                if (view.grid.isParallel == 0u && v.position.z > 0)
                    slope =
                        std::max(slope, std::hypot(double(v.position.x), double(v.position.y)) / double(v.position.z));
            }
            const double off = longest * heightDeviation(*surface_.heights, corners) + 0.25 * (most - least) * apart;
            const double pixels = double(view.grid.focal) * options_.cell * off;
            double bound = pixels;
            if (view.grid.isParallel == 0u)
                bound = depth > off ? pixels * std::hypot(1.0, slope) / (depth - off) : 1e300;
            mesh_.counts.boundPixels = std::max(mesh_.counts.boundPixels, bound);
        }
    }

    const RemeshSurface& surface_;
    const RemeshOptions& options_;
    RemeshMesh<Real>& mesh_;
    Sweeping sweeping_;
    size_t firstIndex_ = 0;
    std::vector<uint32_t> firstInside_;  // grid point of each column, and what comes after them
};

}  // namespace vcp::meso
