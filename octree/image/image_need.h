// What a part of a page needs of an image.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

namespace vcp {

/// Some of a page's triangles, and what they show of an image.
struct ImageNeed {
    uint32_t image = 0;
    /// Texels of level 0 along an edge of a cell of the page, at least, wherever one of them shows the image.
    float texelsPerCell = 0;
    /// Where they lie in the image: blocks of a grid of blocksAcross() each way, row by row, ascending.
    std::vector<uint16_t> blocks;
    glm::vec3 low{0}, high{0};  ///< their box, cells from the page's lowest corner
};

}  // namespace vcp
