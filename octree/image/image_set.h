// The levels of a file's images that are in memory, decoded, for whoever looks colours up.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "octree/image/image_tables.h"

namespace vcp {

/// Copies share the texels, which do not change.
class ImageSet {
public:
    /// A level that is in memory.
    struct Level {
        uint32_t width = 1, height = 1;            ///< texels
        std::shared_ptr<const uint32_t[]> texels;  ///< RGBA8, row by row

        [[nodiscard]] uint64_t bytes() const { return uint64_t{width} * height * sizeof(uint32_t); }
    };
    struct Image {
        uint32_t width = 1, height = 1;  ///< texels of level 0
        uint32_t finest = 0;        ///< number of the finest level that is in memory; where there is none, of levels
        std::vector<Level> levels;  ///< from that one on
    };

    ImageSet() = default;
    /// Images without a level.
    explicit ImageSet(const ImageTables& tables);

    [[nodiscard]] std::span<const Image> images() const { return images_; }
    [[nodiscard]] std::span<const MaterialRow> materials() const { return materials_; }
    [[nodiscard]] uint64_t bytes() const;

    /// Adds the level that is next finer than those there are.
    void add(uint32_t image, Level level);
    /// Takes away the levels of an image that are finer than `finest`.
    void drop(uint32_t image, uint32_t finest);

private:
    std::vector<Image> images_;
    std::vector<MaterialRow> materials_;
};

/// Coarsens what images have until all levels from there on take `mostBytes` together, or none may go: the largest ones
/// go first. `finest`: for each image, the number of its finest level, that of levels where it has none; `coarsest`:
/// the most that it may become.
std::vector<uint32_t> finestWithin(std::span<const ImageRow> images, std::vector<uint32_t> finest,
                                   const std::vector<uint32_t>& coarsest, uint64_t mostBytes);

}  // namespace vcp
