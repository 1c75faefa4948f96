#include "streaming/shard/shard_images.h"

#include <algorithm>

namespace vcp {

Result<ShardImages> coarseImages(const ByteReader& reader, const FileHeader& header) {
    VCP_TRY_ASSIGN(const auto all, readImageTables(reader, header.images));
    ShardImages coarse;
    coarse.tables.materials = all.materials;
    coarse.tables.channels = all.channels;
    for (const ImageRow& image : all.images) {
        const auto levels = levelsOf(image);
        const auto finest =
            std::find_if(levels.begin(), levels.end(), [](const ImageLevel& level) { return level.tiles() == 1; });
        // Coarse levels are first in the table of tiles, and have a tile each.
        const auto count = uint32_t(levels.end() - finest);
        coarse.tables.images.push_back(
            {finest->width, finest->height, count, image.coding, coarse.tables.tiles.size()});
        VCP_TRY_ASSIGN(const auto stored, readTiles(reader, all, image.firstTile, count));
        size_t from = 0;
        for (uint64_t tile = image.firstTile; tile < image.firstTile + count; ++tile) {
            coarse.tables.tiles.push_back(all.tiles[tile]);
            const auto begin = stored.bytes.begin() + std::ptrdiff_t(from);
            from += all.tiles[tile].storedBytes;
            coarse.tiles.emplace_back(begin, stored.bytes.begin() + std::ptrdiff_t(from));
        }
    }
    return coarse;
}

Result<void> appendImages(const ByteReader& reader, const FileHeader& header, VcpWriter& shard) {
    VCP_TRY_ASSIGN(const auto tables, readImageTables(reader, header.images));
    VCP_TRY(shard.beginImages(tables));
    const uint64_t begin = header.images.offset + tables.bytes();
    return readInPieces(reader, begin, header.images.offset + header.images.bytes - begin,
                        [&](std::span<const std::byte> piece) { return shard.appendTile(piece); });
}

}  // namespace vcp
