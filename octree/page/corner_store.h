// What the codec knows of the corners of a page's leaves, by position in subcells: an array for the corners of cells, a
// map for those inside of cells.
#pragma once

#include <algorithm>
#include <vector>

#include <glm/vec3.hpp>

#include "octree/page/codec_page.h"
#include "octree/surface/position_map.h"

namespace vcp {

/// Positions range from 0 to the page's edge. A corner that was not met before has a default `Value`.
template <class Value>
class CornerStore {
public:
    /// `cells`: the page's edge in cells.
    explicit CornerStore(int cells)
        : side_(cells + 1),
          number_(cells <= kMaxArrayCells ? size_t(side_) * side_ * side_ : 0, 0),
          within_(16),
          values_(1) {}

    /// The reference is valid until the next at().
    Value& at(glm::ivec3 p) {
        uint32_t& number = inArray(p) ? number_[index(p)] : within_.findOrAdd(positionKey(p));
        if (number == 0) {
            number = uint32_t(values_.size());
            values_.emplace_back();
        }
        return values_[number];
    }
    /// Returns a default value where nothing was met. Positions may be beyond the page's edge.
    const Value& find(glm::ivec3 p) {
        if (std::min(p.x, std::min(p.y, p.z)) < 0 || std::max(p.x, std::max(p.y, p.z)) >= kSubcellsPerCell * side_)
            return values_[0];
        if (inArray(p)) return values_[number_[index(p)]];
        const uint32_t* number = within_.find(positionKey(p));
        return values_[number == nullptr ? 0 : *number];
    }

    /// Sets what was met one edge below and above along each axis; Value{} where nothing was.
    void neighbours(glm::ivec3 p, int edge, const Value* (&beside)[3][2]) {
        if (!inArray(p) || (edge & (kSubcellsPerCell - 1)) != 0) {
            for (int axis = 0; axis < 3; ++axis)
                for (int end = 0; end < 2; ++end) {
                    glm::ivec3 q = p;
                    q[axis] += end != 0 ? edge : -edge;
                    beside[axis][end] = &find(q);
                }
            return;
        }
        const size_t here = index(p);
        size_t stride = size_t(edge >> kMaxSubcellDepth);
        for (int axis = 0; axis < 3; ++axis, stride *= size_t(side_)) {
            beside[axis][0] = &values_[p[axis] >= edge ? number_[here - stride] : 0];
            beside[axis][1] = &values_[p[axis] + edge < kSubcellsPerCell * side_ ? number_[here + stride] : 0];
        }
    }

private:
    static constexpr int kMaxArrayCells = 64;

    [[nodiscard]] bool inArray(glm::ivec3 p) const {
        return !number_.empty() && ((p.x | p.y | p.z) & (kSubcellsPerCell - 1)) == 0;
    }
    [[nodiscard]] size_t index(glm::ivec3 p) const {
        return size_t((p.x >> kMaxSubcellDepth) +
                      side_ * ((p.y >> kMaxSubcellDepth) + side_ * (p.z >> kMaxSubcellDepth)));
    }

    int side_;
    std::vector<uint32_t> number_;  ///< index in values_; 0: not met
    PositionMap<uint32_t> within_;
    std::vector<Value> values_;
};

}  // namespace vcp
