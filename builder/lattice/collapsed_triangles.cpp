#include "builder/lattice/collapsed_triangles.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <span>
#include <tuple>

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include "builder/lattice/lattice_mesh.h"
#include "octree/surface/leaf_math.h"

namespace vcp {

namespace {

using Point = std::array<int32_t, 3>;

Point pointOf(glm::i32vec3 p) { return {p.x, p.y, p.z}; }
glm::i32vec3 vectorOf(const Point& p) { return {p[0], p[1], p[2]}; }

/// A part of a collapsed triangle's line; a == b where it is a point.
struct Segment {
    Point a, b;
    std::array<uint32_t, 2> colour;
    float stray;  ///< of the triangle

    [[nodiscard]] std::pair<Point, Point> ends() const { return {a, b}; }
    bool operator<(const Segment& o) const { return std::tie(a, b, colour) < std::tie(o.a, o.b, o.colour); }
};

/// Adds the parts between neighbouring corners along the line. Sorted by coordinates, points on a line are in order.
void addSegments(const LatticeTriangle& t, std::vector<Segment>& segments) {
    std::array<std::pair<Point, uint32_t>, 3> corner;
    for (int i = 0; i < 3; ++i) corner[i] = {pointOf(t.corner[i]), t.colour[i]};
    std::sort(corner.begin(), corner.end());
    const auto add = [&](int i, int k) {
        segments.push_back({corner[i].first, corner[k].first, {corner[i].second, corner[k].second}, t.stray});
    };
    if (corner[0].first == corner[2].first) return add(0, 2);
    if (corner[0].first != corner[1].first) add(0, 1);
    if (corner[1].first != corner[2].first) add(1, 2);
}

/// Removes the segments that are an edge, or a corner, of a triangle with area.
void removeCovered(std::span<const LatticeTriangle> triangles, std::vector<Segment>& segments) {
    std::vector<std::pair<Point, Point>> wanted;
    for (const Segment& s : segments) wanted.push_back(s.ends());
    std::sort(wanted.begin(), wanted.end());
    wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
    if (wanted.empty()) return;
    // Few points begin a segment, and of the others most are known by one bit.
    std::vector<bool> begins(std::bit_ceil(64 * wanted.size()));
    const auto placeOf = [&](const Point& p) {
        const glm::u32vec3 v(vectorOf(p));
        return (v.x * 0x9e3779b1u ^ v.y * 0x85ebca6bu ^ v.z * 0xc2b2ae35u) & (begins.size() - 1);
    };
    for (const auto& [p, q] : wanted) begins[placeOf(p)] = true;
    std::vector<std::atomic<bool>> covered(wanted.size());
    tbb::parallel_for(tbb::blocked_range<size_t>(0, triangles.size(), 16384), [&](const auto& range) {
        for (size_t k = range.begin(); k < range.end(); ++k)
            for (int i = 0; i < 3; ++i) {
                const Point p = pointOf(triangles[k].corner[i]), q = pointOf(triangles[k].corner[(i + 1) % 3]);
                for (const auto& ends : {std::pair(std::min(p, q), std::max(p, q)), std::pair(p, p)}) {
                    if (!begins[placeOf(ends.first)]) continue;
                    const auto at = std::lower_bound(wanted.begin(), wanted.end(), ends);
                    if (at != wanted.end() && *at == ends) covered[size_t(at - wanted.begin())] = true;
                }
            }
    });
    std::erase_if(segments, [&](const Segment& s) {
        return covered[size_t(std::lower_bound(wanted.begin(), wanted.end(), s.ends()) - wanted.begin())].load();
    });
}

/// Whether a vertex may lie there.
bool isVertex(glm::i32vec3 p, int step) { return ((p.x | p.y | p.z) & (step - 1)) == 0; }

/// Returns a neighbour of `p` in its page that does not lie on the line from `p` to `q`.
glm::i32vec3 besideLine(glm::i32vec3 p, glm::i32vec3 q, const std::function<bool(glm::i32vec3, glm::i32vec3)>& samePage,
                        const std::function<int(glm::i32vec3)>& stepAt) {
    const int distance = stepAt(p);
    for (int axis = 0; axis < 3; ++axis)
        for (const int step : {distance, -distance}) {
            glm::i32vec3 r = p;
            r[axis] += step;
            if (r[axis] >= 0 && samePage(p, r) && isVertex(r, stepAt(r)) && (p == q || hasArea(p, q, r))) return r;
        }
    return p;  // a page has more than one lattice point along each axis
}

/// Returns the corners of triangles that have three, each triangle once.
std::vector<Corners> distinctCorners(std::span<const LatticeTriangle> triangles) {
    std::vector<std::array<Point, 3>> sorted;
    for (const LatticeTriangle& t : triangles) {
        std::array<Point, 3> p{pointOf(t.corner[0]), pointOf(t.corner[1]), pointOf(t.corner[2])};
        std::sort(p.begin(), p.end());
        if (p[0] != p[1] && p[1] != p[2]) sorted.push_back(p);
    }
    std::sort(sorted.begin(), sorted.end());
    sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    std::vector<Corners> corners;
    for (const auto& [a, b, c] : sorted) corners.push_back({vectorOf(a), vectorOf(b), vectorOf(c)});
    return corners;
}

}  // namespace

std::vector<Corners> keepCollapsed(std::vector<LatticeTriangle>& soup, const std::function<bool(glm::i32vec3)>& owns,
                                   const std::function<bool(glm::i32vec3, glm::i32vec3)>& samePage,
                                   const std::function<int(glm::i32vec3)>& stepAt) {
    const auto firstCollapsed = std::partition(soup.begin(), soup.end(), [](const LatticeTriangle& t) {
        return hasArea(t.corner[0], t.corner[1], t.corner[2]);
    });
    if (firstCollapsed == soup.end()) return {};
    std::vector<Corners> changed = distinctCorners({firstCollapsed, soup.end()});
    std::vector<Segment> segments;
    for (auto t = firstCollapsed; t != soup.end(); ++t) addSegments(*t, segments);
    soup.erase(firstCollapsed, soup.end());
    std::erase_if(segments, [&](const Segment& s) { return !owns(vectorOf(s.a)) && !owns(vectorOf(s.b)); });
    removeCovered(soup, segments);
    std::sort(segments.begin(), segments.end());
    // The first of several along one line stays, with the largest stray.
    size_t kept = 0;
    for (const Segment& s : segments) {
        const bool isNew = kept == 0 || segments[kept - 1].ends() != s.ends();
        if (isNew)
            segments[kept++] = s;
        else
            segments[kept - 1].stray = std::max(segments[kept - 1].stray, s.stray);
    }
    segments.resize(kept);
    for (const Segment& s : segments) {
        LatticeTriangle t{};
        t.corner[0] = vectorOf(s.a);
        t.corner[1] = s.a == s.b ? besideLine(t.corner[0], t.corner[0], samePage, stepAt) : vectorOf(s.b);
        t.corner[2] = besideLine(t.corner[0], t.corner[1], samePage, stepAt);
        for (int i = 0; i < 3; ++i) t.colour[i] = s.colour[i == 1 ? 1 : 0];
        const int step = std::max(stepAt(vectorOf(s.a)), stepAt(vectorOf(s.b)));
        t.stray = std::max(s.stray, float(kLatticeRounding * step)) + float(step) / float(kLatticePerCell);
        soup.push_back(t);
        changed.push_back({t.corner[0], t.corner[1], t.corner[2]});
    }
    return changed;
}

}  // namespace vcp
