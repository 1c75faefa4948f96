// The images of a file in memory, decoded, for whoever looks colours up.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "octree/image/image_tables.h"

namespace vcp {

/// Immutable; any thread may read it.
class ImageSet {
public:
    /// A level that is in memory, row by row.
    struct Level {
        uint32_t width = 1, height = 1;  ///< texels
        uint64_t first = 0;              ///< its first texel among those of all levels
    };
    struct Image {
        uint32_t width = 1, height = 1;  ///< texels of level 0
        uint32_t finest = 0;             ///< number of the finest level that is in memory
        std::vector<Level> levels;       ///< from that one on
    };

    /// Reads all images. Where they take more than `mostBytes`, the finest levels of the largest ones are left out; the
    /// coarsest level of each is always there. Errors: readImageTables' and decodeTile's.
    static Result<ImageSet> read(const ByteReader& reader, const ImagesPlace& place, uint64_t mostBytes);

    [[nodiscard]] std::span<const Image> images() const { return images_; }
    [[nodiscard]] std::span<const MaterialRow> materials() const { return materials_; }
    /// The texels of a level, RGBA8.
    [[nodiscard]] const uint32_t* texelsOf(const Level& level) const { return texels_.data() + level.first; }
    /// The texels of all levels, image by image.
    [[nodiscard]] std::span<const uint32_t> texels() const { return texels_; }
    [[nodiscard]] uint64_t bytes() const { return texels_.size() * sizeof(uint32_t); }

private:
    std::vector<Image> images_;
    std::vector<MaterialRow> materials_;
    std::vector<uint32_t> texels_;
};

/// Returns, for each image, the number of the finest level that is kept where all may take `mostBytes` together.
std::vector<uint32_t> finestWithin(std::span<const ImageRow> images, uint64_t mostBytes);

}  // namespace vcp
