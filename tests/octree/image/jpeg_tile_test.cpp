// Tiles that are JPEGs come back nearly as they were, and opaque; hostile bytes are refused, or decode to as many
// texels as were asked for.
#include "octree/image/jpeg_tile.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>

#include <gtest/gtest.h>

namespace vcp {
namespace {

using Texels = std::vector<uint32_t>;

/// A smooth picture with a little noise, whose alpha is anything.
Texels pictureOf(glm::uvec2 size) {
    std::mt19937 random(5);
    Texels texels;
    for (uint32_t y = 0; y < size.y; ++y)
        for (uint32_t x = 0; x < size.x; ++x) {
            uint32_t texel = uint32_t(random()) << 24;
            for (int c = 0; c < 3; ++c) {
                const double wave = 110 + 80 * std::sin(0.05 * (c + 1) * x + 0.08 * y);
                texel |= uint32_t(wave + double(random() % 5)) << 8 * c;
            }
            texels.push_back(texel);
        }
    return texels;
}

TEST(JpegTile, TilesComeBackNearly) {
    for (const glm::uvec2 size :
         {glm::uvec2(1, 1), glm::uvec2(256, 256), glm::uvec2(1, 256), glm::uvec2(256, 3), glm::uvec2(17, 9)}) {
        const Texels texels = pictureOf(size);
        const auto packed = packJpeg(texels, size, 90);
        ASSERT_TRUE(packed.ok()) << packed.error().line();
        EXPECT_TRUE(isJpeg(*packed));
        Texels back(texels.size());
        ASSERT_TRUE(unpackJpeg(*packed, size, back).ok());
        int farthest = 0;
        for (size_t i = 0; i < texels.size(); ++i) {
            EXPECT_EQ(back[i] >> 24, 255u);
            for (int c = 0; c < 3; ++c)
                farthest = std::max(farthest, std::abs(int(texels[i] >> 8 * c & 255u) - int(back[i] >> 8 * c & 255u)));
        }
        EXPECT_LE(farthest, 12);
        EXPECT_EQ(*packJpeg(texels, size, 90), *packed);
        EXPECT_LE(packJpeg(texels, size, 30)->size(), packed->size());
    }
}

TEST(JpegTile, HostileBytesAreRefused) {
    const glm::uvec2 size(40, 24);
    const auto packed = packJpeg(pictureOf(size), size, 80);
    ASSERT_TRUE(packed.ok());
    Texels texels(size_t{size.x} * size.y);
    EXPECT_FALSE(unpackJpeg({}, size, texels).ok());
    for (size_t bytes = 0; bytes + 2 < packed->size(); ++bytes)
        EXPECT_FALSE(unpackJpeg(std::span(*packed).first(bytes), size, texels).ok()) << bytes;
    EXPECT_FALSE(unpackJpeg(*packed, {40, 23}, texels).ok()) << "a tile of another size";
    EXPECT_FALSE(unpackJpeg(*packed, {24, 40}, texels).ok()) << "a tile of another size";
    for (size_t bit = 0; bit < 8 * packed->size(); ++bit) {
        auto wrong = *packed;
        wrong[bit / 8] ^= std::byte{1} << int(bit % 8);
        static_cast<void>(unpackJpeg(wrong, size, texels));
    }
}

}  // namespace
}  // namespace vcp
