// What a page needs of an image.
#pragma once

#include <cstdint>

namespace vcp {

struct ImageNeed {
    uint32_t image = 0;
    /// Texels of level 0 along an edge of a cell of the page, at least, wherever one of its triangles shows the image.
    float texelsPerCell = 0;
};

}  // namespace vcp
