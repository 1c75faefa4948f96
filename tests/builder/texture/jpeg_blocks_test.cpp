// Tiles that are cut out of a JPEG show what the whole picture shows.
#include "builder/texture/jpeg_blocks.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "builder/texture/image.h"
#include "octree/image/jpeg_tile.h"
#include "tests/support/jpeg_files.h"

namespace vcp {
namespace {

using test::JpegKind, test::jpegOf;

constexpr jpeg_scan_info kMeansOnly{
    .comps_in_scan = 3, .component_index = {0, 1, 2}, .Ss = 0, .Se = 0, .Ah = 0, .Al = 0};

Image picture(uint32_t width, uint32_t height) {
    std::mt19937 random(3);
    Image image{width, height, {}};
    for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x) {
            uint32_t texel = 0xff000000u;
            for (int c = 0; c < 3; ++c)
                texel |= uint32_t(120 + 90 * std::sin(0.03 * (c + 1) * x - 0.05 * y) + double(random() % 8)) << 8 * c;
            image.texels.push_back(texel);
        }
    return image;
}

/// A picture that is decoded, and its blocks, one row of tiles after the other.
struct RowsOfTiles {
    std::string file;
    std::unique_ptr<ImageRows> rows;
    std::vector<Rgba8> texels;  ///< of the row of tiles that was read last
    uint32_t done = 0;          ///< rows of texels

    explicit RowsOfTiles(std::string bytes) : file(std::move(bytes)) {
        auto opened = ImageRows::open(randomBytesAt(file));
        if (opened) rows = *std::move(opened);
    }
    /// Reads the next row of tiles. Returns its blocks; null where there are none, or it cannot be read.
    const JpegBlocks* next() {
        if (!rows) return nullptr;
        const uint32_t count = std::min(kLargeTileEdge, rows->size().y - done);
        done += count;
        texels.resize(size_t{count} * rows->size().x);
        return rows->read(texels) ? rows->blocks() : nullptr;
    }
};

class JpegBlocksOf : public ::testing::TestWithParam<JpegKind> {
protected:
    /// Cuts a picture of that size into tiles, and compares what they decode to.
    static void compare(uint32_t width, uint32_t height) {
        const JpegKind kind = GetParam();
        const bool hasAllColours = kind.colours == JCS_GRAYSCALE || kind.sampling[0] * kind.sampling[1] == 1;
        const std::string file = jpegOf(picture(width, height), kind);
        const auto whole = decodeImage(file);
        ASSERT_TRUE(whole.ok());
        RowsOfTiles rows(file);
        const JpegBlocks* blocks = nullptr;
        const ImageLevel level{width, height, 0, kLargeTileEdge};
        size_t bytes = 0;
        for (uint32_t i = 0; i < level.tiles(); ++i) {
            const glm::uvec2 place(i % level.tilesX(), i / level.tilesX()), size = level.sizeOf(place);
            if (place.x == 0) {
                blocks = rows.next();
                ASSERT_NE(blocks, nullptr) << place.y;
                EXPECT_TRUE(std::equal(rows.texels.begin(), rows.texels.end(),
                                       whole->texels.begin() + size_t{place.y} * kLargeTileEdge * width));
            }
            const auto tile = blocks->tile(level, place);
            EXPECT_EQ(tile.empty(), size.x <= 4 && width > 4) << "few columns are decoded in another way";
            if (tile.empty()) continue;
            bytes += tile.size();
            std::vector<uint32_t> texels(size_t{size.x} * size.y);
            ASSERT_TRUE(isJpeg(tile) && unpackJpeg(tile, size, texels));
            for (uint32_t y = 0; y < size.y; ++y)
                for (uint32_t x = 0; x < size.x; ++x) {
                    const glm::uvec2 at = place * kLargeTileEdge + glm::uvec2(x, y);
                    const uint32_t expected = whole->texels[size_t{at.y} * whole->width + at.x];
                    const uint32_t found = texels[size_t{y} * size.x + x];
                    // Where colour is halved, a texel at a tile's edge has it from the tile alone.
                    const bool isInside = x > 0 && y > 0 && x + 1 < size.x && y + 1 < size.y;
                    if (hasAllColours || isInside) {
                        ASSERT_EQ(found, expected) << at.x << ' ' << at.y;
                    }
                    for (int c = 0; c < 4; ++c)
                        ASSERT_NEAR(int(found >> 8 * c & 255u), int(expected >> 8 * c & 255u),
                                    kind.quality < 90 ? 30 : 10);
                }
        }
        // Besides their tables; the other kinds of coding are smaller than a baseline's.
        EXPECT_LT(double(bytes), double(file.size()) * (kind.progressive || kind.isArithmetic ? 1.2 : 1.0) + 6 * 700);
    }
};

TEST_P(JpegBlocksOf, ShowWhatThePictureShows) {
    compare(300, 531);
    compare(260, 300);
    compare(261, 257);
    compare(40, 1300);
    compare(3, 70);
}

INSTANTIATE_TEST_SUITE_P(All, JpegBlocksOf,
                         ::testing::Values(JpegKind{}, JpegKind{.sampling = {1, 1}}, JpegKind{.sampling = {2, 1}},
                                           JpegKind{.sampling = {1, 2}}, JpegKind{.sampling = {4, 1}},
                                           JpegKind{.colours = JCS_GRAYSCALE}, JpegKind{.progressive = true},
                                           JpegKind{.progressive = true, .quality = 40},
                                           JpegKind{.isArithmetic = true}));

TEST(JpegBlocks, KnowTheirQuality) {
    for (const int quality : {1, 30, 50, 75, 90, 95, 100})
        EXPECT_EQ(RowsOfTiles(jpegOf(picture(20, 20), {.quality = quality})).next()->quality(), quality);
}

TEST(JpegBlocks, AreNoneOfWhatCannotBeCut) {
    const std::string file = jpegOf(picture(300, 200));
    const auto haveBlocks = [](const std::string& bytes) { return RowsOfTiles(bytes).next() != nullptr; };
    EXPECT_TRUE(haveBlocks(file));
    EXPECT_FALSE(haveBlocks("\x89PNG"));
    EXPECT_FALSE(haveBlocks(""));
    for (size_t bytes = 0; bytes < file.size(); bytes += 37)
        EXPECT_FALSE(haveBlocks(file.substr(0, bytes))) << "cut off after " << bytes;
    EXPECT_FALSE(haveBlocks(jpegOf(picture(40, 40), {.sampling = {3, 1}}))) << "blocks of 24 texels";
    EXPECT_FALSE(haveBlocks(jpegOf(picture(40, 40), {.colours = JCS_RGB})));
    EXPECT_FALSE(haveBlocks(jpegOf(picture(40, 40), {.scans = {kMeansOnly}}))) << "it lacks bits";
}

// Whatever its height, a picture of one scan keeps a row of tiles and what its decoder is ahead.
TEST(JpegBlocks, KeepARowOfTiles) {
    for (const bool isProgressive : {false, true}) {
        SCOPED_TRACE(isProgressive);
        const JpegKind kind{.progressive = isProgressive, .sampling = {1, 1}};
        RowsOfTiles low(jpegOf(picture(64, 600), kind)), high(jpegOf(picture(64, 1800), kind));
        ASSERT_TRUE(low.rows && high.rows);
        EXPECT_EQ(low.rows->heldBytes() == high.rows->heldBytes(), !isProgressive);
        EXPECT_GE(low.rows->heldBytes(), 6u * 64 * 256);
        if (!isProgressive) {
            EXPECT_LT(low.rows->heldBytes(), 6u * 72 * 280);
        }
        const ImageLevel level{64, 1800, 0, kLargeTileEdge};
        ASSERT_NE(high.next(), nullptr);
        const JpegBlocks* const blocks = high.next();
        ASSERT_NE(blocks, nullptr);
        EXPECT_FALSE(blocks->tile(level, {0, 1}).empty());
        EXPECT_EQ(blocks->tile(level, {0, 0}).empty(), !isProgressive) << "it went";
        EXPECT_EQ(blocks->tile(level, {0, 3}).empty(), !isProgressive) << "it has not come";
    }
}

// A file's tiles are what JpegBlocks and packJpeg() write, and nothing else.
TEST(JpegTile, OtherKindsAreRefused) {
    const glm::uvec2 size(40, 40);
    std::vector<uint32_t> texels(size_t{size.x} * size.y);
    const auto isTaken = [&](const JpegKind& kind) {
        const std::string file = jpegOf(picture(size.x, size.y), kind);
        return unpackJpeg(std::as_bytes(std::span(file)), size, texels).ok();
    };
    EXPECT_TRUE(isTaken({}));
    EXPECT_TRUE(isTaken({.colours = JCS_GRAYSCALE}));
    EXPECT_FALSE(isTaken({.colours = JCS_RGB}));
    EXPECT_FALSE(isTaken({.progressive = true}));
    EXPECT_FALSE(isTaken({.isArithmetic = true}));
    std::vector<jpeg_scan_info> scans;
    for (int channel = 0; channel < 3; ++channel)
        scans.push_back({.comps_in_scan = 1, .component_index = {channel}, .Ss = 0, .Se = 63, .Ah = 0, .Al = 0});
    EXPECT_FALSE(isTaken({.scans = scans}));
}

}  // namespace
}  // namespace vcp
