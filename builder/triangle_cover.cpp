#include "builder/triangle_cover.h"

#include <algorithm>
#include <cmath>

namespace vcp {

namespace {

// A part thinner than this is not cut off: it counts with what it hangs on to.
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

/// Convex; a triangle cut by planes, with room for one corner more a cut.
struct TriangleCover::Polygon {
    static constexpr int kMost = 24;
    int count = 0;
    std::array<glm::dvec3, kMost> p;

    Polygon() = default;
    // Only the corners that there are: most polygons have three to six.
    Polygon(const Polygon& o) : count(o.count) { std::copy_n(o.p.begin(), count, p.begin()); }
    Polygon& operator=(const Polygon& o) {
        count = o.count;
        std::copy_n(o.p.begin(), count, p.begin());
        return *this;
    }

    void add(glm::dvec3 q) { p[count++] = q; }
    /// Whether it has a part inside of all sides of a prism, each taken alone.
    [[nodiscard]] bool reachesInto(const TrianglePrism& prism) const {
        for (int s = 0; s < 3; ++s) {
            double least = std::numeric_limits<double>::infinity();
            for (int i = 0; i < count; ++i) least = std::min(least, glm::dot(prism.side[s], p[i]) - prism.sideOffset[s]);
            if (least >= -kThin) return false;
        }
        return true;
    }
};

TrianglePrism::TrianglePrism(const Triangle3& t, double more) : corners(t), extra(more) {
    normal = glm::normalize(glm::cross(t[1] - t[0], t[2] - t[0]));
    offset = glm::dot(normal, t[0]);
    for (int i = 0; i < 3; ++i) {
        side[i] = glm::normalize(glm::cross(t[(i + 1) % 3] - t[i], normal));
        sideOffset[i] = glm::dot(side[i], t[i]);
    }
    // The sides moved out by x meet x / sin(half the angle) from the corner; the sine of a whole angle is the
    // length of the cross product.
    double sine = 1;
    for (int i = 0; i < 3; ++i) sine = std::min(sine, glm::length(glm::cross(side[i], side[(i + 1) % 3])));
    isNeedle = sine < kNeedle;
    cornerFactor = isNeedle ? 2 / kNeedle : 2 / sine;
}

double TriangleCover::record(const Match& match) {
    const double bound = match.distance + kSlack;
    if (!worst_.empty() && match.other < worst_.size()) worst_[match.other] = std::max(worst_[match.other], bound);
    return bound;
}

double TriangleCover::bound(const Triangle3& triangle, std::span<const TrianglePrism* const> others, std::span<double> worst) {
    others_ = others;
    worst_ = worst;
    if (others.empty()) return std::numeric_limits<double>::infinity();
    // Often one prism holds all of it.
    for (size_t i = 0; i < others.size(); ++i) {
        const TrianglePrism& o = *others[i];
        double distance = 0;
        bool inside = !o.isNeedle;
        for (int c = 0; c < 3 && inside; ++c) {
            for (int s = 0; s < 3; ++s) inside = inside && glm::dot(o.side[s], triangle[c]) - o.sideOffset[s] <= kThin;
            distance = std::max(distance, std::abs(glm::dot(o.normal, triangle[c]) - o.offset));
        }
        if (inside && distance + o.extra <= enough_) return record({distance + o.extra, i});
    }
    Polygon whole;
    for (const glm::dvec3& p : triangle) whole.add(p);
    return cover(whole, 0, {});
}

double TriangleCover::cover(const Polygon& polygon, size_t first, Match best) {
    for (size_t j = first; j < others_.size(); ++j) {
        const TrianglePrism& o = *others_[j];
        if (o.isNeedle || o.extra >= best.distance || polygon.count + 3 > Polygon::kMost) continue;
        double low = std::numeric_limits<double>::infinity(), high = -low;
        for (int i = 0; i < polygon.count; ++i) {
            const double d = glm::dot(o.normal, polygon.p[i]) - o.offset;
            low = std::min(low, d);
            high = std::max(high, d);
        }
        const double nearest = low > 0 ? low : high < 0 ? -high : 0, farthest = std::max(high, -low);
        if (nearest + o.extra >= best.distance) continue;
        if (!polygon.reachesInto(o)) continue;
        // Over a ridge the prisms leave a wedge: what is little outside counts as inside, with its distance.
        const double room = std::max(kThin, std::min(kMostBeside, kBeside * farthest) / o.cornerFactor);
        Polygon rest = polygon;
        std::array<Polygon, 3> outside;
        double beside = 0;
        if (!split(o, room, rest, outside, beside)) continue;
        double most = 0;
        for (const Polygon& out : outside)
            if (out.count > 0) most = std::max(most, cover(out, j + 1, best));
        double above = 0;
        for (int i = 0; i < rest.count; ++i) above = std::max(above, std::abs(glm::dot(o.normal, rest.p[i]) - o.offset));
        beside = beside > kThin ? beside * o.cornerFactor : 0;
        const double distance = std::sqrt(above * above + beside * beside) + o.extra;
        if (distance < best.distance) best = {distance, j};
        return std::max(most, best.distance <= enough_ ? record(best) : cover(rest, j + 1, best));
    }
    return settle(polygon, best, kHalvings);
}

/// Cuts off what is farther than `room` outside the prism, side by side; false where nothing is left in it.
/// `most`: how far what is left is outside of a side.
bool TriangleCover::split(const TrianglePrism& o, double room, Polygon& inside, std::array<Polygon, 3>& outside, double& most) const {
    std::array<double, Polygon::kMost> v;
    for (int s = 0; s < 3; ++s) {
        double largest = -std::numeric_limits<double>::infinity();
        for (int i = 0; i < inside.count; ++i) {
            v[i] = glm::dot(o.side[s], inside.p[i]) - o.sideOffset[s];
            largest = std::max(largest, v[i]);
        }
        if (largest <= room) {
            most = std::max(most, largest);
            continue;
        }
        Polygon in;
        Polygon& out = outside[s];
        for (int i = 0; i < inside.count; ++i) {
            const int next = i + 1 < inside.count ? i + 1 : 0;
            (v[i] > 0 ? out : in).add(inside.p[i]);
            if ((v[i] > 0) == (v[next] > 0)) continue;
            const glm::dvec3 cut = inside.p[i] + (inside.p[next] - inside.p[i]) * (v[i] / (v[i] - v[next]));
            in.add(cut);
            out.add(cut);
        }
        inside = in;
        if (inside.count == 0) return false;
    }
    return true;
}

/// No prism is left to try: the convex bound, and where that is poor, that of halves.
double TriangleCover::settle(const Polygon& polygon, Match best, int halvings) {
    for (size_t j = 0; j < others_.size(); ++j) {
        const TrianglePrism& o = *others_[j];
        const double limit = best.distance - o.extra;
        if (limit <= 0) continue;
        double squared = 0;
        for (int i = 0; i < polygon.count && squared < limit * limit; ++i) {
            const double above = glm::dot(o.normal, polygon.p[i]) - o.offset;
            squared = std::abs(above) < limit ? std::max(squared, closestOnTriangle(polygon.p[i], o.corners).squared) : limit * limit;
        }
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
