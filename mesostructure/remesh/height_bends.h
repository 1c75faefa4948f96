// Where a height map is steep: the most that its slope changes from one texel to the next. For this room alone.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>

#include "mesostructure/remesh/height_levels.h"

namespace vcp::meso {

class HeightBends {
public:
    /// Keeps the most of blocks of 2 x 2 texels, of 2 x 2 of these, and so on.
    explicit HeightBends(const HeightLevels& levels);

    /// Returns the most about a line between two places in tile units, up to half its length away from it, or somewhat
    /// farther; in heights a texel.
    [[nodiscard]] double along(glm::vec2 a, glm::vec2 b) const;

private:
    struct Level {
        glm::ivec2 size{0};
        std::vector<uint16_t> most;  ///< row by row, of 65535
    };
    glm::dvec2 texels_;   ///< of a tile unit
    glm::ivec2 mapSize_;  ///< texels
    std::vector<Level> levels_;
};

}  // namespace vcp::meso
