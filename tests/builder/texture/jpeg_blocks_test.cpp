// Tiles that are cut out of a JPEG show what the whole picture shows.
#include "builder/texture/jpeg_blocks.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "octree/image/jpeg_tile.h"
#include "tests/support/jpeg_files.h"

namespace vcp {
namespace {

using test::JpegKind, test::jpegOf;

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

class JpegBlocksOf : public ::testing::TestWithParam<JpegKind> {};

TEST_P(JpegBlocksOf, ShowWhatThePictureShows) {
    const JpegKind kind = GetParam();
    const std::string file = jpegOf(picture(300, 531), kind);
    const auto whole = decodeImage(file);
    ASSERT_TRUE(whole.ok());
    const auto blocks = JpegBlocks::read(file, 1 << 20);
    ASSERT_NE(blocks, nullptr);
    const ImageLevel level{300, 531, 0, kLargeTileEdge};
    size_t bytes = 0;
    for (const glm::uvec2 place : tileOrder(level)) {
        const glm::uvec2 size = level.sizeOf(place);
        const auto tile = blocks->tile(level, place);
        EXPECT_TRUE(isJpeg(tile));
        bytes += tile.size();
        std::vector<uint32_t> texels(size_t{size.x} * size.y);
        ASSERT_TRUE(unpackJpeg(tile, size, texels).ok());
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x) {
                const glm::uvec2 at = place * kLargeTileEdge + glm::uvec2(x, y);
                const uint32_t expected = whole->texels[size_t{at.y} * whole->width + at.x];
                const uint32_t found = texels[size_t{y} * size.x + x];
                // Where colour is halved, a texel at a tile's edge has it from the tile alone.
                const bool isInside = kind.isGrey || kind.sampling[0] * kind.sampling[1] == 1 ||
                                      (x > 0 && y > 0 && x + 1 < size.x && y + 1 < size.y);
                if (isInside) {
                    ASSERT_EQ(found, expected) << at.x << ' ' << at.y;
                } else {
                    for (int c = 0; c < 4; ++c)
                        ASSERT_NEAR(int(found >> 8 * c & 255u), int(expected >> 8 * c & 255u), 10);
                }
            }
    }
    // Besides their tables; a progressive picture is smaller than it would be otherwise.
    EXPECT_LT(double(bytes), double(file.size()) * (kind.progressive ? 1.1 : 1.0) + 6 * 700);
}

INSTANTIATE_TEST_SUITE_P(All, JpegBlocksOf,
                         ::testing::Values(JpegKind{}, JpegKind{.sampling = {1, 1}}, JpegKind{.sampling = {2, 1}},
                                           JpegKind{.sampling = {1, 2}}, JpegKind{.sampling = {4, 1}},
                                           JpegKind{.isGrey = true}, JpegKind{.progressive = true},
                                           JpegKind{.progressive = true, .quality = 40}));

TEST(JpegBlocks, AreNoneOfWhatCannotBeCut) {
    const std::string file = jpegOf(picture(300, 200));
    EXPECT_NE(JpegBlocks::read(file, 1 << 20), nullptr);
    EXPECT_EQ(JpegBlocks::read(file, 1 << 16), nullptr) << "too little memory";
    EXPECT_EQ(JpegBlocks::read("\x89PNG", 1 << 20), nullptr);
    EXPECT_EQ(JpegBlocks::read("", 1 << 20), nullptr);
    for (size_t bytes = 0; bytes < file.size(); bytes += 37)
        EXPECT_EQ(JpegBlocks::read(file.substr(0, bytes), 1 << 20), nullptr) << "cut off after " << bytes;
    EXPECT_EQ(JpegBlocks::read(jpegOf(picture(40, 40), {.sampling = {3, 1}}), 1 << 20), nullptr)
        << "blocks of 24 texels";
}

}  // namespace
}  // namespace vcp
