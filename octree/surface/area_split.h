// Where to part boxes for a tree that rays go through: by the area of the two sides' boxes (Wald 2007: middles in
// bins).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include <glm/common.hpp>
#include <glm/vec3.hpp>

namespace vcp {

struct Bounds {
    glm::dvec3 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};
    void add(glm::dvec3 p) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    void add(const Bounds& o) {
        low = glm::min(low, o.low);
        high = glm::max(high, o.high);
    }
    [[nodiscard]] double halfArea() const {
        const glm::dvec3 e = high - low;
        return e.x < 0 ? 0 : e.x * e.y + e.y * e.z + e.z * e.x;
    }
};

struct AreaSplit {
    int axis = -1;
    double position = 0;
};

/// Returns the cheapest of 15 planes an axis: the areas of both sides' boxes, each times its number, have the least
/// sum; axis -1 where all middles agree. `middleOf(i)`, `boundsOf(i)`: of the boxes.
template <class MiddleOf, class BoundsOf>
AreaSplit cheapestSplit(uint32_t count, const MiddleOf& middleOf, const BoundsOf& boundsOf) {
    constexpr int kBins = 16;
    Bounds middles;
    for (uint32_t i = 0; i < count; ++i) middles.add(middleOf(i));
    AreaSplit best;
    double bestCost = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
        const double width = middles.high[axis] - middles.low[axis];
        if (!(width > 0)) continue;
        std::array<Bounds, kBins> bins;
        std::array<uint32_t, kBins> counts{};
        for (uint32_t i = 0; i < count; ++i) {
            const double at = (middleOf(i)[axis] - middles.low[axis]) / width * kBins;
            const int bin = std::min(int(at), kBins - 1);
            bins[bin].add(boundsOf(i));
            ++counts[bin];
        }
        std::array<double, kBins> rightCost{};
        Bounds right;
        uint32_t rightCount = 0;
        for (int bin = kBins - 1; bin > 0; --bin) {
            right.add(bins[bin]);
            rightCount += counts[bin];
            rightCost[bin] = right.halfArea() * rightCount;
        }
        Bounds left;
        uint32_t leftCount = 0;
        for (int bin = 1; bin < kBins; ++bin) {
            left.add(bins[bin - 1]);
            leftCount += counts[bin - 1];
            const double cost = left.halfArea() * leftCount + rightCost[bin];
            if (leftCount == 0 || leftCount == count || cost >= bestCost) continue;
            bestCost = cost;
            best = {axis, middles.low[axis] + width * bin / kBins};
        }
    }
    return best;
}

}  // namespace vcp
