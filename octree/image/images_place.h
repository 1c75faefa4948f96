// Where the images of a .vcp file are: a part of its header.
#pragma once

#include <cstdint>

namespace vcp {

/// The section of images (image_tables.h). All zero where there are none.
struct ImagesPlace {
    uint64_t offset = 0, bytes = 0;
    uint64_t hash = 0;  ///< XXH3-64 of the section's tables
    uint32_t images = 0, materials = 0;
    uint32_t channels = 0;  ///< rows of materials' channels: as many as materials, or none
    uint32_t reserved = 0;
};
static_assert(sizeof(ImagesPlace) == 40);

}  // namespace vcp
