// Tiles come back texel for texel; hostile bytes are refused, or decode to as many texels as were asked for.
#include "octree/image/tile_codec.h"

#include <functional>
#include <random>

#include <gtest/gtest.h>

namespace vcp {
namespace {

using Texels = std::vector<uint32_t>;

Texels tileOf(glm::uvec2 size, const std::function<uint32_t(uint32_t x, uint32_t y)>& texel) {
    Texels texels;
    for (uint32_t y = 0; y < size.y; ++y)
        for (uint32_t x = 0; x < size.x; ++x) texels.push_back(texel(x, y));
    return texels;
}

TEST(TileCodec, TilesComeBack) {
    std::mt19937 random(7);
    const std::function<uint32_t(uint32_t, uint32_t)> kinds[] = {
        [&](uint32_t, uint32_t) { return uint32_t(random()); },
        [](uint32_t x, uint32_t y) { return x | y << 8 | (x + y) << 16 | 255u << 24; },
        [](uint32_t x, uint32_t y) { return (x / 3 + y / 5) % 2 == 0 ? 0u : ~0u; },
        [](uint32_t, uint32_t) { return 0xff8040c0u; },
        [&](uint32_t x, uint32_t) { return x * 0x010203u + uint32_t(random() % 4) * 0x01010101u; }};
    for (const glm::uvec2 size : {glm::uvec2(1, 1), glm::uvec2(64, 64), glm::uvec2(1, 64), glm::uvec2(64, 1),
                                  glm::uvec2(5, 3), glm::uvec2(2, 2)})
        for (const auto& kind : kinds) {
            const Texels texels = tileOf(size, kind);
            const auto packed = packTile(texels, size);
            Texels back(texels.size(), 1);
            ASSERT_TRUE(unpackTile(packed, size, back).ok());
            EXPECT_EQ(back, texels);
            EXPECT_EQ(packTile(back, size), packed);
        }
}

TEST(TileCodec, GradientsCostLittle) {
    const glm::uvec2 size(64, 64);
    const auto packed = packTile(tileOf(size, [](uint32_t x, uint32_t y) { return 0xff000000u | x | y << 8; }), size);
    EXPECT_LT(packed.size(), size_t{256}) << "of 16384 bytes";
}

TEST(TileCodec, HostileBytesAreRefused) {
    const glm::uvec2 size(16, 8);
    std::mt19937 random(1);
    const auto packed =
        packTile(tileOf(size, [&](uint32_t, uint32_t) { return uint32_t(random()) & 0x3f3f3f3fu; }), size);
    Texels texels(size_t{size.x} * size.y);
    EXPECT_FALSE(unpackTile({}, size, texels).ok());
    for (size_t bytes = 0; bytes < packed.size(); ++bytes)
        EXPECT_FALSE(unpackTile(std::span(packed).first(bytes), size, texels).ok()) << bytes;
    EXPECT_FALSE(unpackTile(packed, {16, 7}, texels).ok()) << "a tile of another size";
    for (size_t bit = 0; bit < 8 * packed.size(); ++bit) {
        auto wrong = packed;
        wrong[bit / 8] ^= std::byte{1} << int(bit % 8);
        static_cast<void>(unpackTile(wrong, size, texels));
    }
}

}  // namespace
}  // namespace vcp
