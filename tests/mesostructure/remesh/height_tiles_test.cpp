// Tiles of height levels: all texels are in them, and entries say where each place's finest heights are.
#include "mesostructure/remesh/height_tiles.h"

#include <random>

#include <gtest/gtest.h>

namespace vcp::meso {
namespace {

constexpr int kEdge = RemeshMath<float>::kRemeshTileEdge;

HeightTiles tilesOf(glm::ivec2 size) {
    std::vector<uint16_t> heights;
    std::mt19937 random(size.x);
    for (int i = 0; i < size.x * size.y; ++i) heights.push_back(uint16_t(random()));
    const HeightMap map{size, 1, std::move(heights)};
    return HeightTiles(std::make_shared<const HeightLevels>(*HeightLevels::build(map, {.fit = LevelFit::Averaged})));
}

glm::ivec2 tilesAlong(const HeightTiles& tiles, size_t level) {
    return (tiles.heights()->levels()[level].size + (kEdge - 1)) / kEdge;
}

TEST(HeightTiles, HaveAllTexelsAndThoseAfterThem) {
    for (const glm::ivec2 size : {glm::ivec2(300, 129), glm::ivec2(128, 256), glm::ivec2(1, 3)}) {
        const HeightTiles tiles = tilesOf(size);
        for (size_t level = 0; level < tiles.levels(); ++level) {
            const HeightLevel& of = tiles.heights()->levels()[level];
            const glm::ivec2 along = tilesAlong(tiles, level);
            for (int j = 0; j < of.size.y; ++j)
                for (int i = 0; i < of.size.x; ++i) {
                    const uint32_t tile = tiles.first(level) + uint32_t(j / kEdge * along.x + i / kEdge);
                    static std::pair<uint32_t, std::vector<glm::uvec4>> last{~0u, {}};
                    if (i % kEdge == 0) last = {tile, tiles.texels(tile)};
                    const auto* texels = reinterpret_cast<const uint16_t*>(last.second.data());
                    const int at = j % kEdge * (kEdge + 1) + i % kEdge;
                    const auto texel = [&](int x, int y) {
                        return of.texels[size_t(x % of.size.x + of.size.x * (y % of.size.y))];
                    };
                    ASSERT_EQ(texels[at], texel(i, j)) << level << ": " << i << ", " << j;
                    ASSERT_EQ(texels[at + 1], texel(i + 1, j));
                    ASSERT_EQ(texels[at + kEdge + 1], texel(i, j + 1));
                    ASSERT_EQ(texels[at + kEdge + 2], texel(i + 1, j + 1));
                }
        }
    }
}

TEST(HeightTiles, EntriesNameTheFinestLevelThatIsThereAtAllTexels) {
    const HeightTiles tiles = tilesOf({1001, 700});
    std::mt19937 random(7);
    for (const uint32_t part : {0u, 1u, 2u, 3u, 4u}) {
        std::vector<uint32_t> quads;
        for (uint32_t tile = 0; tile < tiles.count(); ++tile)
            quads.push_back(tile + 1 == tiles.count() || random() % 4 < part ? 1000 + tile : HeightTiles::kNone);
        const auto table = tiles.table(quads);
        ASSERT_EQ(table.size(), tiles.tableQuads());
        for (size_t level = 0; level < tiles.levels(); ++level) {
            const glm::ivec2 size = tiles.heights()->levels()[level].size, along = tilesAlong(tiles, level);
            EXPECT_EQ(table[level], glm::uvec4(tiles.entry(tiles.first(level)), size.x, size.y, table[level].w));
            for (int number = 0; number < along.x * along.y; ++number) {
                const uint32_t tile = tiles.first(level) + uint32_t(number);
                const uint32_t entry = table[tiles.entry(tile) / 4][int(tiles.entry(tile) % 4)];
                const size_t has = entry >> RemeshMath<float>::kRemeshQuadBits;
                if (has == level) {
                    EXPECT_EQ(entry & 0x7ffffff, quads[tile]);
                }
                // A coarser level must have the texels about those that places of the tile lie in, too.
                const auto isAllThere = [&](size_t in) {
                    const glm::ivec2 low = glm::ivec2(number % along.x, number / along.x) * kEdge,
                                     high = glm::min(low + kEdge, size), of = tiles.heights()->levels()[in].size;
                    const int about = in == level ? 0 : 1;
                    const glm::ivec2 first = low * of / size - about, last = (high * of - 1) / size + about;
                    for (int j = first.y; j <= last.y; ++j)
                        for (int i = first.x; i <= last.x; ++i) {
                            const glm::ivec2 at(wrapped(i, of.x) / kEdge, wrapped(j, of.y) / kEdge);
                            if (quads[tiles.first(in) + uint32_t(at.y * tilesAlong(tiles, in).x + at.x)] ==
                                HeightTiles::kNone)
                                return false;
                        }
                    return true;
                };
                for (size_t in = level; in <= has; ++in) ASSERT_EQ(isAllThere(in), in == has) << level << " " << number;
            }
        }
    }
}

}  // namespace
}  // namespace vcp::meso
