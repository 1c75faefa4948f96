#include "octree/image/image_set.h"

#include <algorithm>

namespace vcp {

std::vector<uint32_t> finestWithin(std::span<const ImageRow> images, uint64_t mostBytes) {
    std::vector<uint32_t> finest(images.size(), 0);
    std::vector<std::vector<ImageLevel>> levels;
    uint64_t bytes = 0;
    for (const ImageRow& image : images) {
        levels.push_back(imageLevels(image.width, image.height, 0));
        for (const ImageLevel& level : levels.back()) bytes += level.texels() * sizeof(uint32_t);
    }
    const auto largest = [&](size_t image) { return levels[image][finest[image]].texels(); };
    while (bytes > mostBytes) {
        size_t image = 0;
        for (size_t i = 1; i < images.size(); ++i)
            if (largest(i) > largest(image)) image = i;
        if (images.empty() || largest(image) == 1) break;
        bytes -= largest(image) * sizeof(uint32_t);
        ++finest[image];
    }
    return finest;
}

Result<ImageSet> ImageSet::read(const ByteReader& reader, const ImagesPlace& place, uint64_t mostBytes) {
    VCP_TRY_ASSIGN(const auto tables, readImageTables(reader, place));
    ImageSet set;
    set.materials_ = tables.materials;
    const std::vector<uint32_t> finest = finestWithin(tables.images, mostBytes);
    uint64_t kept = 0;
    for (size_t i = 0; i < tables.images.size(); ++i) {
        const auto levels = imageLevels(tables.images[i].width, tables.images[i].height, 0);
        for (const ImageLevel& level : std::span(levels).subspan(finest[i])) kept += level.texels();
    }
    set.texels_.reserve(kept);
    std::vector<uint32_t> texels(size_t{kImageTileEdge} * kImageTileEdge);
    for (size_t i = 0; i < tables.images.size(); ++i) {
        const ImageRow& row = tables.images[i];
        Image& image = set.images_.emplace_back(Image{row.width, row.height, finest[i], {}});
        const auto levels = imageLevels(row.width, row.height, row.firstTile);
        // The coarse levels come first, so that those which are kept lie together.
        const auto inMemory = std::span(levels).subspan(finest[i]);
        VCP_TRY_ASSIGN(const auto stored,
                       readTiles(reader, tables, row.firstTile,
                                 inMemory.front().firstTile + inMemory.front().tiles() - row.firstTile));
        for (const ImageLevel& level : inMemory) {
            const uint64_t first = set.texels_.size();
            image.levels.push_back({level.width, level.height, first});
            set.texels_.resize(first + level.texels());
            uint64_t number = level.firstTile;
            for (const glm::uvec2 tile : tileOrder(level)) {
                const glm::uvec2 size = level.sizeOf(tile);
                VCP_TRY(decodeTile(reader.name(), tables, stored, number++, size, texels));
                for (uint32_t y = 0; y < size.y; ++y)
                    std::copy_n(texels.begin() + std::ptrdiff_t(size_t{y} * size.x), size.x,
                                set.texels_.begin() +
                                    std::ptrdiff_t(first + (uint64_t{tile.y} * kImageTileEdge + y) * level.width +
                                                   uint64_t{tile.x} * kImageTileEdge));
            }
        }
    }
    return set;
}

}  // namespace vcp
