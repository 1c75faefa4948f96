// What a page needs of an image.
#pragma once

#include <cstdint>
#include <vector>

namespace vcp {

struct ImageNeed {
    uint32_t image = 0;
    /// Texels of level 0 along an edge of a cell of the page, at least, wherever one of its triangles shows the image.
    float texelsPerCell = 0;
    /// Where its triangles lie in the image: blocks of a grid of blocksAcross() each way, row by row, ascending.
    std::vector<uint16_t> blocks;
};

}  // namespace vcp
