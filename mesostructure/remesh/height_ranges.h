// Least and greatest heights of a map over ever larger blocks of its texels: what a search for the most that the map
// differs from a plane need not look into. For this room alone.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>

#include "mesostructure/remesh/height_levels.h"

namespace vcp::meso {

class HeightRanges {
public:
    static constexpr int kBlock = 8;  ///< texels along a block of level 0; a level's are twice as wide as the last's

    /// Heights in [least, most], 65535 is 1.
    struct Range {
        uint16_t least = 65535, most = 0;
    };

    explicit HeightRanges(const HeightLevel& map);

    [[nodiscard]] int levels() const { return int(levels_.size()); }
    /// Returns the number of blocks of a tile's edge: the last ones may be narrower.
    [[nodiscard]] glm::ivec2 blocks(int level) const { return levels_[size_t(level)].size; }
    /// Returns the range of what is bilinear over the texels of a block, up to the texels after its last.
    [[nodiscard]] const Range& of(int level, glm::ivec2 block) const {
        const Level& in = levels_[size_t(level)];
        return in.ranges[size_t(block.x) + size_t(in.size.x) * size_t(block.y)];
    }

private:
    struct Level {
        glm::ivec2 size{0};
        std::vector<Range> ranges;
    };
    std::vector<Level> levels_;
};

}  // namespace vcp::meso
