// The pyramid of an image: levels of half the edge each, cut into tiles.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>

namespace vcp {

inline constexpr uint32_t kImageTileEdge = 64;   ///< texels along the edge of a tile; at an image's end there are fewer
inline constexpr uint32_t kLargeTileEdge = 256;  ///< where tiles may be JPEGs, whose tables then weigh little
inline constexpr uint32_t kMaxImageEdge = 32768;  ///< texels

/// A level of an image. Level 0 has the image's own size, each other half the edges of the one before it, rounded down,
/// but at least 1; the last one is a single texel.
struct ImageLevel {
    uint32_t width = 1, height = 1;  ///< texels
    uint64_t firstTile = 0;          ///< number in the file's table of tiles
    uint32_t tileEdge = kImageTileEdge;

    [[nodiscard]] uint32_t tilesX() const { return (width + tileEdge - 1) / tileEdge; }
    [[nodiscard]] uint32_t tilesY() const { return (height + tileEdge - 1) / tileEdge; }
    [[nodiscard]] uint64_t tiles() const { return uint64_t{tilesX()} * tilesY(); }
    [[nodiscard]] uint64_t texels() const { return uint64_t{width} * height; }
    /// Returns the tile's texels along both axes. `tile`: column and row.
    [[nodiscard]] glm::uvec2 sizeOf(glm::uvec2 tile) const;
};

/// Returns the levels of an image, the finest first. Their tiles are numbered from `firstTile` on, the coarsest level's
/// first. Precondition: edges from 1 to kMaxImageEdge.
std::vector<ImageLevel> imageLevels(uint32_t width, uint32_t height, uint64_t firstTile,
                                    uint32_t tileEdge = kImageTileEdge);

/// Returns the number of tiles of all levels together.
uint64_t tilesOf(const std::vector<ImageLevel>& levels);

/// Returns column and row of a level's tiles in the order of the file: Morton order, x lowest.
std::vector<glm::uvec2> tileOrder(const ImageLevel& level);

}  // namespace vcp
