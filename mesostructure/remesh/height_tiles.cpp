#include "mesostructure/remesh/height_tiles.h"

#include <algorithm>
#include <bit>

#include <glm/common.hpp>

namespace vcp::meso {

namespace {

constexpr int kEdge = RemeshMath<float>::kRemeshTileEdge;
constexpr uint32_t kQuadBits = RemeshMath<float>::kRemeshQuadBits;
static_assert((kEdge + 1) * (kEdge + 1) <= int(8 * HeightTiles::kQuads));

}  // namespace

HeightTiles::HeightTiles(std::shared_ptr<const HeightLevels> levels) : levels_(std::move(levels)), firsts_{0} {
    for (size_t level = 0; level < levels_->levels().size(); ++level) {
        const glm::ivec2 tiles = tilesOf(level);
        firsts_.push_back(firsts_.back() + uint32_t(tiles.x * tiles.y));
    }
}

glm::ivec2 HeightTiles::tilesOf(size_t level) const { return (levels_->levels()[level].size + (kEdge - 1)) / kEdge; }

std::vector<glm::uvec4> HeightTiles::texels(uint32_t tile) const {
    const size_t level = size_t(std::ranges::upper_bound(firsts_, tile) - firsts_.begin()) - 1;
    const HeightLevel& from = levels_->levels()[level];
    const int number = int(tile - firsts_[level]), across = tilesOf(level).x;
    const glm::ivec2 low(number % across * kEdge, number / across * kEdge), high = glm::min(low + kEdge, from.size);
    std::vector<glm::uvec4> quads(kQuads, glm::uvec4(0));
    auto* const texels = reinterpret_cast<uint16_t*>(quads.data());
    for (int y = low.y; y <= high.y; ++y) {
        const uint16_t* row = from.texels.data() + size_t(from.size.x) * size_t(y < from.size.y ? y : 0);
        uint16_t* to = texels + (kEdge + 1) * (y - low.y);
        std::copy(row + low.x, row + high.x, to);
        to[high.x - low.x] = row[high.x < from.size.x ? high.x : 0];
    }
    return quads;
}

/// Whether all of a coarser level is there that a tile's places lie in, and a texel about them: places are rounded.
bool HeightTiles::isThere(size_t level, glm::ivec2 tile, size_t coarser, const std::vector<uint32_t>& quads) const {
    const glm::ivec2 size = levels_->levels()[level].size, of = levels_->levels()[coarser].size;
    if (level == coarser) return quads[firsts_[level] + uint32_t(tile.y * tilesOf(level).x + tile.x)] != kNone;
    const glm::ivec2 first = tile * kEdge * of / size - 1,
                     last = (glm::min((tile + 1) * kEdge, size) * of - 1) / size + 1;
    // They are half a tile wide at most: they lie in two along an axis.
    const int across = tilesOf(coarser).x;
    for (const int y : {wrapped(first.y, of.y) / kEdge, wrapped(last.y, of.y) / kEdge})
        for (const int x : {wrapped(first.x, of.x) / kEdge, wrapped(last.x, of.x) / kEdge})
            if (quads[firsts_[coarser] + uint32_t(y * across + x)] == kNone) return false;
    return true;
}

std::vector<glm::uvec4> HeightTiles::table(const std::vector<uint32_t>& quads) const {
    std::vector<glm::uvec4> table(tableQuads(), glm::uvec4(0));
    for (size_t level = 0; level < levels(); ++level) {
        const glm::ivec2 size = levels_->levels()[level].size, tiles = tilesOf(level);
        const auto texels = float(double(size.y) / levels_->rows());
        table[level] = {entry(firsts_[level]), uint32_t(size.x), uint32_t(size.y), std::bit_cast<uint32_t>(texels)};
        for (uint32_t tile = firsts_[level]; tile < firsts_[level + 1]; ++tile) {
            size_t has = level;
            const int number = int(tile - firsts_[level]);
            while (has + 1 < levels() && !isThere(level, {number % tiles.x, number / tiles.x}, has, quads)) ++has;
            const uint32_t quad = has == level ? quads[tile] : 0;
            table[entry(tile) / 4][int(entry(tile) % 4)] = uint32_t(has) << kQuadBits | quad;
        }
    }
    return table;
}

}  // namespace vcp::meso
