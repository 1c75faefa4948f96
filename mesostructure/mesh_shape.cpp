// A closed, repeated mesh as a shape: triangles in lists of a grid of cells, distances by growing rings, sides by the
// winding along the vertical line.
#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mesostructure/shape.h"

namespace vcp::meso {

namespace {

using glm::dvec2, glm::dvec3, glm::ivec3;

/// Ericson 2004, 5.1.5: the closest point by the Voronoi regions of corners and edges.
double distanceTo(const TileTriangle& tri, dvec3 p) {
    const dvec3 ab = tri[1] - tri[0], ac = tri[2] - tri[0], ap = p - tri[0];
    const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
    if (d1 <= 0 && d2 <= 0) return glm::length(ap);
    const dvec3 bp = p - tri[1];
    const double d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
    if (d3 >= 0 && d4 <= d3) return glm::length(bp);
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return glm::length(ap - ab * (d1 / (d1 - d3)));
    const dvec3 cp = p - tri[2];
    const double d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
    if (d6 >= 0 && d5 <= d6) return glm::length(cp);
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return glm::length(ap - ac * (d2 / (d2 - d6)));
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
        return glm::length(bp - (tri[2] - tri[1]) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))));
    const double sum = va + vb + vc;
    return glm::length(ap - ab * (vb / sum) - ac * (vc / sum));
}

/// Whether a triangle and a closed box overlap, by separating axes (Akenine-Moller 2001); touching counts.
bool overlaps(const TileTriangle& tri, dvec3 centre, dvec3 half) {
    const dvec3 v[3] = {tri[0] - centre, tri[1] - centre, tri[2] - centre};
    const auto apart = [&](dvec3 axis) {
        const double a = glm::dot(axis, v[0]), b = glm::dot(axis, v[1]), c = glm::dot(axis, v[2]),
                     reach = glm::dot(glm::abs(axis), half) * (1 + 1e-12);
        return std::min({a, b, c}) > reach || std::max({a, b, c}) < -reach;
    };
    for (int axis = 0; axis < 3; ++axis) {
        dvec3 unit(0);
        unit[axis] = 1;
        if (apart(unit)) return false;
        for (int edge = 0; edge < 3; ++edge)
            if (apart(glm::cross(unit, v[(edge + 1) % 3] - v[edge]))) return false;
    }
    return !apart(glm::cross(v[1] - v[0], v[2] - v[0]));
}

/// Returns twice the signed area of (a, b, p), the same but for its sign from either side of the edge.
double edgeSide(dvec2 a, dvec2 b, dvec2 p) {
    const bool swap = b.x < a.x || (b.x == a.x && b.y < a.y);
    if (swap) std::swap(a, b);
    const double side = (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
    // A point on an edge counts as on one side of it, the same for both triangles.
    const double decided = side != 0 ? side : 1e-300;
    return swap ? -decided : decided;
}

class MeshShape final : public Shape {
public:
    MeshShape(const std::vector<TileTriangle>& triangles, dvec3 extent) : Shape(extent), triangles_(triangles) {
        const double target = std::sqrt(std::max(1.0, double(triangles.size())) / 2);
        const int n = std::clamp(int(target / 2), 8, 128);
        grid_ = TileGrid(
            {n, std::clamp(int(std::lround(n * extent.y)), 1, 512), std::clamp(int(std::lround(n * extent.z)), 1, 128)},
            extent);
        fillLists();
    }

    double field(dvec3 p) const override {
        const double size = distance(p, 4 * std::max({grid_.cell.x, grid_.cell.y, grid_.cell.z}));
        return windingAt(p) != 0 ? -size : size;
    }

    double distance(dvec3 p, double cap) const override {
        const ivec3 home = cellOf(p);
        const double edge = std::min({grid_.cell.x, grid_.cell.y, grid_.cell.z});
        double best = cap;
        for (int ring = 0; (ring - 1) * edge < best; ++ring) {
            if (ring > 2 * std::max({grid_.cells.x, grid_.cells.y, grid_.cells.z})) break;
            for (int k = -ring; k <= ring; ++k)
                for (int j = -ring; j <= ring; ++j)
                    for (int i = -ring; i <= ring;
                         i += std::abs(k) == ring || std::abs(j) == ring ? 1 : std::max(1, 2 * ring)) {
                        const ivec3 at = home + ivec3(i, j, k);
                        if (at.z < 0 || at.z >= grid_.cells.z) continue;
                        eachIn(at, [&](const TileTriangle& tri, dvec3 shift) {
                            best = std::min(best, distanceTo(tri, p - shift));
                        });
                    }
        }
        return best;
    }

    bool mayTouch(dvec3 lower, dvec3 upper) const override {
        const ivec3 first = cellOf(lower), last = cellOf(upper);
        const dvec3 half = 0.5 * (upper - lower);
        for (int k = std::max(first.z, 0); k <= std::min(last.z, grid_.cells.z - 1); ++k)
            for (int j = first.y; j <= last.y; ++j)
                for (int i = first.x; i <= last.x; ++i) {
                    bool touches = false;
                    eachIn({i, j, k}, [&](const TileTriangle& tri, dvec3 shift) {
                        touches = touches || overlaps(tri, lower + half - shift, half);
                    });
                    if (touches) return true;
                }
        return false;
    }

    TruthHit trace(dvec3 origin, dvec3 direction, double tMax) const override {
        ivec3 cell = cellOf(origin);
        TruthHit best;
        for (double t = 0; t <= tMax;) {
            if (cell.z < 0 ? direction.z <= 0 : cell.z >= grid_.cells.z && direction.z >= 0) break;
            if (cell.z >= 0 && cell.z < grid_.cells.z)
                eachIn(cell, [&](const TileTriangle& tri, dvec3 shift) {
                    meet(tri, origin - shift, direction, best.hit ? best.t : tMax, best);
                });
            int axis = 0;
            double exit = std::numeric_limits<double>::infinity();
            for (int a = 0; a < 3; ++a) {
                if (direction[a] == 0) continue;
                const double wall = ((cell[a] + (direction[a] > 0 ? 1 : 0)) * grid_.cell[a] - origin[a]) / direction[a];
                if (wall < exit) exit = wall, axis = a;
            }
            if (best.hit && best.t <= exit) return best;
            if (!std::isfinite(exit)) break;
            t = std::max(t, exit);
            cell[axis] += direction[axis] > 0 ? 1 : -1;
        }
        return best;
    }

    /// Returns how often the vertical line through a point enters less how often it leaves, below the point.
    int windingAt(dvec3 p, bool upToTop = false) const {
        int winding = 0;
        const ivec3 cell = cellOf(p);
        const int column = wrapped(cell.x, grid_.cells.x) + grid_.cells.x * wrapped(cell.y, grid_.cells.y);
        for (size_t i = columns_[column]; i < columns_[column + 1]; ++i) {
            const TileTriangle& tri = triangles_[columnItems_[i].triangle];
            const dvec3 q = p - shiftOf(columnItems_[i], cell);
            const dvec2 a(tri[0]), b(tri[1]), c(tri[2]), at(q);
            const double ab = edgeSide(a, b, at), bc = edgeSide(b, c, at), ca = edgeSide(c, a, at);
            if ((ab > 0) != (bc > 0) || (bc > 0) != (ca > 0)) continue;
            const double sum = ab + bc + ca;
            const double z = std::abs(sum) > 1e-290 ? (bc * tri[0].z + ca * tri[1].z + ab * tri[2].z) / sum : tri[0].z;
            if (upToTop || z < q.z) winding += ab > 0 ? -1 : 1;
        }
        return winding;
    }

private:
    struct Item {
        uint32_t triangle;
        int16_t tileX, tileY;  ///< the tile, counted from the triangle's, in which the cell is
    };

    ivec3 cellOf(dvec3 p) const { return ivec3(glm::floor(p / grid_.cell)); }
    /// Returns what moves an item's triangle to a cell in any tile.
    dvec3 shiftOf(const Item& item, ivec3 cell) const {
        const int tx = int(std::floor(double(cell.x) / grid_.cells.x)),
                  ty = int(std::floor(double(cell.y) / grid_.cells.y));
        return {tx - item.tileX, (ty - item.tileY) * extent().y, 0};
    }
    template <class Use>
    void eachIn(ivec3 cell, const Use& use) const {
        const size_t index = grid_.index(cell);
        for (size_t i = lists_[index]; i < lists_[index + 1]; ++i)
            use(triangles_[items_[i].triangle], shiftOf(items_[i], cell));
    }

    static void meet(const TileTriangle& tri, dvec3 o, dvec3 d, double tMax, TruthHit& best) {
        // Moller and Trumbore 1997; only entries count (from the side of the normal).
        const dvec3 e1 = tri[1] - tri[0], e2 = tri[2] - tri[0], p = glm::cross(d, e2);
        const double det = glm::dot(e1, p);
        if (!(det > 0)) return;
        const dvec3 s = o - tri[0], q = glm::cross(s, e1);
        const double u = glm::dot(s, p), v = glm::dot(d, q), slack = 1e-12 * det;
        if (u < -slack || v < -slack || u + v > det + slack) return;
        const double t = glm::dot(e2, q) / det;
        if (t < 0 || t > tMax) return;
        best = {true, true, t, glm::normalize(glm::cross(e1, e2))};
    }

    /// Fills the lists by counting twice: sizes, then places.
    void fillLists() {
        lists_.assign(grid_.count() + 1, 0);
        columns_.assign(size_t(grid_.cells.x) * size_t(grid_.cells.y) + 1, 0);
        for (const bool place : {false, true}) {
            std::vector<size_t> next(lists_), nextColumn(columns_);
            if (place) items_.resize(lists_.back()), columnItems_.resize(columns_.back());
            for (uint32_t n = 0; n < triangles_.size(); ++n) fill(n, place, next, nextColumn);
            if (place) break;
            for (size_t i = 1; i < lists_.size(); ++i) lists_[i] += lists_[i - 1];
            for (size_t i = 1; i < columns_.size(); ++i) columns_[i] += columns_[i - 1];
        }
    }
    void fill(uint32_t n, bool place, std::vector<size_t>& next, std::vector<size_t>& nextColumn) {
        const TileTriangle& tri = triangles_[n];
        const dvec3 low = glm::min(tri[0], glm::min(tri[1], tri[2])), high = glm::max(tri[0], glm::max(tri[1], tri[2])),
                    slack = grid_.cell * 1e-6;
        const ivec3 first = cellOf(low - slack), last = cellOf(high + slack);
        for (int j = first.y; j <= last.y; ++j)
            for (int i = first.x; i <= last.x; ++i) {
                const Item item{n, int16_t(std::floor(double(i) / grid_.cells.x)),
                                int16_t(std::floor(double(j) / grid_.cells.y))};
                const size_t column =
                    size_t(wrapped(i, grid_.cells.x)) + size_t(grid_.cells.x) * size_t(wrapped(j, grid_.cells.y));
                if (place)
                    columnItems_[nextColumn[column]++] = item;
                else
                    ++columns_[column + 1];
                for (int k = std::clamp(first.z, 0, grid_.cells.z - 1); k <= std::clamp(last.z, 0, grid_.cells.z - 1);
                     ++k) {
                    const dvec3 lower = grid_.lower({i, j, k});
                    if (!overlaps(tri, lower + 0.5 * grid_.cell, 0.5 * grid_.cell + slack)) continue;
                    const size_t index = grid_.index({i, j, k});
                    if (place)
                        items_[next[index]++] = item;
                    else
                        ++lists_[index + 1];
                }
            }
    }

    const std::vector<TileTriangle>& triangles_;
    TileGrid grid_;
    std::vector<size_t> lists_, columns_;
    std::vector<Item> items_, columnItems_;
};

/// Returns how often a horizontal line along x (or y) enters less how often it leaves in one period: each triangle
/// counts once for every tile across in which the line meets it.
int crossingsAlong(int axis, const std::vector<TileTriangle>& triangles, double across, double z, double period) {
    const int other = 1 - axis;
    int sum = 0;
    for (const TileTriangle& tri : triangles) {
        if (std::min({tri[0].z, tri[1].z, tri[2].z}) > z || std::max({tri[0].z, tri[1].z, tri[2].z}) < z) continue;
        const double low = std::min({tri[0][other], tri[1][other], tri[2][other]}),
                     high = std::max({tri[0][other], tri[1][other], tri[2][other]});
        for (double shift = std::ceil((across - high) / period) * period; shift <= across - low; shift += period) {
            const dvec2 at(across - shift, z), a(tri[0][other], tri[0].z), b(tri[1][other], tri[1].z),
                c(tri[2][other], tri[2].z);
            const bool ab = edgeSide(a, b, at) > 0, bc = edgeSide(b, c, at) > 0, ca = edgeSide(c, a, at) > 0;
            if (ab == bc && bc == ca) sum += ab ? 1 : -1;
        }
    }
    return sum;
}

}  // namespace

Result<std::unique_ptr<Shape>> meshShape(const std::vector<TileTriangle>& triangles, dvec3 extent) {
    if (triangles.empty()) return Error{.message = "the mesh has no triangle"};
    for (size_t i = 0; i < triangles.size(); ++i)
        for (const dvec3& corner : triangles[i]) {
            if (!std::isfinite(corner.x + corner.y + corner.z) || corner.z < 0 || corner.z > extent.z ||
                std::abs(corner.x) > 64 || std::abs(corner.y) > 64)
                return Error{.message = "a corner lies outside the slab or far outside the tile",
                             .element = fmt::format("triangle {}", i)};
        }
    auto shape = std::make_unique<MeshShape>(triangles, extent);
    // Lines enter as often as they leave where the mesh is closed. The lines lie at odd places, off the mesh's
    // symmetries.
    constexpr int kLines = 61;
    int open = 0, inverted = 0;
    for (int j = 0; j < kLines; ++j)
        for (int i = 0; i < kLines; ++i) {
            const dvec3 p((i + 0.4142) / kLines, (j + 0.7321) / kLines * extent.y, 0.5 * extent.z);
            open += shape->windingAt(p, true) != 0;
            const int winding = shape->windingAt(p);
            inverted += (winding < 0) - (winding > 0);
        }
    for (int axis = 0; axis < 2; ++axis)
        for (int i = 0; i < kLines; ++i) {
            const double period = axis == 0 ? extent.y : 1.0;
            open += crossingsAlong(axis, triangles, (i + 0.4142) / kLines * period,
                                   std::fmod((i + 0.7321) * 0.6180339887, 1.0) * extent.z, period) != 0;
        }
    if (open > 0)
        return Error{.message = fmt::format("the repeated mesh is not closed: {} of {} lines through it leave it more "
                                            "or less often than they enter it; it must enclose "
                                            "solids and, where it crosses the tile's border, go on on the other side",
                                            open, kLines * (kLines + 2))};
    if (inverted > 0) return Error{.message = "the mesh's normals point inwards; reverse its faces"};
    return std::unique_ptr<Shape>(std::move(shape));
}

}  // namespace vcp::meso
