// Files with images, for tests of what reads them.
#pragma once

#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "octree/image/image_assembly.h"
#include "octree/image/tile_codec.h"
#include "octree/io/content_hash.h"
#include "octree/vcp_writer.h"

namespace vcp::test {

/// An image as a file has it: the texels of each level, the finest first.
struct LevelledImage {
    uint32_t width, height;
    std::vector<std::vector<uint32_t>> levels;
};

inline LevelledImage randomImage(uint32_t width, uint32_t height, uint32_t seed) {
    std::mt19937 random(seed);
    LevelledImage image{width, height, {}};
    for (const ImageLevel& level : imageLevels(width, height, 0)) {
        image.levels.emplace_back();
        for (uint64_t i = 0; i < level.texels(); ++i) image.levels.back().push_back(uint32_t(random()));
    }
    return image;
}

/// Returns the texels of a level, row by row; 0 where they are not in memory.
inline std::vector<uint32_t> texelsOf(const ImageSet::Level& level) {
    std::vector<uint32_t> texels;
    for (uint32_t y = 0; y < level.height; ++y)
        for (uint32_t x = 0; x < level.width; ++x) {
            const uint32_t* const tile = level.tileOf(x, y);
            texels.push_back(tile != nullptr ? tile[level.placeInTile(x, y)] : 0);
        }
    return texels;
}

/// Tables of images, and the stored tiles.
struct StoredImages {
    ImageTables tables;
    std::vector<std::vector<std::byte>> tiles;

    void add(const LevelledImage& image, uint32_t coding = kLosslessTiles) {
        tables.images.push_back(
            {image.width, image.height, uint32_t(image.levels.size()), coding, tables.tiles.size()});
        const auto levels = levelsOf(tables.images.back());
        for (size_t l = levels.size(); l-- > 0;)
            for (const glm::uvec2 tile : tileOrder(levels[l])) {
                const glm::uvec2 size = levels[l].sizeOf(tile);
                std::vector<uint32_t> texels;
                for (uint32_t y = 0; y < size.y; ++y)
                    for (uint32_t x = 0; x < size.x; ++x)
                        texels.push_back(image.levels[l][size_t{tile.y * levels[l].tileEdge + y} * levels[l].width +
                                                         tile.x * levels[l].tileEdge + x]);
                tiles.push_back(packTile(texels, size));
                tables.tiles.push_back({0, hashBytes(tiles.back()), uint32_t(tiles.back().size()), 0});
            }
    }
};

/// Writes a file of one empty page with images.
inline void writeImageFile(const std::filesystem::path& path, const StoredImages& images) {
    PageHeader page;
    page.log2Cells = 2;
    page.root = emptyNode(0);
    FileHeader header;
    header.cell = 1;
    header.log2Cells = 2;
    header.levels = 1;
    header.level[0].pages = 1;
    header.flags = kFlagColour | kFlagParts;
    auto writer = VcpWriter::create(path, 1);
    ASSERT_TRUE(writer.ok()) << writer.error().line();
    ASSERT_TRUE((*writer)->append({}, compressPage(std::as_bytes(std::span(&page, 1)), {})).ok());
    ASSERT_TRUE((*writer)->beginImages(images.tables).ok());
    for (const auto& tile : images.tiles) ASSERT_TRUE((*writer)->appendTile(tile).ok());
    const auto bytes = (*writer)->commit(header);
    ASSERT_TRUE(bytes.ok()) << bytes.error().line();
    EXPECT_EQ(*bytes, std::filesystem::file_size(path));
}

}  // namespace vcp::test
