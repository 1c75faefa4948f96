// Where a height map is steep: the most that its slope changes from one texel to the next. For this room alone.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>

#include "mesostructure/remesh/height_levels.h"

namespace vcp::meso {

class HeightBends {
public:
    /// Keeps the most of blocks of texels, of 2 x 2 of these, and so on. The smallest have 2 x 2 texels, of large maps
    /// more: what smaller ones bend is found when it is asked for. The levels must outlive it.
    explicit HeightBends(const HeightLevels& levels);

    /// Returns the most about a line between two places in tile units, up to half its length away from it, or somewhat
    /// farther; in heights a texel.
    [[nodiscard]] double along(glm::vec2 a, glm::vec2 b) const;

private:
    struct Level {
        glm::ivec2 size{0};
        std::vector<uint16_t> most;  ///< row by row, of 65535
    };
    /// Returns the most in a block of 2^log2 texels' edge.
    [[nodiscard]] uint16_t mostIn(glm::ivec2 block, int log2) const;

    const HeightLevel& map_;
    glm::dvec2 texels_;  ///< of a tile unit
    int log2Block_;      ///< of the smallest blocks that are kept
    std::vector<Level> levels_;
};

}  // namespace vcp::meso
