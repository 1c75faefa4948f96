#include "builder/level/triangle_cover.h"

#include <algorithm>
#include <cmath>

#include "builder/lattice/wider_clones.h"

namespace vcp {

namespace {

// A part thinner than this is not cut off: it counts with the part that it is attached to.
constexpr double kThin = 1e-9;

// Sine of a triangle's smallest angle below which a point kThin outside its prism may be far from the triangle.
constexpr double kNeedle = 5e-3;

// Added to every bound: for the thin parts (three cuts, at a corner of kNeedle) and for rounding, in cells.
constexpr double kSlack = 1e-6;

// A part counts as inside where it is outside by at most this many cells, and by this part of its distance.
constexpr double kMostBeside = 0.06;
constexpr double kBeside = 0.5;

// How often a leftover is halved to measure it against different triangles, and down to which length.
constexpr int kHalvings = 2;
constexpr double kShortest = 0.06;

}  // namespace

/// A convex polygon: a triangle cut by planes, with room for one corner more per cut.
struct TriangleCover::Polygon {
    static constexpr int kMost = 24;
    int count = 0;
    std::array<glm::dvec3, kMost> p;

    void add(glm::dvec3 q) { p[count++] = q; }
};

/// The heights of a polygon's corners over a prism's planes, with the least and the largest over each plane.
struct TriangleCover::PolygonHeights {
    TrianglePrism::Heights of[Polygon::kMost], low, high;

    void measure(const TrianglePrism& prism, const Polygon& polygon) {
        prism.heights(polygon.p[0], of[0]);
        low = high = of[0];
        for (int i = 1; i < polygon.count; ++i) {
            prism.heights(polygon.p[i], of[i]);
            low = of[i] < low ? of[i] : low;
            high = of[i] > high ? of[i] : high;
        }
    }
    /// Whether the polygon has a part inside of all sides, each taken alone.
    [[nodiscard]] bool reachInto() const { return low[0] < -kThin && low[1] < -kThin && low[2] < -kThin; }
    /// Returns the least and the largest distance from the triangle's own plane.
    [[nodiscard]] double nearest() const {
        return low[TrianglePrism::kOwn] > 0    ? low[TrianglePrism::kOwn]
               : high[TrianglePrism::kOwn] < 0 ? -high[TrianglePrism::kOwn]
                                               : 0;
    }
    [[nodiscard]] double farthest() const { return std::max(high[TrianglePrism::kOwn], -low[TrianglePrism::kOwn]); }
};

/// The pieces into which a prism's sides, one after the other, cut a polygon.
struct TriangleCover::Pieces {
    std::array<Polygon, 3> inside, outside;
    double beside = 0;  ///< how far the remaining part is outside of a side
};

TrianglePrism::TrianglePrism(const Triangle3& t, double more) : corners(t), extra(more) {
    std::array<glm::dvec3, kPlanes> plane;
    plane[kOwn] = glm::normalize(glm::cross(t[1] - t[0], t[2] - t[0]));
    for (int i = 0; i < 3; ++i) plane[i] = glm::normalize(glm::cross(t[(i + 1) % 3] - t[i], plane[kOwn]));
    for (int i = 0; i < kPlanes; ++i) {
        x[i] = plane[i].x, y[i] = plane[i].y, z[i] = plane[i].z;
        offset[i] = glm::dot(plane[i], t[i % 3]);
    }
    // The sides moved out by x meet x / sin(half the angle) from the corner; the sine of a whole angle is the
    // length of the cross product.
    double sine = 1;
    for (int i = 0; i < 3; ++i) sine = std::min(sine, glm::length(glm::cross(plane[i], plane[(i + 1) % 3])));
    isNeedle = sine < kNeedle;
    cornerFactor = isNeedle ? 2 / kNeedle : 2 / sine;
}

double TriangleCover::record(const Match& match) {
    const double bound = match.distance + kSlack;
    if (!worst_.empty() && match.other < worst_.size()) worst_[match.other] = std::max(worst_[match.other], bound);
    return bound;
}

double TriangleCover::bound(const Triangle3& triangle, std::span<const TrianglePrism* const> others,
                            std::span<double> worst) {
    others_ = others;
    worst_ = worst;
    if (others.empty()) return std::numeric_limits<double>::infinity();
    // Often a single prism holds all of it.
    for (size_t i = 0; i < others.size(); ++i) {
        const TrianglePrism& o = *others[i];
        double distance = 0;
        bool inside = !o.isNeedle;
        for (int c = 0; c < 3 && inside; ++c) {
            TrianglePrism::Heights h;
            o.heights(triangle[c], h);
            inside = h[0] <= kThin && h[1] <= kThin && h[2] <= kThin;
            distance = std::max(distance, std::abs(h[TrianglePrism::kOwn]));
        }
        if (inside && distance + o.extra <= enough_) return record({distance + o.extra, i});
    }
    Polygon whole;
    for (const glm::dvec3& p : triangle) whole.add(p);
    return cover(whole, 0, {});
}

WIDER_CLONES double TriangleCover::cover(const Polygon& polygon, size_t first, Match best) {
    PolygonHeights heights;
    for (size_t j = first; j < others_.size(); ++j) {
        const TrianglePrism& o = *others_[j];
        if (o.isNeedle || o.extra >= best.distance || polygon.count + 3 > Polygon::kMost) continue;
        heights.measure(o, polygon);
        if (heights.nearest() + o.extra >= best.distance || !heights.reachInto()) continue;
        // Over a ridge the prisms leave a wedge: a part that is a little outside counts as inside, with its distance.
        const double room = std::max(kThin, std::min(kMostBeside, kBeside * heights.farthest()) / o.cornerFactor);
        Pieces pieces;
        const Polygon* rest = split(o, room, polygon, heights, pieces);
        if (!rest) continue;
        double most = 0;
        for (const Polygon& out : pieces.outside)
            if (out.count > 0) most = std::max(most, cover(out, j + 1, best));
        const double above = heights.farthest();
        const double beside = pieces.beside > kThin ? pieces.beside * o.cornerFactor : 0;
        const double distance = std::sqrt(above * above + beside * beside) + o.extra;
        if (distance < best.distance) best = {distance, j};
        return std::max(most, best.distance <= enough_ ? record(best) : cover(*rest, j + 1, best));
    }
    return settle(polygon, best, kHalvings);
}

/// Cuts off what is farther than `room` outside the prism, side by side. Returns what is left; null where nothing is.
/// `heights` are those of the polygon, then of what is left.
WIDER_CLONES const TriangleCover::Polygon* TriangleCover::split(const TrianglePrism& o, double room,
                                                                const Polygon& polygon, PolygonHeights& heights,
                                                                Pieces& pieces) {
    const Polygon* left = &polygon;
    for (int s = 0; s < 3; ++s) {
        if (heights.high[s] <= room) {
            pieces.beside = std::max(pieces.beside, heights.high[s]);
            continue;
        }
        Polygon &in = pieces.inside[s], &out = pieces.outside[s];
        for (int i = 0; i < left->count; ++i) {
            const int next = i + 1 < left->count ? i + 1 : 0;
            const double value = heights.of[i][s], after = heights.of[next][s];
            (value > 0 ? out : in).add(left->p[i]);
            if ((value > 0) == (after > 0)) continue;
            const glm::dvec3 cut = left->p[i] + (left->p[next] - left->p[i]) * (value / (value - after));
            in.add(cut);
            out.add(cut);
        }
        if (in.count == 0) return nullptr;
        left = &in;
        heights.measure(o, in);
    }
    return left;
}

/// Called when no prism is left to try: takes the convex bound, and where that is poor, the bound of halves.
double TriangleCover::settle(const Polygon& polygon, Match best, int halvings) {
    for (size_t j = 0; j < others_.size(); ++j) {
        const TrianglePrism& o = *others_[j];
        const double limit = best.distance - o.extra;
        if (limit <= 0) continue;
        // A corner is at least as far from the triangle as from the prism's planes.
        const auto isBeyond = [&](glm::dvec3 p) {
            TrianglePrism::Heights h;
            o.heights(p, h);
            const double beside = std::max(std::max(h[0], h[1]), std::max(h[2], 0.0)), farther = limit + kThin;
            return std::abs(h[TrianglePrism::kOwn]) >= limit ||
                   h[TrianglePrism::kOwn] * h[TrianglePrism::kOwn] + beside * beside >= farther * farther;
        };
        double squared = 0;
        for (int i = 0; i < polygon.count && squared < limit * limit; ++i)
            squared = isBeyond(polygon.p[i]) ? limit * limit
                                             : std::max(squared, closestOnTriangle(polygon.p[i], o.corners).squared);
        if (squared < limit * limit) best = {std::sqrt(squared) + o.extra, j};
    }
    if (best.distance <= enough_ || halvings == 0 || polygon.count + 1 > Polygon::kMost) return record(best);
    int a = 0, b = 1;
    for (int i = 0; i < polygon.count; ++i)
        for (int j = i + 1; j < polygon.count; ++j) {
            const glm::dvec3 d = polygon.p[i] - polygon.p[j], e = polygon.p[a] - polygon.p[b];
            if (glm::dot(d, d) > glm::dot(e, e)) a = i, b = j;
        }
    const glm::dvec3 axis = polygon.p[b] - polygon.p[a], middle = (polygon.p[a] + polygon.p[b]) * 0.5;
    if (glm::dot(axis, axis) < kShortest * kShortest) return record(best);
    Polygon near, far;
    for (int i = 0; i < polygon.count; ++i) {
        const int next = i + 1 < polygon.count ? i + 1 : 0;
        const double value = glm::dot(polygon.p[i] - middle, axis), after = glm::dot(polygon.p[next] - middle, axis);
        (value > 0 ? far : near).add(polygon.p[i]);
        if ((value > 0) == (after > 0)) continue;
        const glm::dvec3 cut = polygon.p[i] + (polygon.p[next] - polygon.p[i]) * (value / (value - after));
        near.add(cut);
        far.add(cut);
    }
    return std::max(settle(near, best, halvings - 1), settle(far, best, halvings - 1));
}

}  // namespace vcp
