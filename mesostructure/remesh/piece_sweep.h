// Sweeps one piece: its vertices, column by column, and the strips between columns. For this room alone.
//
// A strip lies between the columns c and c + 1. Its left side goes up column c: from the primary edge over the grid
// points to the point of the side edge that is nearest to the column; its right side likewise; and along the top there
// may be further points of the side edge, where that is split along another direction than the sweep's. They are put on
// the side that they go up on, so that both sides end in one point, and the strip is zipped.
#pragma once

#include <algorithm>
#include <vector>

#include <glm/geometric.hpp>

#include "mesostructure/remesh/remesh_piece.h"

namespace vcp::meso {

template <class Real>
class PieceSweep {
public:
    using Math = RemeshMath<Real>;
    using Real2 = glm::vec<2, Real>;
    using Real3 = glm::vec<3, Real>;

    PieceSweep(const RemeshFrameView<Real>& view, RemeshMesh<Real>& mesh) : view_(view), mesh_(mesh) {}

    void sweep(const RemeshPiece<Real>& piece, const RemeshFrame<Real>& frame) {
        piece_ = &piece, frame_ = &frame;
        ++mesh_.counts.pieces;
        firstVertex_ = uint32_t(mesh_.vertices.size()), firstIndex_ = mesh_.indices.size();
        heights_.clear();
        const auto& c = piece.corners;
        plan_ = Math::remeshPlan(c[0].grid, c[1].grid, c[2].grid);
        for (const RemeshCorner<Real>& corner : c)
            addVertex(corner.position, corner.direction, corner.uv, corner.density, corner.height);
        if (plan_.isWhole != 0) {
            ++mesh_.counts.whole;
            addTriangle(0, 1, 2);
        } else {
            addEdges();
            addColumns();
            addStrips();
        }
        if (view_.options.bounds) addBound();
    }

    /// Adds a piece that is not swept.
    void keep(const RemeshPiece<Real>& piece, const RemeshFrame<Real>& frame) {
        RemeshPiece<Real> whole = piece;
        for (auto& corner : whole.corners) corner.grid = piece.corners[0].grid;
        sweep(whole, frame);
    }

private:
    /// A point of a column or edge: its number in the piece, and its side coordinate, in which strips are zipped.
    struct Point {
        uint32_t vertex;
        Real side;
    };

    uint32_t addVertex(Real3 position, Real3 direction, Real2 uv, Real density, Real height) {
        const Real3 normal = normalAt(position, direction, uv, density, height);
        mesh_.vertices.push_back({position + height * direction, normal, uv});
        heights_.push_back(height);
        return uint32_t(heights_.size() - 1);
    }

    Real3 normalAt(const Real3& position, const Real3& direction, Real2 uv, Real density, Real height) const {
        if (frame_->turned == 0) return frame_->flat;
        const HeightLevels& heights = *view_.surface.heights;
        // A map without coarser levels is that of an atlas: a wider look would go beyond the chart.
        const Real texels =
            heights.levels().size() == 1 ? Real(1) : std::max(view_.texelsAt(position, density), Real(1));
        const Real step = texels / Real(heights.levels().front().size.x);
        const Real2 u(Real(0.5) * step, 0), v(0, Real(0.5) * step);
        const Real byU = (heights.height(uv + u, texels) - heights.height(uv - u, texels)) / step,
                   byV = (heights.height(uv + v, texels) - heights.height(uv - v, texels)) / step;
        const Real3 n = frame_->turned * glm::cross(frame_->byU + byU * direction + height * frame_->directionByU,
                                                    frame_->byV + byV * direction + height * frame_->directionByV);
        const Real length = glm::length(n);
        return length > 0 ? n / length : frame_->flat;
    }

    void addTriangle(uint32_t a, uint32_t b, uint32_t c) {
        for (const uint32_t corner : {a, b, c}) mesh_.indices.push_back(firstVertex_ + corner);
    }

    void addEdges() {
        for (int k = 0; k < 3; ++k) {
            const RemeshCorner<Real>&a = piece_->corners[k], &b = piece_->corners[(k + 1) % 3];
            const auto edge = Math::remeshEdge(a.grid, b.grid);
            cells_[k] = edge.cells, axes_[k] = edge.axis;
            firstOnEdge_[k] = uint32_t(heights_.size());
            for (int i = 1; i < edge.cells; ++i) addOnEdge(k, i);
        }
        mesh_.counts.threeAxes += axes_[0] != axes_[1] && axes_[1] != axes_[2] && axes_[2] != axes_[0];
    }

    void addOnEdge(int k, int i) {
        const RemeshCorner<Real>&a = piece_->corners[k], &b = piece_->corners[(k + 1) % 3];
        const int n = cells_[k];
        const Real sum = Math::remeshBetween(a.weight, b.weight, i, n);
        const auto between = [&](Real x, Real y) {
            return Math::remeshBetween(x * a.weight, y * b.weight, i, n) / sum;
        };
        Real3 position, direction;
        for (int axis = 0; axis < 3; ++axis) {
            position[axis] = between(a.position[axis], b.position[axis]);
            direction[axis] = between(a.direction[axis], b.direction[axis]);
        }
        const auto placeOf = [&](const Real2& from, const Real2& to) {
            return Real2(between(from.x, to.x), between(from.y, to.y));
        };
        const Real2 uv = placeOf(a.uv, b.uv);
        const Real density = between(a.density, b.density);
        Real height = view_.heightAt(uv, position, direction, density);
        if (const RemeshSeam<Real>& seam = piece_->seams[k]; seam.is)
            height = std::max(height, view_.heightAt(placeOf(seam.uvs[0], seam.uvs[1]), position, direction, density));
        addVertex(position, direction, uv, density, height);
    }

    /// Returns the number of a point of the edge between two corners, counted from the first.
    [[nodiscard]] uint32_t onEdge(int from, int to, int i) const {
        const bool isAhead = (from + 1) % 3 == to;
        const int k = isAhead ? from : to, n = cells_[k];
        if (i == 0 || i == n) return uint32_t(i == 0 ? from : to);
        return firstOnEdge_[k] + uint32_t((isAhead ? i : n - i) - 1);
    }
    [[nodiscard]] int cellsBetween(int from, int to) const { return cells_[(from + 1) % 3 == to ? from : to]; }
    /// Returns (sweep, side) of a corner.
    [[nodiscard]] glm::ivec2 placeOf(int corner) const {
        const glm::ivec3 grid = piece_->corners[corner].grid;
        return {grid[plan_.sweep], plan_.sign * grid[plan_.side]};
    }
    [[nodiscard]] Point edgePoint(int from, int to, int i) const {
        const int n = cellsBetween(from, to);
        return {onEdge(from, to, i), Math::remeshBetween(Real(placeOf(from).y), Real(placeOf(to).y), i, n) / Real(n)};
    }

    struct Column {
        typename Math::RemeshColumn points;
        uint32_t first;
    };

    void addColumns() {
        const glm::ivec2 p = placeOf(plan_.first), q = placeOf(plan_.second), r = placeOf(plan_.apex);
        columns_.clear();
        for (int c = p.x; c <= q.x; ++c) {
            Column column{{}, uint32_t(heights_.size())};
            // The ends of the primary edge have no grid points above them.
            if (c > p.x && c < q.x) {
                const bool isLeft = r.x > p.x && c <= r.x;
                const glm::ivec2 a = isLeft ? p : r, b = isLeft ? r : q;
                column.points = Math::remeshColumn(p, q, a, b, c);
                const Real alongPrimary = Real(c - p.x) / Real(q.x - p.x), alongSide = Real(c - a.x) / Real(b.x - a.x);
                for (int i = 0; i < column.points.count; ++i) {
                    const Real up = (Real(column.points.from + i) - column.points.bottom) /
                                    (column.points.top - column.points.bottom);
                    Real weights[3] = {(1 - up) * (1 - alongPrimary), (1 - up) * alongPrimary,
                                       0};  // first, second, apex
                    weights[isLeft ? 0 : 2] += up * (1 - alongSide);
                    weights[isLeft ? 2 : 1] += up * alongSide;
                    addInside(weights);
                }
            }
            columns_.push_back(column);
        }
    }

    void addInside(const Real (&weights)[3]) {
        const RemeshCorner<Real>* corners[3] = {&piece_->corners[plan_.first], &piece_->corners[plan_.second],
                                                &piece_->corners[plan_.apex]};
        Real3 position(0), direction(0);
        Real2 uv(0);
        Real density = 0, sum = 0;
        for (int k = 0; k < 3; ++k) {
            const Real weight = weights[k] * corners[k]->weight;
            sum += weight;
            position += weight * corners[k]->position, direction += weight * corners[k]->direction;
            uv += weight * corners[k]->uv, density += weight * corners[k]->density;
        }
        position /= sum, direction /= sum, uv /= sum, density /= sum;
        addVertex(position, direction, uv, density, view_.heightAt(uv, position, direction, density));
    }

    void addStrips() {
        const int start = placeOf(plan_.first).x, end = placeOf(plan_.second).x, turn = placeOf(plan_.apex).x;
        for (int c = start; c < end; ++c) {
            // Where the apex is above an end of the primary edge, there is one side edge along the sweep.
            const bool isLeft = c < turn;
            const int from = isLeft ? plan_.first : plan_.apex, to = isLeft ? plan_.apex : plan_.second;
            const glm::ivec2 a = placeOf(from), b = placeOf(to);
            const int n = cellsBetween(from, to), last = Math::remeshNearestPart(a.x, b.x, n, c + 1);
            fillSide(left_, c), fillSide(right_, c + 1);
            int i = Math::remeshNearestPart(a.x, b.x, n, c);
            if (b.y >= a.y) {
                while (++i <= last) left_.push_back(edgePoint(from, to, i));
            } else {
                for (int k = last - 1; k >= i; --k) right_.push_back(edgePoint(from, to, k));
            }
            zip();
        }
    }

    /// Fills in a column from the primary edge up.
    void fillSide(std::vector<Point>& side, int c) const {
        const int first = plan_.first, second = plan_.second, apex = plan_.apex;
        const glm::ivec2 p = placeOf(first), q = placeOf(second), r = placeOf(apex);
        side.clear();
        const auto addEdge = [&](int from, int to) {
            for (int i = 0; i <= cellsBetween(from, to); ++i) side.push_back(edgePoint(from, to, i));
        };
        if (c == p.x && r.x == p.x) return addEdge(first, apex);
        if (c == q.x && r.x == q.x) return addEdge(second, apex);
        side.push_back(edgePoint(first, second, c - p.x));
        if (c == p.x || c == q.x) return;
        const Column& column = columns_[size_t(c - p.x)];
        for (int i = 0; i < column.points.count; ++i)
            side.push_back({column.first + uint32_t(i), Real(column.points.from + i)});
        const int from = c < r.x ? first : apex, to = c < r.x ? apex : second;
        const int n = cellsBetween(from, to);
        side.push_back(edgePoint(from, to, Math::remeshNearestPart(placeOf(from).x, placeOf(to).x, n, c)));
    }

    /// Adds the triangles between two sides that end in one point.
    void zip() {
        ++mesh_.counts.strips;
        size_t i = 0, j = 0;
        const size_t lefts = left_.size() - 1, rights = right_.size() - 1;
        const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
            if (plan_.isMirrored == 0)
                addTriangle(a, b, c);
            else
                addTriangle(a, c, b);
        };
        while (true) {
            const bool moreLeft = i + 1 < lefts, moreRight = j + 1 < rights;
            if (!moreLeft && !moreRight) break;
            const bool goesLeft = moreLeft && (!moreRight || left_[i + 1].side <= right_[j + 1].side);
            if (goesLeft) {
                add(left_[i].vertex, right_[j].vertex, left_[i + 1].vertex);
                ++i;
            } else {
                add(left_[i].vertex, right_[j].vertex, right_[j + 1].vertex);
                ++j;
            }
        }
        if (lefts > 0 && rights > 0) add(left_[i].vertex, right_[j].vertex, left_.back().vertex);
        mesh_.counts.quads += std::max(lefts, rights);
    }

    /// Takes the piece's triangles into the bound: over each the map ranges between two heights, and the mesh between
    /// those of its corners.
    void addBound() {
        for (size_t i = firstIndex_; i < mesh_.indices.size(); i += 3) {
            glm::dvec2 low(1e300), high(-1e300);
            double least = 1, most = 0, depth = 1e300, slope = 0;
            for (int k = 0; k < 3; ++k) {
                const RemeshVertex<Real>& v = mesh_.vertices[mesh_.indices[i + k]];
                low = glm::min(low, glm::dvec2(v.uv)), high = glm::max(high, glm::dvec2(v.uv));
                const double height = heights_[mesh_.indices[i + k] - firstVertex_];
                least = std::min(least, height), most = std::max(most, height);
                depth = std::min(depth, double(v.position.z));
                if (view_.grid.isParallel == 0u && v.position.z > 0)
                    slope = std::max(slope, std::hypot(double(v.position.x), double(v.position.y)) / v.position.z);
            }
            const HeightRange range = view_.surface.heights->range(low, high);
            const double off = view_.surface.longest * std::max(most - std::min(least, double(range.least)),
                                                                std::max(most, double(range.most)) - least);
            const double pixels = double(view_.grid.focal) * view_.options.cell * off;
            double bound = pixels;
            if (view_.grid.isParallel == 0u) bound = depth > off ? pixels * (1 + slope) / (depth - off) : 1e300;
            mesh_.counts.boundPixels = std::max(mesh_.counts.boundPixels, bound);
        }
    }

    const RemeshFrameView<Real>& view_;
    RemeshMesh<Real>& mesh_;
    const RemeshPiece<Real>* piece_ = nullptr;
    const RemeshFrame<Real>* frame_ = nullptr;
    typename Math::RemeshPlan plan_{};
    uint32_t firstVertex_ = 0;
    size_t firstIndex_ = 0;
    int cells_[3] = {}, axes_[3] = {};
    uint32_t firstOnEdge_[3] = {};
    std::vector<Real> heights_;  // of the piece's vertices
    std::vector<Column> columns_;
    std::vector<Point> left_, right_;
};

}  // namespace vcp::meso
