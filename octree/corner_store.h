// What is known of the corners of a page's leaves, by position in subcells: an array for corners of cells, a map
// for those within.
#pragma once

#include <deque>

#include <glm/vec3.hpp>

#include "octree/codec_page.h"
#include "octree/position_map.h"

namespace vcp {

inline uint64_t positionKey(glm::ivec3 p) { return uint64_t(uint32_t(p.x)) | uint64_t(uint32_t(p.y)) << 16 | uint64_t(uint32_t(p.z)) << 32; }

/// Positions from 0 to the page's edge. `Value` is default for a corner not met before.
template <class Value>
class CornerStore {
public:
    /// `cells`: of the page's edge.
    explicit CornerStore(int cells) : side_(cells + 1), array_(cells <= kMaxArrayCells ? static_cast<size_t>(side_) * side_ * side_ : 0), within_(16) {}

    /// Valid until the store goes.
    Value& at(glm::ivec3 p) {
        if (inArray(p)) return array_[index(p)];
        uint32_t& number = within_.findOrAdd(positionKey(p));  // plus 1
        if (number == 0) {
            values_.emplace_back();
            number = static_cast<uint32_t>(values_.size());
        }
        return values_[number - 1];
    }
    /// Null where nothing was met; positions may be beyond the page's edge.
    const Value* find(glm::ivec3 p) {
        if (inArray(p)) return std::max(p.x, std::max(p.y, p.z)) < kSubcellsPerCell * side_ ? &array_[index(p)] : nullptr;
        const uint32_t* number = within_.find(positionKey(p));
        return number == nullptr ? nullptr : &values_[*number - 1];
    }

private:
    static constexpr int kMaxArrayCells = 64;

    [[nodiscard]] bool inArray(glm::ivec3 p) const { return !array_.empty() && ((p.x | p.y | p.z) & (kSubcellsPerCell - 1)) == 0; }
    [[nodiscard]] size_t index(glm::ivec3 p) const {
        return static_cast<size_t>((p.x >> kMaxSubcellDepth) + side_ * ((p.y >> kMaxSubcellDepth) + side_ * (p.z >> kMaxSubcellDepth)));
    }

    int side_;
    std::vector<Value> array_;
    PositionMap<uint32_t> within_;
    std::deque<Value> values_;
};

}  // namespace vcp
