// The levels of a height map in tiles, as devices read them (mesostructure/shared/remesh_layout.h): those that a view
// needs are enough. Where a tile is not there, a texel has the height that a coarser level has at its place: so it is a
// function of the place and of what is there alone, from whatever side an edge is looked at.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include "mesostructure/remesh/height_levels.h"

namespace vcp::meso {

/// Any thread may call const functions.
class HeightTiles {
public:
    static constexpr uint32_t kQuads = RemeshMath<float>::kRemeshTileQuads;  ///< of a tile
    static constexpr uint32_t kNone = ~uint32_t{0};                          ///< in place of a quad: it is not there

    explicit HeightTiles(std::shared_ptr<const HeightLevels> levels);

    /// Tiles of all levels, the map's own first.
    [[nodiscard]] uint32_t count() const { return firsts_.back(); }
    /// The number of a level's first tile.
    [[nodiscard]] uint32_t first(size_t level) const { return firsts_[level]; }
    [[nodiscard]] size_t levels() const { return levels_->levels().size(); }
    [[nodiscard]] const std::shared_ptr<const HeightLevels>& heights() const { return levels_; }
    /// The number of a tile's entry, in words.
    [[nodiscard]] uint32_t entry(uint32_t tile) const { return uint32_t(4 * levels()) + tile; }
    /// Quads of levels and entries, before the tiles.
    [[nodiscard]] uint32_t tableQuads() const { return uint32_t(levels()) + (count() + 3) / 4; }

    /// Returns a tile's heights.
    [[nodiscard]] std::vector<glm::uvec4> texels(uint32_t tile) const;
    /// Returns levels and entries. `quads`: where the heights of each tile begin, or kNone. Precondition: the coarsest
    /// tile is there; quads are below 2^27.
    [[nodiscard]] std::vector<glm::uvec4> table(const std::vector<uint32_t>& quads) const;

private:
    [[nodiscard]] glm::ivec2 tilesOf(size_t level) const;
    [[nodiscard]] bool isThere(size_t level, glm::ivec2 tile, size_t coarser, const std::vector<uint32_t>& quads) const;

    std::shared_ptr<const HeightLevels> levels_;
    std::vector<uint32_t> firsts_;  // and the number of all
};

}  // namespace vcp::meso
