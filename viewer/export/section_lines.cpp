#include "viewer/export/section_lines.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include <glm/geometric.hpp>

namespace vcp {

namespace {

bool isLess(glm::dvec3 a, glm::dvec3 b) { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); }

constexpr uint32_t kNoEnd = UINT32_MAX;

/// Segments as links between points, and the walk along them.
class Chains {
public:
    explicit Chains(size_t segments) : ends_(segments), next_(2 * segments, kNoEnd), isUsed_(segments, false) {}

    /// Joins two ends; an end is twice a segment's number, and 1 more for its second point.
    void link(uint32_t a, uint32_t b) {
        next_[a] = b;
        next_[b] = a;
    }
    [[nodiscard]] bool isOpen(uint32_t end) const { return next_[end] == kNoEnd; }
    [[nodiscard]] bool isUsed(uint32_t segment) const { return isUsed_[segment]; }

    /// Returns the ends that are passed from `end` on: each segment's near end, then its far end.
    std::vector<uint32_t> walk(uint32_t end) {
        std::vector<uint32_t> passed;
        while (end != kNoEnd && !isUsed_[end / 2]) {
            isUsed_[end / 2] = true;
            passed.push_back(end);
            passed.push_back(end ^ 1u);
            end = next_[end ^ 1u];
        }
        return passed;
    }

private:
    std::vector<uint32_t> ends_, next_;
    std::vector<bool> isUsed_;
};

}  // namespace

double SectionLines::height(glm::dvec3 p) const { return glm::dot(plane_.normal, p) - plane_.offset; }

SectionLines::EdgePoint SectionLines::crossing(glm::dvec3 a, glm::dvec3 b) const {
    if (isLess(b, a)) std::swap(a, b);
    const double from = height(a), to = height(b);
    return {{a.x, a.y, a.z, b.x, b.y, b.z}, a + from / (from - to) * (b - a)};
}

void SectionLines::add(std::span<const Facet> facets) {
    for (const Facet& facet : facets) {
        bool isAbove[3];
        for (int i = 0; i < 3; ++i) isAbove[i] = height(facet[i]) >= 0;
        if (isAbove[0] == isAbove[1] && isAbove[1] == isAbove[2]) continue;
        // The corner that is alone on its side, and the two edges from it; what is above lies on the line's left.
        const int alone = isAbove[0] == isAbove[1] ? 2 : isAbove[1] == isAbove[2] ? 0 : 1;
        Segment segment{crossing(facet[alone], facet[(alone + 2) % 3]), crossing(facet[alone], facet[(alone + 1) % 3])};
        if (isAbove[alone]) std::swap(segment[0], segment[1]);
        segments_.push_back(segment);
    }
}

std::vector<Polyline> SectionLines::join() const {
    // In an order of their own, each once: a segment is known by its two edges.
    std::vector<uint32_t> order(segments_.size());
    for (uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    const auto key = [&](uint32_t i) { return std::minmax(segments_[i][0].edge, segments_[i][1].edge); };
    std::ranges::sort(order, [&](uint32_t a, uint32_t b) { return key(a) < key(b); });
    order.erase(std::unique(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return key(a) == key(b); }),
                order.end());

    const auto pointOf = [&](uint32_t end) -> const EdgePoint& { return segments_[order[end / 2]][end % 2]; };
    std::vector<uint32_t> ends(2 * order.size());
    for (uint32_t i = 0; i < ends.size(); ++i) ends[i] = i;
    std::ranges::stable_sort(ends, [&](uint32_t a, uint32_t b) { return pointOf(a).edge < pointOf(b).edge; });
    Chains chains(order.size());
    for (size_t first = 0; first < ends.size();) {
        size_t end = first;
        while (end < ends.size() && pointOf(ends[end]).edge == pointOf(ends[first]).edge) ++end;
        if (end - first == 2) chains.link(ends[first], ends[first + 1]);
        first = end;
    }

    std::vector<Polyline> lines;
    const auto follow = [&](uint32_t start, bool isClosed) {
        Polyline line{.isClosed = isClosed};
        for (const uint32_t end : chains.walk(start))
            if (line.points.empty() || line.points.back() != pointOf(end).at) line.points.push_back(pointOf(end).at);
        if (isClosed && line.points.size() > 1 && line.points.front() == line.points.back()) line.points.pop_back();
        if (line.points.size() > 1) lines.push_back(std::move(line));
    };
    // Open lines begin at an end; what is left goes round.
    for (uint32_t end = 0; end < ends.size(); ++end)
        if (chains.isOpen(end) && !chains.isUsed(end / 2)) follow(end, false);
    for (uint32_t segment = 0; segment < order.size(); ++segment)
        if (!chains.isUsed(segment)) follow(2 * segment, true);
    return lines;
}

double lengthOf(const Polyline& line) {
    double length = 0;
    for (size_t i = 1; i < line.points.size(); ++i) length += glm::distance(line.points[i - 1], line.points[i]);
    if (line.isClosed && !line.points.empty()) length += glm::distance(line.points.back(), line.points.front());
    return length;
}

glm::dvec2 PlaneAxes::of(glm::dvec3 p) const { return {glm::dot(p - origin, x), glm::dot(p - origin, y)}; }

PlaneAxes axesOf(const CutPlane& plane) {
    const glm::dvec3 n = plane.normal / glm::length(plane.normal);
    for (int axis = 0; axis < 3; ++axis)
        if (std::abs(n[axis]) == 1) {
            PlaneAxes axes{.x = glm::dvec3(0), .y = glm::dvec3(0)};
            axes.x[axis == 0 ? 1 : 0] = 1;
            axes.y[axis == 2 ? 1 : 2] = 1;
            return axes;
        }
    const glm::dvec3 x = glm::normalize(glm::cross(glm::dvec3(0, 0, 1), n));
    return {n * (plane.offset / glm::length(plane.normal)), x, glm::cross(n, x)};
}

}  // namespace vcp
