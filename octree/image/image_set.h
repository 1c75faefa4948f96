// The tiles of a file's images that are in memory, decoded, for whoever looks colours up.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "octree/image/image_tables.h"

namespace vcp {

/// Copies share the texels, which do not change.
class ImageSet {
public:
    /// The texels of a tile, RGBA8, row by row; null where it is not in memory.
    using Tile = std::shared_ptr<const uint32_t[]>;

    struct Level {
        explicit Level(const ImageLevel& level);

        uint32_t width, height;   ///< texels
        uint32_t log2Edge;        ///< of its tiles
        uint32_t tilesX;          ///< tiles of a row
        std::vector<Tile> tiles;  ///< row by row
        size_t there = 0;         ///< how many of them are in memory

        /// Returns the texels of the tile that has a texel; null where they are not in memory.
        [[nodiscard]] const uint32_t* tileOf(uint32_t column, uint32_t row) const {
            return tiles[size_t{row >> log2Edge} * tilesX + (column >> log2Edge)].get();
        }
        /// Returns how many texels a tile has. `i`: its number, row by row.
        [[nodiscard]] uint64_t texelsOf(size_t i) const;
        /// Returns where a texel is in its tile.
        [[nodiscard]] size_t placeInTile(uint32_t column, uint32_t row) const {
            const uint32_t inTile = (1u << log2Edge) - 1;
            const uint32_t before = column & ~inTile;
            return size_t{row & inTile} * std::min(inTile + 1, width - before) + (column & inTile);
        }
    };
    /// An image is shown where its coarsest level is in memory. What of a finer level is not, is seen in a coarser one.
    struct Image {
        uint32_t width = 1, height = 1;  ///< texels of level 0
        uint32_t finest = 0;             ///< number of the finest level of which something is in memory
        std::vector<Level> levels;       ///< all, whatever is in memory; the finest is level 0

        [[nodiscard]] bool isShown() const { return levels.back().tiles.front() != nullptr; }
    };

    ImageSet() = default;
    /// Images without a tile.
    explicit ImageSet(const ImageTables& tables);

    [[nodiscard]] std::span<const Image> images() const { return images_; }
    [[nodiscard]] std::span<const MaterialRow> materials() const { return materials_; }
    /// Whether some material has channels.
    [[nodiscard]] bool hasChannels() const { return !channels_.empty(); }
    /// Returns the channels of a material; null where it has none, or not all of their images are shown.
    [[nodiscard]] const ChannelRow* channelsOf(uint32_t material) const;
    [[nodiscard]] uint64_t bytes() const { return bytes_; }

    /// Puts a tile in its place, or takes it away (null). `tile`: its column and row.
    void set(uint32_t image, uint32_t level, glm::uvec2 tile, Tile texels);
    /// Takes tiles away until the others take so many bytes at most: of all images the finest first.
    void shrinkTo(uint64_t mostBytes);

private:
    std::vector<Image> images_;
    std::vector<MaterialRow> materials_;
    std::vector<ChannelRow> channels_;  // one for each material, or none
    uint64_t bytes_ = 0;
};

}  // namespace vcp
