#include "builder/mask/outline_simplifier.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <tuple>

#include <glm/geometric.hpp>

namespace vcp {

namespace {

// Looking how far a line has moved takes as long as it has points: so many at most between two that stay.
constexpr uint32_t kLongestRun = 256;

double distanceToSegment(glm::dvec2 p, glm::dvec2 a, glm::dvec2 b) {
    const glm::dvec2 ab = b - a;
    const double square = glm::dot(ab, ab);
    const double part = square > 0 ? std::clamp(glm::dot(p - a, ab) / square, 0.0, 1.0) : 0.0;
    return glm::length(p - a - part * ab);
}

double cross(glm::dvec2 a, glm::dvec2 b) { return a.x * b.y - a.y * b.x; }

bool areOnOneEdge(const MaskLoop::Point& a, const MaskLoop::Point& b) {
    for (int k = 0; k < 3; ++k)
        if (a.isFixed && b.isFixed && a.weights.of[k] == 0 && b.weights.of[k] == 0) return true;
    return false;
}

/// Whether a point is in a triangle or on its rim, whichever way the triangle turns.
bool isIn(const Weights& p, const Weights& a, const Weights& b, const Weights& c) {
    const int64_t ab = turnOf(a, b, p), bc = turnOf(b, c, p), ca = turnOf(c, a, p);
    if (!(ab >= 0 && bc >= 0 && ca >= 0) && !(ab <= 0 && bc <= 0 && ca <= 0)) return false;
    // Of a triangle without area, all points in its line pass so far.
    for (int k = 1; k < 3; ++k) {
        const auto [low, high] = std::minmax({a.of[k], b.of[k], c.of[k]});
        if (p.of[k] < low || p.of[k] > high) return false;
    }
    return true;
}

}  // namespace

OutlineSimplifier::OutlineSimplifier(const std::vector<MaskLoop>& loops, const std::array<glm::dvec2, 3>& texels) {
    for (const MaskLoop& loop : loops) {
        const auto first = uint32_t(points_.size()), count = uint32_t(loop.points.size());
        double twice = 0;
        bool isInside = true;
        for (uint32_t k = 0; k < count; ++k) {
            const MaskLoop::Point& own = loop.points[k];
            points_.push_back({own, placeOf(texels, own.weights), first + (k + count - 1) % count,
                               first + (k + 1) % count, uint32_t(loops_.size()), 0, true});
            isInside = isInside && !own.isFixed;
        }
        for (uint32_t k = 0; k < count; ++k)
            twice += cross(points_[first + k].at - points_[first].at,
                           points_[first + (k + 1) % count].at - points_[first].at);
        loops_.push_back({first, count, count, twice / 2, isInside});
    }
    // Where texels turn the other way than corners do, areas change their sign.
    if (cross(texels[1] - texels[0], texels[2] - texels[0]) < 0)
        for (Loop& loop : loops_) loop.area = -loop.area;
    fillGrid();
}

void OutlineSimplifier::fillGrid() {
    int log2 = 0;
    while (log2 < 9 && (size_t{1} << 2 * log2) < 2 * points_.size()) ++log2;
    grid_.shift = Weights::kLog2One - log2;
    grid_.edge = (1u << log2) + 1;
    grid_.starts.assign(size_t{grid_.edge} * grid_.edge + 1, 0);
    const auto squareOf = [&](const Point& p) {
        return size_t(p.own.weights.of[2] >> grid_.shift) * grid_.edge + size_t(p.own.weights.of[1] >> grid_.shift);
    };
    for (const Point& p : points_) ++grid_.starts[squareOf(p) + 1];
    for (size_t k = 1; k < grid_.starts.size(); ++k) grid_.starts[k] += grid_.starts[k - 1];
    std::vector<uint32_t> next = grid_.starts;
    grid_.points.resize(points_.size());
    for (uint32_t p = 0; p < points_.size(); ++p) grid_.points[next[squareOf(points_[p])]++] = p;
}

bool OutlineSimplifier::isEmpty(uint32_t a, uint32_t b, uint32_t c) const {
    const Weights* const corners[3] = {&points_[a].own.weights, &points_[b].own.weights, &points_[c].own.weights};
    const auto [low, high] = std::minmax({corners[0]->of[2], corners[1]->of[2], corners[2]->of[2]});
    for (int32_t row = low >> grid_.shift; row <= high >> grid_.shift; ++row) {
        // What the triangle's edges cover of the row, and a unit more on both sides.
        const double bottom = std::ldexp(double(row), grid_.shift), top = std::ldexp(double(row + 1), grid_.shift);
        double left = std::numeric_limits<double>::infinity(), right = -left;
        for (int k = 0; k < 3; ++k) {
            const Weights &from = *corners[k], &to = *corners[(k + 1) % 3];
            const double y0 = from.of[2], y1 = to.of[2], x0 = from.of[1], x1 = to.of[1];
            if (std::max(y0, y1) < bottom || std::min(y0, y1) > top) continue;
            for (const double y : {std::clamp(y0, bottom, top), std::clamp(y1, bottom, top)}) {
                const double x = y0 == y1 ? (y == y0 ? x0 : x1) : x0 + (x1 - x0) * ((y - y0) / (y1 - y0));
                left = std::min({left, x, y0 == y1 ? x1 : x});
                right = std::max({right, x, y0 == y1 ? x1 : x});
            }
        }
        const int32_t most = int32_t(grid_.edge) - 1;
        const int32_t first = std::clamp(int32_t(left - 1) >> grid_.shift, 0, most);
        const int32_t last = std::clamp(int32_t(right + 1) >> grid_.shift, 0, most);
        const size_t square = size_t(row) * grid_.edge;
        for (uint32_t k = grid_.starts[square + size_t(first)]; k < grid_.starts[square + size_t(last) + 1]; ++k) {
            const uint32_t p = grid_.points[k];
            if (p == a || p == b || p == c || !points_[p].isLeft) continue;
            if (isIn(points_[p].own.weights, *corners[0], *corners[1], *corners[2])) return false;
        }
    }
    return true;
}

bool OutlineSimplifier::mayGo(uint32_t point) const {
    const Point& p = points_[point];
    return !p.own.isFixed && loops_[p.loop].left > 3 && !areOnOneEdge(points_[p.before].own, points_[p.after].own);
}

std::optional<double> OutlineSimplifier::movedBy(uint32_t point, double most) const {
    const Point& p = points_[point];
    const Loop& loop = loops_[p.loop];
    const glm::dvec2 from = points_[p.before].at, to = points_[p.after].at;
    double farthest = 0;
    uint32_t run = 0;
    for (uint32_t k = p.before; k != p.after; k = k + 1 == loop.first + loop.count ? loop.first : k + 1) {
        farthest = std::max(farthest, distanceToSegment(points_[k].at, from, to));
        if (farthest > most || ++run > kLongestRun) return std::nullopt;
    }
    return farthest;
}

double OutlineSimplifier::areaOf(uint32_t point) const {
    const Point& p = points_[point];
    return std::abs(cross(p.at - points_[p.before].at, points_[p.after].at - points_[p.before].at)) / 2;
}

void OutlineSimplifier::remove(uint32_t point) {
    Point& p = points_[point];
    p.isLeft = false;
    --loops_[p.loop].left;
    points_[p.before].after = p.after;
    points_[p.after].before = p.before;
    ++points_[p.before].changes;
    ++points_[p.after].changes;
}

/// Takes points away, the cheapest first. `costOf`: of a point; nothing where it stays.
template <class CostOf>
void OutlineSimplifier::takeAway(CostOf costOf) {
    using Candidate = std::tuple<double, uint32_t, uint32_t>;  // cost, point, changes of its neighbours
    std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> open;
    const auto offer = [&](uint32_t point) {
        if (!points_[point].isLeft || !mayGo(point)) return;
        if (const std::optional<double> cost = costOf(point)) open.emplace(*cost, point, points_[point].changes);
    };
    for (uint32_t p = 0; p < points_.size(); ++p) offer(p);
    while (!open.empty()) {
        const auto [cost, point, changes] = open.top();
        open.pop();
        const Point& p = points_[point];
        if (!p.isLeft || p.changes != changes || !mayGo(point) || !isEmpty(p.before, point, p.after)) continue;
        remove(point);
        offer(p.before);
        offer(p.after);
    }
}

void OutlineSimplifier::keepWithin(double tolerance) {
    takeAway([&](uint32_t point) { return movedBy(point, tolerance); });
}

void OutlineSimplifier::keepAreas(double area, double leastPart) {
    takeAway([&](uint32_t point) -> std::optional<double> {
        const double least = std::min(area, std::abs(loops_[points_[point].loop].area) * leastPart);
        const double spanned = areaOf(point);
        return spanned < least ? std::optional(spanned) : std::nullopt;
    });
}

void OutlineSimplifier::keepLoops(double area) {
    for (Loop& loop : loops_)
        if (loop.isInside && loop.left > 0 && std::abs(loop.area) < area) {
            for (uint32_t k = 0; k < loop.count; ++k) points_[loop.first + k].isLeft = false;
            loop.left = 0;
        }
}

size_t OutlineSimplifier::triangles() const {
    int64_t count = 0;
    for (const Loop& loop : loops_)
        if (loop.left > 0) count += int64_t{loop.left} + (loop.isInside && loop.area < 0 ? 2 : -2);
    return size_t(std::max<int64_t>(count, 0));
}

std::vector<MaskLoop> OutlineSimplifier::loops() const {
    std::vector<MaskLoop> all;
    for (const Loop& loop : loops_) {
        if (loop.left < 3) continue;
        MaskLoop& left = all.emplace_back();
        for (uint32_t k = 0; k < loop.count; ++k)
            if (points_[loop.first + k].isLeft) left.points.push_back(points_[loop.first + k].own);
    }
    return all;
}

}  // namespace vcp
