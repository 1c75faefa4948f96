#include "octree/image/image_set.h"

#include <algorithm>
#include <utility>

namespace vcp {

ImageSet::Level::Level(const ImageLevel& level)
    : width(level.width),
      height(level.height),
      log2Edge(uint32_t(std::countr_zero(level.tileEdge))),
      tilesX(level.tilesX()),
      tiles(level.tiles()) {}

ImageSet::ImageSet(const ImageTables& tables) : materials_(tables.materials), channels_(tables.channels) {
    for (const ImageRow& row : tables.images) {
        images_.push_back({row.width, row.height, row.levels, {}});
        for (const ImageLevel& level : levelsOf(row)) images_.back().levels.emplace_back(level);
    }
}

uint64_t ImageSet::Level::texelsOf(size_t i) const {
    const ImageLevel level{width, height, 0, 1u << log2Edge};
    const glm::uvec2 size = level.sizeOf({i % tilesX, i / tilesX});
    return uint64_t{size.x} * size.y;
}

const ChannelRow* ImageSet::channelsOf(uint32_t material) const {
    if (channels_.empty() || channels_[material].isGiven == 0) return nullptr;
    const ChannelRow& row = channels_[material];
    for (const uint32_t image : {row.normals, row.surface, row.emission})
        if (image != 0 && !images_[image - 1].isShown()) return nullptr;
    return &row;
}

void ImageSet::set(uint32_t number, uint32_t level, glm::uvec2 tile, Tile texels) {
    Image& image = images_[number];
    Level& to = image.levels[level];
    const size_t at = size_t{tile.y} * to.tilesX + tile.x;
    const uint64_t bytes = to.texelsOf(at) * sizeof(uint32_t);
    Tile& there = to.tiles[at];
    bytes_ += (texels ? bytes : 0) - (there ? bytes : 0);
    to.there += size_t{texels ? 1u : 0u} - size_t{there ? 1u : 0u};
    there = std::move(texels);
    if (there)
        image.finest = std::min(image.finest, level);
    else
        while (image.finest < image.levels.size() && image.levels[image.finest].there == 0) ++image.finest;
}

void ImageSet::shrinkTo(uint64_t mostBytes) {
    for (uint32_t level = 0; bytes_ > mostBytes; ++level)
        for (uint32_t image = 0; image < images_.size(); ++image) {
            if (level >= images_[image].levels.size()) continue;
            const Level& of = images_[image].levels[level];
            for (uint32_t tile = 0; tile < of.tiles.size() && bytes_ > mostBytes; ++tile)
                set(image, level, {tile % of.tilesX, tile / of.tilesX}, nullptr);
        }
}

}  // namespace vcp
