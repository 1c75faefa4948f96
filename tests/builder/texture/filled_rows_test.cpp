// What is transparent gets the colours of what is about it.
#include "builder/texture/filled_rows.h"

#include <gtest/gtest.h>

#include "builder/texture/texture.h"
#include "tests/support/png_files.h"

namespace vcp {
namespace {

using ColourAt = std::function<Rgba8(uint32_t x, uint32_t y)>;

constexpr Rgba8 kGreen = 0xFF20A040, kRed = 0xFF1010C0;

Material cutOutMaterial(uint32_t width, uint32_t height, const ColourAt& colour) {
    std::string rows;
    for (uint32_t y = 0; y < height; ++y) {
        rows += '\0';
        for (uint32_t x = 0; x < width; ++x)
            for (int shift = 0; shift < 32; shift += 8) rows += char(colour(x, y) >> shift);
    }
    Material material;
    material.image.bytes = std::make_shared<const std::string>(test::pngFile(width, height, 8, 6, rows));
    material.isCutOut = true;
    return material;
}

TEST(FilledRows, TransparentTexelsTakeTheColourOfTheLeastBlockAboutThem) {
    // Green on the left, red on the right, and black that is transparent in between and in most of both.
    const auto colour = [](uint32_t x, uint32_t y) -> Rgba8 {
        if (y % 4 != 1) return 0;
        return x < 40 ? kGreen : x >= 88 ? kRed : 0;
    };
    const auto image = loadImage(cutOutMaterial(128, 70, colour));
    ASSERT_TRUE(image.ok());
    for (uint32_t y = 0; y < 70; ++y)
        for (uint32_t x = 0; x < 128; ++x) {
            const Rgba8 texel = image->texels[y * 128 + x];
            EXPECT_EQ(texel >> 24, 255u);
            if (x < 40 || x >= 88) {
                EXPECT_EQ(texel, x < 40 ? kGreen : kRed) << x << ' ' << y;
            }
            EXPECT_NE(texel, 0xFF000000) << x << ' ' << y;
        }
}

TEST(FilledRows, WhatIsNotQuiteTransparentKeepsItsColour) {
    const auto colour = [](uint32_t x, uint32_t) -> Rgba8 { return (kGreen & 0xFFFFFF) | Rgba8(x) << 24; };
    const Material material = cutOutMaterial(256, 1, colour);
    const auto filled = loadImage(material);
    ASSERT_TRUE(filled.ok());
    for (uint32_t x = 0; x < 256; ++x) EXPECT_EQ(filled->texels[x], kGreen) << x;
    // Glass: here dark, there light.
    const auto glass = loadImage(
        cutOutMaterial(64, 64, [](uint32_t x, uint32_t) -> Rgba8 { return x % 2 == 0 ? 0x50101010 : 0x50F0F0F0; }));
    ASSERT_TRUE(glass.ok());
    for (uint32_t x = 0; x < 64; ++x) EXPECT_EQ(glass->texels[x], x % 2 == 0 ? 0xFF101010 : 0xFFF0F0F0);
}

TEST(FilledRows, AMaskOfItsOwnSaysWhatIsThere) {
    // White all around, as the alpha of another image says, which is half as large; or as its grey says.
    const auto colour = [](uint32_t x, uint32_t) -> Rgba8 { return x < 32 ? kGreen : 0xFFFFFFFF; };
    const auto alpha = [](uint32_t x, uint32_t) -> Rgba8 { return x < 16 ? 0xFF000000 : 0; };
    Material material = cutOutMaterial(64, 64, colour);
    material.ignoresAlpha = true;
    material.mask.image.bytes = cutOutMaterial(32, 32, alpha).image.bytes;
    EXPECT_EQ(loadImage(material)->texels, std::vector<Rgba8>(64 * 64, kGreen));
    std::string rows;
    for (int y = 0; y < 32; ++y) rows += '\0' + std::string(16, char(255)) + std::string(16, '\0');
    material.mask.image.bytes = std::make_shared<const std::string>(test::pngFile(32, 32, 8, 0, rows));
    EXPECT_EQ(loadImage(material)->texels, std::vector<Rgba8>(64 * 64, kGreen));
    const auto grey = [](uint32_t x, uint32_t) -> Rgba8 { return x < 16 ? 0xFFFFFFFF : 0xFF000000; };
    material.mask.image.bytes = cutOutMaterial(32, 32, grey).image.bytes;
    EXPECT_EQ(loadImage(material)->texels, std::vector<Rgba8>(64 * 64, kGreen));
    // Over other coordinates, or broken, it says nothing.
    material.mask.uvScale = {2, 1};
    EXPECT_EQ(loadImage(material)->texels[40], 0xFFFFFFFF);
    material.mask.uvScale = {1, 1};
    material.mask.image.bytes = std::make_shared<const std::string>("broken");
    EXPECT_EQ(loadImage(material)->texels[40], 0xFFFFFFFF);
}

TEST(FilledRows, AnImageWithoutAnythingIsOpaqueAndOneThatIsNotCutStaysAsItIs) {
    const auto nothing = [](uint32_t, uint32_t) -> Rgba8 { return 0x00FFFFFF; };
    Material material = cutOutMaterial(20, 20, nothing);
    const auto filled = loadImage(material);
    ASSERT_TRUE(filled.ok());
    for (const Rgba8 texel : filled->texels) EXPECT_EQ(texel, 0xFF000000);
    material.isCutOut = false;
    EXPECT_EQ(loadImage(material)->texels[0], 0x00FFFFFFu);
}

TEST(FilledRows, ReadsRowsHoweverManyAtATimeAndSaysWhatIsDamaged) {
    const auto colour = [](uint32_t x, uint32_t y) -> Rgba8 { return x < y ? kGreen : 0x00FFFFFF; };
    Material material = cutOutMaterial(50, 60, colour);
    const auto whole = loadImage(material);
    const auto rows = openImage(material);
    ASSERT_TRUE(whole.ok() && rows.ok());
    std::vector<Rgba8> texels(50 * 60);
    size_t at = 0;
    for (const size_t count : {1, 7, 32, 20}) {
        ASSERT_TRUE((*rows)->read(std::span(texels).subspan(at, count * 50)).ok());
        at += count * 50;
    }
    EXPECT_EQ(texels, whole->texels);
    material.image.bytes =
        std::make_shared<const std::string>(material.image.bytes->substr(0, material.image.bytes->size() - 40));
    const auto damaged = openImage(material);
    EXPECT_FALSE(damaged.ok() && (*damaged)->read(texels).ok());
}

}  // namespace
}  // namespace vcp
