// The images of a file as shaders read them: words (render/shaders/images.glsl). Pure.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "octree/image/image_set.h"

namespace vcp {

struct ImageWords {
    std::vector<uint32_t> tables;
    std::vector<std::span<const uint32_t>> texels;  ///< what follows them, tile by tile; the set's
};
ImageWords imageWords(const ImageSet& set);

}  // namespace vcp
