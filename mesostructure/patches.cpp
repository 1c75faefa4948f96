#include "mesostructure/patches.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace vcp::meso {

namespace {

using glm::dvec3, glm::ivec3;

/// An edge of a cell: along an axis, from one of its corners.
struct CellEdge {
    int axis;
    ivec3 from;
};

/// Four corners in order around a face, and the cell's edges between them; both (u, v) = (0,0), (1,0), (1,1), (0,1).
struct CellFace {
    std::array<ivec3, 4> corners;
    std::array<int, 4> edges;
};

/// Returns the number of the edge along `axis` with the given place along the other two axes, in ascending order.
int edgeNumber(int axis, int low, int high) { return axis * 4 + low + 2 * high; }

CellEdge edgeOf(int number) {
    CellEdge edge{number / 4, ivec3(0)};
    edge.from[edge.axis == 0 ? 1 : 0] = number & 1;
    edge.from[edge.axis == 2 ? 1 : 2] = number >> 1 & 1;
    return edge;
}

std::array<CellFace, 6> makeFaces() {
    std::array<CellFace, 6> faces;
    for (int axis = 0; axis < 3; ++axis) {
        const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
        for (int side = 0; side < 2; ++side) {
            CellFace& face = faces[axis * 2 + side];
            const int us[4] = {0, 1, 1, 0}, vs[4] = {0, 0, 1, 1};
            for (int i = 0; i < 4; ++i) {
                face.corners[i] = ivec3(0);
                face.corners[i][axis] = side, face.corners[i][u] = us[i], face.corners[i][v] = vs[i];
                const bool alongU = i % 2 == 0;
                const int along = alongU ? u : v, other = alongU ? v : u, place = alongU ? (i == 2) : (i == 1);
                // The edge's other two axes are `axis` and `other`, in ascending order.
                face.edges[i] = axis < other ? edgeNumber(along, side, place) : edgeNumber(along, place, side);
            }
        }
    }
    return faces;
}
const std::array<CellFace, 6> kFaces = makeFaces();

void normalise(std::array<double, 10>& q, float* to) {
    double most = 0;
    for (const double c : q) most = std::max(most, std::abs(c));
    for (int i = 0; i < 10; ++i) to[i] = float(q[i] / most);
}

/// Appends patches through points of a loop, which it names by their numbers.
struct LoopPatches {
    std::span<const dvec3> loop;
    std::vector<Patch>& patches;
    std::vector<PatchCorners>& corners;

    void triangle(int first, int second, int third) {
        const dvec3 a = loop[first], ab = loop[second] - a, ac = loop[third] - a, normal = glm::cross(ab, ac);
        const double size = glm::dot(normal, normal);
        if (!(size > 1e-18)) return;
        Patch patch{};
        patch.isTriangle = 1;
        std::array<double, 10> q{};
        q[6] = normal.x, q[7] = normal.y, q[8] = normal.z, q[9] = -glm::dot(normal, a);
        normalise(q, patch.quadric);
        const dvec3 u = glm::cross(ac, normal) / size, v = glm::cross(normal, ab) / size;
        patch.u = glm::dvec4(u, -glm::dot(u, a));
        patch.v = glm::dvec4(v, -glm::dot(v, a));
        patches.push_back(patch), corners.push_back({first, second, -1, third});
    }

    /// Appendix B: with Y = X - P1 = uv a + u b + v c, the triple product solves for u, v and uv, and uv = u * v is the
    /// quadric. Where a lies in the plane of b and c the triple product is 0: two triangles are the patch there.
    void bilinear(PatchCorners at) {
        const dvec3 p1 = loop[at[0]], p2 = loop[at[1]], p3 = loop[at[2]], p4 = loop[at[3]];
        const dvec3 a = p1 + p3 - p2 - p4, b = p2 - p1, c = p4 - p1;
        const dvec3 bc = glm::cross(b, c), ca = glm::cross(c, a), ab = glm::cross(a, b);
        const double det = glm::dot(a, bc);
        if (glm::length(a) < 1e-4 || std::abs(det) < 1e-3 * glm::length(a) * glm::length(bc) ||
            glm::length(bc) < 1e-6) {
            triangle(at[0], at[1], at[2]);
            triangle(at[0], at[2], at[3]);
            return;
        }
        const dvec3 u = ca / det, v = ab / det, w = bc / det;
        const double u0 = -glm::dot(u, p1), v0 = -glm::dot(v, p1), w0 = -glm::dot(w, p1);
        Patch patch{};
        // w - u v = 0
        std::array<double, 10> q{-u.x * v.x,
                                 -u.y * v.y,
                                 -u.z * v.z,
                                 -(u.x * v.y + u.y * v.x),
                                 -(u.y * v.z + u.z * v.y),
                                 -(u.z * v.x + u.x * v.z),
                                 w.x - u.x * v0 - u0 * v.x,
                                 w.y - u.y * v0 - u0 * v.y,
                                 w.z - u.z * v0 - u0 * v.z,
                                 w0 - u0 * v0};
        normalise(q, patch.quadric);
        patch.u = glm::dvec4(u, u0);
        patch.v = glm::dvec4(v, v0);
        patches.push_back(patch), corners.push_back(at);
    }
};

/// The points on the grid's edges; an edge runs along `axis` from a grid point.
class EdgePoints {
public:
    explicit EdgePoints(const TileGrid& grid)
        : points_({grid.cells.x, grid.cells.y, grid.cells.z + 1}, glm::dvec3(1)),
          sums_(3 * points_.count()),
          normals_(3 * points_.count()),
          counts_(3 * points_.count()) {}
    /// `normal` is a unit vector of either sign.
    void add(CellEdge edge, ivec3 cell, double place, dvec3 normal) {
        const size_t at = slot(edge, cell);
        sums_[at] += place;
        normals_[at] += glm::dot(normals_[at], normal) < 0 ? -normal : normal;
        ++counts_[at];
    }
    [[nodiscard]] bool has(CellEdge edge, ivec3 cell) const { return counts_[slot(edge, cell)] != 0; }
    /// Returns the mean of the points that were added, in the cell's coordinates.
    [[nodiscard]] dvec3 point(CellEdge edge, ivec3 cell) const {
        const size_t at = slot(edge, cell);
        dvec3 p(edge.from);
        p[edge.axis] = sums_[at] / counts_[at];
        return p;
    }
    /// Returns the mean of the normals that were added, of either sign: shorter, the less they agree.
    [[nodiscard]] dvec3 normal(CellEdge edge, ivec3 cell) const {
        const size_t at = slot(edge, cell);
        return normals_[at] / double(counts_[at]);
    }

private:
    size_t slot(CellEdge edge, ivec3 cell) const {
        return size_t(edge.axis) * points_.count() + points_.index(cell + edge.from);
    }
    TileGrid points_;
    std::vector<double> sums_;
    std::vector<dvec3> normals_;
    std::vector<uint16_t> counts_;
};

/// Builds cell by cell; the values at corners are computed once.
class PatchBuilder {
public:
    PatchBuilder(const Shape& shape, const Occupancy& occupancy)
        : shape_(shape), occupancy_(occupancy), grid_(occupancy.grid), edges_(grid_) {}

    void findDirect() {
        values_.resize(size_t(grid_.cells.x) * size_t(grid_.cells.y) * size_t(grid_.cells.z + 1),
                       std::numeric_limits<double>::quiet_NaN());
        eachCell([&](ivec3 cell) {
            for (int number = 0; number < 12; ++number) {
                const CellEdge edge = edgeOf(number);
                ivec3 to = edge.from;
                to[edge.axis] = 1;
                const double a = value(cell + edge.from), b = value(cell + to);
                if ((a > 0) == (b > 0) || edges_.has(edge, cell)) continue;
                dvec3 p(edge.from);
                p[edge.axis] = crossing(cell, edge, a > 0);
                edges_.add(edge, cell, p[edge.axis], shape_.normal(position(cell, p), 1e-3 * grid_.cell));
            }
        });
    }

    void findFitted() {
        eachCell([&](ivec3 cell) {
            const std::vector<dvec3> samples = samplesAround(cell);
            if (samples.size() < 6) return;
            const std::array<double, 10> q = fitQuadric(samples);
            for (int number = 0; number < 12; ++number) addFitted(q, edgeOf(number), cell);
        });
    }

    Result<PatchSet> assemble(CrossingRule rule) {
        PatchSet set{grid_, std::vector<PatchSet::Rank>((grid_.count() + 31) / 32), {}, {}, {}};
        for (size_t i = 0; i < grid_.count(); ++i) {
            PatchSet::Rank& rank = set.ranks[i / 32];
            if (i % 32 == 0) rank.base = uint32_t(set.rows.size());
            if (occupancy_.cells[i] == 0) continue;
            const size_t first = set.patches.size();
            if (rule == CrossingRule::Direct)
                appendLoops(grid_.at(i), set);
            else
                appendOrdered(grid_.at(i), set);
            const size_t count = std::min<size_t>(set.patches.size() - first, PatchSet::kMostInCell);
            set.patches.resize(first + count), set.normals.resize(first + count);
            if (set.patches.size() >= size_t{1} << 28)
                return Error{.code = ErrorCode::Limit, .message = "more than 2^28 patches; take a coarser grid"};
            if (count == 0) {
                ++set.cellsWithout;
                continue;
            }
            rank.mask |= 1u << (i % 32);
            set.rows.push_back(uint32_t(first << 4 | count));
        }
        return set;
    }

private:
    template <class Use>
    void eachCell(const Use& use) {
        for (size_t i = 0; i < grid_.count(); ++i)
            if (occupancy_.cells[i] != 0) use(grid_.at(i));
    }
    dvec3 position(ivec3 cell, dvec3 local) const { return (dvec3(cell) + local) * grid_.cell; }
    double value(ivec3 point) {
        const size_t at =
            size_t(wrapped(point.x, grid_.cells.x)) +
            size_t(grid_.cells.x) * (size_t(wrapped(point.y, grid_.cells.y)) + size_t(grid_.cells.y) * size_t(point.z));
        if (std::isnan(values_[at])) values_[at] = shape_.field(dvec3(point) * grid_.cell);
        return values_[at];
    }
    double crossing(ivec3 cell, CellEdge edge, bool isFirstOutside) const {
        double low = 0, high = 1;
        for (int i = 0; i < 40; ++i) {
            dvec3 p(edge.from);
            p[edge.axis] = 0.5 * (low + high);
            ((shape_.field(position(cell, p)) > 0) == isFirstOutside ? low : high) = p[edge.axis];
        }
        return 0.5 * (low + high);
    }

    /// Returns points of the surface in the cell and half a cell around it: a lattice moved along the gradient.
    std::vector<dvec3> samplesAround(ivec3 cell) const {
        constexpr int n = 6;
        std::vector<dvec3> samples;
        for (int i = 0; i < n * n * n; ++i) {
            dvec3 p = dvec3(i % n, i / n % n, i / n / n) * (2.0 / (n - 1)) - 0.5;
            double size = 0;
            for (int step = 0; step < 4; ++step) {
                const double f = shape_.field(position(cell, p)), e = 1e-4;
                const dvec3 g = dvec3(shape_.field(position(cell, p + dvec3(e, 0, 0))) - f,
                                      shape_.field(position(cell, p + dvec3(0, e, 0))) - f,
                                      shape_.field(position(cell, p + dvec3(0, 0, e))) - f) /
                                e;
                size = glm::dot(g, g);
                if (size > 0) p -= f * g / size;
            }
            const dvec3 off = glm::abs(p - 0.5);
            if (size > 0 && std::max({off.x, off.y, off.z}) <= 1 &&
                std::abs(shape_.field(position(cell, p))) < 0.02 * grid_.cell.x)
                samples.push_back(p);
        }
        return samples;
    }

    void addFitted(const std::array<double, 10>& q, CellEdge edge, ivec3 cell) {
        const auto at = [&](double s) {
            dvec3 p(edge.from);
            p[edge.axis] = s;
            return q[0] * p.x * p.x + q[1] * p.y * p.y + q[2] * p.z * p.z + q[3] * p.x * p.y + q[4] * p.y * p.z +
                   q[5] * p.z * p.x + q[6] * p.x + q[7] * p.y + q[8] * p.z + q[9];
        };
        // The function along the edge is taken as a quadratic through three values.
        const double f0 = at(0), fh = at(0.5), f1 = at(1), a = 2 * (f1 - 2 * fh + f0), b = f1 - f0 - a,
                     disc = b * b - 4 * a * f0;
        if (disc < 0) return;
        const double r = -0.5 * (b + (b >= 0 ? std::sqrt(disc) : -std::sqrt(disc)));
        const double roots[2] = {a != 0 ? r / a : -1, r != 0 ? f0 / r : -1};
        for (const double s : roots) {
            if (!(s >= 0 && s <= 1)) continue;
            dvec3 p(edge.from);
            p[edge.axis] = s;
            const dvec3 gradient(2 * q[0] * p.x + q[3] * p.y + q[5] * p.z + q[6],
                                 2 * q[1] * p.y + q[3] * p.x + q[4] * p.z + q[7],
                                 2 * q[2] * p.z + q[4] * p.y + q[5] * p.x + q[8]);
            const dvec3 normal = gradient / grid_.cell;
            const double size = glm::length(normal);
            return edges_.add(edge, cell, s, size > 0 ? normal / size : dvec3(0));
        }
    }

    /// Appends the loops over the faces; each point has one line on either of its edge's faces.
    void appendLoops(ivec3 cell, PatchSet& set) {
        std::array<std::array<int, 2>, 12> next;
        std::array<int, 12> lines{};
        const auto join = [&](int a, int b) { next[a][lines[a]++] = b, next[b][lines[b]++] = a; };
        for (const CellFace& face : kFaces) {
            std::array<double, 4> f;
            for (int i = 0; i < 4; ++i) f[i] = value(cell + face.corners[i]);
            int crossed[4], count = 0;
            for (int i = 0; i < 4; ++i)
                if ((f[i] > 0) != (f[(i + 1) % 4] > 0)) crossed[count++] = face.edges[i];
            if (count == 2) join(crossed[0], crossed[1]);
            if (count < 4) continue;
            // The side of the saddle point is that of corners 0 and 2, or of 1 and 3.
            const double sum = f[0] + f[2] - f[1] - f[3], saddle = (f[0] * f[2] - f[1] * f[3]) / sum;
            const bool joins02 = (saddle > 0) == (f[0] > 0);
            join(face.edges[0], face.edges[joins02 ? 1 : 3]);
            join(face.edges[2], face.edges[joins02 ? 3 : 1]);
        }
        std::array<bool, 12> done{};
        for (int start = 0; start < 12; ++start) {
            if (lines[start] != 2 || done[start]) continue;
            std::vector<int> loop;
            for (int at = start, before = -1; !done[at];) {
                done[at] = true;
                loop.push_back(at);
                const int to = next[at][0] != before ? next[at][0] : next[at][1];
                before = at, at = to;
            }
            appendLoop(cell, loop, set);
        }
    }

    void appendOrdered(ivec3 cell, PatchSet& set) const {
        std::vector<int> loop;
        dvec3 centre(0);
        for (int number = 0; number < 12; ++number) {
            if (!edges_.has(edgeOf(number), cell)) continue;
            loop.push_back(number);
            centre += edges_.point(edgeOf(number), cell);
        }
        if (loop.size() < 3) return;
        centre /= double(loop.size());
        const dvec3 local = position(cell, centre);
        const double e = 1e-3 * grid_.cell.x, f = shape_.field(local);
        dvec3 normal = dvec3(shape_.field(local + dvec3(e, 0, 0)) - f, shape_.field(local + dvec3(0, e, 0)) - f,
                             shape_.field(local + dvec3(0, 0, e)) - f) *
                       grid_.cell;
        if (!(glm::length(normal) > 0)) normal = {0, 0, 1};
        normal = glm::normalize(normal);
        const dvec3 x = glm::normalize(glm::cross(normal, std::abs(normal.x) < 0.7 ? dvec3(1, 0, 0) : dvec3(0, 1, 0))),
                    y = glm::cross(normal, x);
        std::ranges::sort(loop, {}, [&](int number) {
            const dvec3 p = edges_.point(edgeOf(number), cell) - centre;
            return std::atan2(glm::dot(p, y), glm::dot(p, x));
        });
        appendLoop(cell, loop, set);
    }

    /// Appends the patches through points on edges of a cell, and their normals.
    void appendLoop(ivec3 cell, std::span<const int> edges, PatchSet& set) const {
        std::vector<dvec3> points;
        for (const int number : edges) points.push_back(edges_.point(edgeOf(number), cell));
        const size_t first = set.patches.size();
        std::vector<PatchCorners> corners;
        appendPatches(points, set.patches, corners);
        for (size_t i = 0; i < corners.size(); ++i) {
            PatchNormals normals{};
            for (size_t k = 0; k < 4; ++k) {
                const int at = corners[i][k];
                if (at < 0) continue;
                normals[k] = packNormal(cornerNormal(set.patches[first + i], points[size_t(at)],
                                                     edges_.normal(edgeOf(edges[size_t(at)]), cell)));
            }
            set.normals.push_back(normals);
        }
    }
    /// Returns a point's normal on the side of a patch's gradient there, or where they part too far, that gradient.
    [[nodiscard]] dvec3 cornerNormal(const Patch& patch, dvec3 point, dvec3 normal) const {
        const double kSharp = 0.866;  // cos(30 degrees)
        const dvec3 own = dvec3(patchGradient(patch, glm::vec3(point))) / grid_.cell;
        const double along = glm::dot(own, normal);
        return std::abs(along) > kSharp * glm::length(own) ? (along < 0 ? -normal : normal) : own;
    }

    const Shape& shape_;
    const Occupancy& occupancy_;
    const TileGrid& grid_;
    EdgePoints edges_;
    std::vector<double> values_;
};

}  // namespace

std::span<const Patch> PatchSet::of(size_t cell) const {
    const Rank& rank = ranks[cell / 32];
    const uint32_t bit = 1u << (cell % 32);
    if ((rank.mask & bit) == 0) return {};
    const uint32_t row = rows[rank.base + uint32_t(std::popcount(rank.mask & (bit - 1)))];
    return {patches.data() + (row >> 4), row & 15};
}

void appendPatches(std::span<const glm::dvec3> loop, std::vector<Patch>& patches, std::vector<PatchCorners>& corners) {
    LoopPatches made{loop, patches, corners};
    const int n = int(loop.size());
    int i = 1;
    for (; i + 2 < n; i += 2) made.bilinear({0, i, i + 1, i + 2});
    if (i + 1 < n) made.triangle(0, i, i + 1);
}

uint32_t packNormal(glm::dvec3 direction) {
    const double size = std::abs(direction.x) + std::abs(direction.y) + std::abs(direction.z);
    if (!(size > 0)) return 0;
    const dvec3 on = direction / size;
    // The lower half is folded over the edges of the upper one.
    const glm::dvec2 folded = on.z >= 0 ? glm::dvec2(on.x, on.y)
                                        : glm::dvec2((1 - std::abs(on.y)) * (on.x >= 0 ? 1 : -1),
                                                     (1 - std::abs(on.x)) * (on.y >= 0 ? 1 : -1));
    const auto bits = [](double value) { return uint32_t(int(std::lround(32767 * value))) & 0xffff; };
    return bits(folded.x) | bits(folded.y) << 16;
}

Result<PatchSet> buildPatches(const Shape& shape, const Occupancy& occupancy, CrossingRule rule) {
    PatchBuilder builder(shape, occupancy);
    // In the paper's way, corner values decide nothing.
    if (rule == CrossingRule::Direct)
        builder.findDirect();
    else
        builder.findFitted();
    return builder.assemble(rule);
}

}  // namespace vcp::meso
