#include "builder/texture/texture.h"

#include <cmath>
#include <fstream>
#include <random>

#include <gtest/gtest.h>
#include <png.h>

#include "builder/stream/colour_encoding.h"
#include "builder/texture/png_chunks.h"
#include "tests/support/jpeg_files.h"
#include "tests/support/peak_memory.h"
#include "tests/support/png_files.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

Rgba8 texelOf(unsigned r, unsigned g, unsigned b, unsigned a = 255) { return r | g << 8 | b << 16 | a << 24; }

Image noise(uint32_t width, uint32_t height, unsigned seed) {
    std::mt19937 random(seed);
    Image image{width, height, {}};
    for (uint32_t i = 0; i < width * height; ++i) image.texels.push_back(static_cast<Rgba8>(random()) | 0xFF000000);
    return image;
}

std::string pngOf(const Image& image) {
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    png.width = image.width;
    png.height = image.height;
    png.format = PNG_FORMAT_RGBA;
    png_alloc_size_t bytes = 0;
    png_image_write_to_memory(&png, nullptr, &bytes, 0, image.texels.data(), 0, nullptr);
    std::string file(bytes, '\0');
    png_image_write_to_memory(&png, file.data(), &bytes, 0, image.texels.data(), 0, nullptr);
    file.resize(bytes);
    return file;
}

using test::jpegOf;

TEST(Image, DecodesPngExactlyAndJpegNearly) {
    const Image image = noise(37, 11, 1);
    const auto png = decodeImage(pngOf(image));
    ASSERT_TRUE(png.ok()) << png.error().line();
    EXPECT_EQ(png->texels, image.texels);
    Image flat{32, 8, std::vector<Rgba8>(256, texelOf(200, 100, 50))};
    for (const bool progressive : {false, true}) {
        const auto jpeg = decodeImage(jpegOf(flat, {.progressive = progressive}));
        ASSERT_TRUE(jpeg.ok()) << jpeg.error().line();
        ASSERT_EQ(jpeg->texels.size(), 256u);
        EXPECT_NEAR(jpeg->texels[77] & 0xFF, 200, 3);
        EXPECT_NEAR(jpeg->texels[77] >> 16 & 0xFF, 50, 3);
        EXPECT_EQ(jpeg->texels[77] >> 24, 255u);
    }
}

TEST(Image, EveryTruncationIsAnError) {
    const Image image = noise(16, 16, 2);
    for (const std::string& file : {pngOf(image), jpegOf(image), jpegOf(image, {.progressive = true})})
        for (size_t kept = 0; kept + 12 < file.size(); ++kept)
            EXPECT_FALSE(decodeImage(file.substr(0, kept)).ok()) << kept << " of " << file.size();
}

TEST(Image, FlippedBytesAreReadOrRefused) {
    const Image image = noise(16, 16, 3);
    std::mt19937 random(4);
    size_t refused = 0;
    for (const std::string& file : {pngOf(image), jpegOf(image), jpegOf(image, {.progressive = true})})
        for (int i = 0; i < 300; ++i) {
            std::string broken = file;
            broken[random() % broken.size()] ^= char(1 + random() % 255);
            const auto decoded = decodeImage(broken, {.edge = 4096, .bytes = 1 << 24, .fileBytes = 1 << 24});
            refused += !decoded.ok();
            if (!decoded.ok()) {
                EXPECT_EQ(decoded.error().line().find('\n'), std::string::npos);
            }
        }
    EXPECT_GT(refused, 100u);
}

TEST(Image, LimitsHoldBeforeTexelsAreAllocated) {
    const std::string file = pngOf(noise(100, 10, 5));
    EXPECT_EQ(decodeImage(file, {.edge = 99, .bytes = 1 << 20, .fileBytes = 1 << 20}).error().code, ErrorCode::Limit);
    EXPECT_EQ(decodeImage(file, {.edge = 100, .bytes = 3999, .fileBytes = 1 << 20}).error().code, ErrorCode::Limit);
    EXPECT_TRUE(decodeImage(file, {.edge = 100, .bytes = 4000, .fileBytes = 1 << 20}).ok());
    EXPECT_EQ(decodeImage("GIF89a").error().code, ErrorCode::Unsupported);
}

/// Returns all bytes that PngBytes has of a file.
std::string withoutText(std::string_view file) {
    const auto bytes = randomBytesAt(file);
    std::string kept(file.size(), '\0');
    kept.resize(*PngBytes(*bytes).read(kept.data(), kept.size()));
    return kept;
}

TEST(Image, TextOfAPngIsNotInflated) {
    const std::string row("\0\x10\x20\x30\x40\x50\x60", 7);  // two texels of RGB
    const std::string plain = test::pngFile(2, 1, 8, 2, row);
    const std::string gamma = test::pngChunk("gAMA", test::bigEndian(100000));
    const std::string bombs = test::textBombs(100), profile = test::pngChunk("iCCP", "a");
    EXPECT_LT(bombs.size(), 1u << 20);
    EXPECT_EQ(withoutText(test::pngFile(2, 1, 8, 2, row, bombs + gamma + gamma)),
              test::pngFile(2, 1, 8, 2, row, gamma));
    EXPECT_EQ(withoutText(plain), plain);
    const std::string unknown = test::pngFile(2, 1, 8, 2, row, test::pngChunk("ABCD", "critical"));
    EXPECT_EQ(withoutText(unknown), unknown);
    EXPECT_FALSE(decodeImage(unknown).ok());
    for (size_t kept = 0; kept < plain.size(); ++kept)
        EXPECT_EQ(withoutText(plain.substr(0, kept)), plain.substr(0, kept)) << kept;

    const uint64_t before = test::peakBytes();
    const auto read = decodeImage(test::pngFile(2, 1, 8, 2, row, bombs + profile));
    ASSERT_TRUE(read.ok()) << read.error().line();
    if (test::kMemoryIsMeasured) {
        EXPECT_LT(test::peakBytes() - before, 64u << 20) << "of some 800";
    }
    EXPECT_EQ(read->texels, decodeImage(plain)->texels);
    // Its gamma still counts: 0x40 as light is 0x89 as a colour.
    const auto linear = decodeImage(test::pngFile(2, 1, 8, 2, row, bombs + gamma));
    ASSERT_TRUE(linear.ok()) << linear.error().line();
    EXPECT_NEAR(linear->texels[1] & 0xFF, 0x89, 1);
}

TEST(Image, SizesAreCheckedAgainstTheBytesThatAreThere) {
    const auto refused = [](const std::string& file, ErrorCode code, const char* part) {
        const auto image = decodeImage(file);
        ASSERT_FALSE(image.ok()) << part;
        EXPECT_EQ(image.error().code, code) << image.error().line();
        EXPECT_NE(image.error().line().find(part), std::string::npos) << image.error().line();
    };
    for (const bool isInterlaced : {false, true})
        for (const auto& [bits, type] : {std::pair(1, 3), std::pair(8, 0), std::pair(16, 6)})
            refused(test::pngFile(8000, 8000, bits, type, "few", "", isInterlaced), ErrorCode::InvalidInput,
                    "cannot hold 8000 by 8000");
    refused(test::pngFile(0x7FFFFFFF, 1, 8, 0, "few"), ErrorCode::InvalidInput, "cannot hold");
    refused(test::pngFile(8, 8, 8, 5, "few"), ErrorCode::InvalidInput, "no header");
    std::string file = jpegOf(noise(64, 64, 6));
    const size_t frame = file.find("\xFF\xC0");
    ASSERT_NE(frame, std::string::npos);
    file.replace(frame + 5, 4, std::string("\x20\0\x20\0", 4));
    refused(file, ErrorCode::InvalidInput, "cannot hold 8192 by 8192");
    // What deflate makes smallest is not refused.
    EXPECT_TRUE(decodeImage(test::pngFile(4000, 4000, 8, 0, std::string(4001 * 4000, '\0'))).ok());
    const auto blank =
        decodeImage(jpegOf({2048, 2048, std::vector<Rgba8>(2048 * 2048, kWhite)}, {.progressive = true}));
    EXPECT_TRUE(blank.ok()) << blank.error().line();
}

// Each scan is the whole picture again.
TEST(Image, AJpegOfManyScansIsRefused) {
    // A scan for each coefficient of each channel, as the rules have it.
    std::vector<jpeg_scan_info> scans{
        {.comps_in_scan = 3, .component_index = {0, 1, 2}, .Ss = 0, .Se = 0, .Ah = 0, .Al = 0}};
    for (int channel = 0; channel < 3; ++channel)
        for (int i = 1; i < 64; ++i)
            scans.push_back({.comps_in_scan = 1, .component_index = {channel}, .Ss = i, .Se = i, .Ah = 0, .Al = 0});
    const Image picture = noise(16, 16, 7);
    ASSERT_GT(scans.size(), 150u);
    const auto image = decodeImage(jpegOf(picture, {.scans = scans}));
    ASSERT_FALSE(image.ok());
    EXPECT_EQ(image.error().code, ErrorCode::Limit) << image.error().line();
    EXPECT_NE(image.error().line().find("more than 100 scans"), std::string::npos) << image.error().line();
}

TEST(Image, AProgressiveJpegBeyondItsMemoryIsALimit) {
    std::string file = jpegOf(noise(64, 64, 8), {.progressive = true});
    const size_t frame = file.find("\xFF\xC2");
    ASSERT_NE(frame, std::string::npos);
    file.replace(frame + 5, 4, std::string("\x2A\0\x2A\0", 4));  // 10752 by 10752
    file.resize(1 << 20);
    const auto image = decodeImage(file);
    ASSERT_FALSE(image.ok());
    EXPECT_EQ(image.error().code, ErrorCode::Limit) << image.error().line();
    EXPECT_NE(image.error().line().find("256 MiB"), std::string::npos) << image.error().line();
}

TEST(Texture, SamplesTexelCentresExactly) {
    const Image image = noise(5, 3, 6);
    const Texture texture(image);
    for (uint32_t y = 0; y < 3; ++y)
        for (uint32_t x = 0; x < 5; ++x) {
            const glm::vec2 centre((float(x) + 0.5f) / 5, (float(y) + 0.5f) / 3);
            const Rgba8 got = texture.sample(centre, {}), expected = image.texels[y * 5 + x];
            for (int shift = 0; shift < 32; shift += 8)
                EXPECT_NEAR(got >> shift & 0xFF, expected >> shift & 0xFF, 1) << x << ' ' << y;
        }
}

TEST(Texture, BlendsLightNotBytes) {
    const Texture texture(Image{2, 1, {texelOf(0, 0, 0), texelOf(255, 255, 255)}}, Wrap::Clamp, Wrap::Clamp);
    EXPECT_EQ(texture.sample({0.5f, 0.5f}, {}) & 0xFF, 188u);  // half the light
    EXPECT_EQ(texture.sample({0.5f, 0.5f}, TextureFootprint::round(10)) & 0xFF, 188u) << "the coarsest level";
}

TEST(Texture, WrapModes) {
    const Image image{2, 1, {texelOf(255, 0, 0), texelOf(0, 0, 255)}};
    const auto at = [&](float u, Wrap wrap) { return Texture(image, wrap, wrap).sample({u, 0.5f}, {}); };
    for (const float period : {-2.0f, 0.0f, 6.0f}) {
        EXPECT_EQ(at(0.25f + period, Wrap::Repeat), texelOf(255, 0, 0));
        EXPECT_EQ(at(0.25f + period, Wrap::Mirror), texelOf(255, 0, 0));
        EXPECT_EQ(at(1.25f + period, Wrap::Repeat), texelOf(255, 0, 0));
        EXPECT_EQ(at(1.25f + period, Wrap::Mirror), texelOf(0, 0, 255));
    }
    EXPECT_EQ(at(-7, Wrap::Clamp), texelOf(255, 0, 0));
    EXPECT_EQ(at(7, Wrap::Clamp), texelOf(0, 0, 255));
    for (const float far : {1e30f, -3e38f}) EXPECT_NE(at(far, Wrap::Repeat), 0u) << "finite, however far";
}

TEST(Texture, EveryLevelKeepsTheMeanLight) {
    for (const auto& [width, height] : {std::pair{64u, 64u}, {37u, 5u}, {1u, 9u}, {255u, 3u}}) {
        const Image image = noise(width, height, width);
        double mean = 0;
        for (const Rgba8 texel : image.texels)
            mean += srgbToLinear((texel & 0xFF) / 255.0) / double(image.texels.size());
        const Rgba8 coarsest = Texture(image).sample({0.5f, 0.5f}, TextureFootprint::round(1e9));
        EXPECT_NEAR(coarsest & 0xFF, linearToSrgb(mean) * 255, 2) << width << " by " << height;
    }
}

TEST(Texture, LongFootprintsAreAveragedAlongAndNotAcross) {
    // Columns of 8 texels, black and white in turn.
    Image image{64, 64, {}};
    for (uint32_t y = 0; y < 64; ++y)
        for (uint32_t x = 0; x < 64; ++x) image.texels.push_back(x / 8 % 2 == 0 ? texelOf(0, 0, 0) : kWhite);
    const Texture texture(std::move(image));
    const double length = 32.0 / 64, width = 1.0 / 64;
    const glm::vec2 inWhite(12.0f / 64, 0.5f);
    EXPECT_EQ(texture.sample(inWhite, {width * width, 0, length * length}), kWhite) << "along the columns";
    const double across = lightOfByte()[texture.sample(inWhite, {length * length, 0, width * width}) & 0xFF];
    EXPECT_NEAR(across, 0.5, 0.05) << "across them";
    const double wide = lightOfByte()[texture.sample(inWhite, TextureFootprint::round(length)) & 0xFF];
    EXPECT_NEAR(wide, 0.5, 0.1);
    // Aslant, whichever way it leans, 32 texels reach over 22.6 columns, 8 of them white.
    for (const double lean : {-1.0, 1.0}) {
        const double half = length * length / 2;
        EXPECT_NEAR(lightOfByte()[texture.sample(inWhite, {half, lean * half, half}) & 0xFF], 8 / 22.6, 0.05) << lean;
    }
}

TEST(Texture, FootprintsOfPicturesThatAreNotSquareAreInTheirOwnTexels) {
    // 4 texels wide and 64 high, one row in turn black: an eighth of the height is 8 rows, and half a column.
    Image image{4, 64, {}};
    for (uint32_t y = 0; y < 64; ++y)
        for (uint32_t x = 0; x < 4; ++x) image.texels.push_back(y % 2 == 0 ? texelOf(0, 0, 0) : kWhite);
    for (uint32_t y = 0; y < 64; ++y) image.texels[4 * y] = texelOf(255, 0, 0);
    const Texture texture(std::move(image), Wrap::Clamp, Wrap::Clamp);
    const Rgba8 seen = texture.sample({2.5f / 4, 0.5f}, TextureFootprint::round(0.125));
    EXPECT_NEAR(lightOfByte()[seen & 0xFF], 0.5, 0.05);
    EXPECT_EQ(seen & 0xFF, seen >> 8 & 0xFF) << "the red column is two columns away";
}

TEST(Texture, ACornersFootprintIsThatOfItsTriangle) {
    const float height = std::sqrt(0.75f);
    const glm::vec2 even[3] = {{0, 0}, {1, 0}, {0.5f, height}};
    const TextureFootprint round = TextureFootprint::ofCorner(even);
    EXPECT_NEAR(round.uu, kCornerWidth * kCornerWidth, 1e-6);
    EXPECT_NEAR(round.vv, kCornerWidth * kCornerWidth, 1e-6);
    EXPECT_NEAR(round.uv, 0, 1e-6);
    const glm::vec2 turned[3] = {even[2], even[0], even[1]}, mirrored[3] = {even[1], even[0], even[2]};
    for (const auto& other : {TextureFootprint::ofCorner(turned), TextureFootprint::ofCorner(mirrored)}) {
        EXPECT_NEAR(other.uu, round.uu, 1e-12);
        EXPECT_NEAR(other.vv, round.vv, 1e-12);
        EXPECT_NEAR(other.uv, round.uv, 1e-12);
    }
    glm::vec2 sum(0);
    for (int i = 0; i < 3; ++i) sum += placeOfCorner(even, i);
    EXPECT_NEAR(sum.x / 3, 0.5, 1e-6);
    EXPECT_NEAR(sum.y / 3, height / 3, 1e-6);
    EXPECT_NEAR(placeOfCorner(even, 2).y, height * 2 / 3, 1e-6) << "two thirds of the way from the middle of an edge";
    const glm::vec2 nowhere[3] = {{3, 4}, {3, 4}, {3, 4}};
    EXPECT_EQ(TextureFootprint::ofCorner(nowhere).uu, 0);
}

TEST(Texture, HugeFootprintsAndPlacesAreTheMean) {
    Image image{8, 8, {}};
    for (uint32_t i = 0; i < 64; ++i) image.texels.push_back(i % 2 == 0 ? texelOf(0, 0, 0) : kWhite);
    const Texture texture(std::move(image));
    for (const double width : {1e3, 1e30, 1e150})
        EXPECT_NEAR(lightOfByte()[texture.sample({1e20f, -3e7f}, TextureFootprint::round(width)) & 0xFF], 0.5, 0.02);
}

TEST(Texture, WhatIsTransparentLendsNoColour) {
    const Texture texture(Image{2, 1, {texelOf(255, 0, 0, 255), texelOf(0, 255, 0, 0)}}, Wrap::Clamp, Wrap::Clamp);
    EXPECT_EQ(texture.sample({0.5f, 0.5f}, {}), texelOf(255, 0, 0, 128));
}

TEST(TextureCache, LoadsOnDemandAndForgetsTheLeastRecentlyUsed) {
    std::vector<Material> materials(4);
    for (unsigned i = 0; i < 3; ++i) {
        materials[i].name = std::to_string(i);
        materials[i].image.bytes =
            std::make_shared<const std::string>(pngOf(Image{16, 16, std::vector<Rgba8>(256, texelOf(i, i, i))}));
    }
    materials[3].name = "broken";
    materials[3].image.path = "/nowhere/picture.png";
    TextureCache cache(3000);  // two of 1364 bytes
    for (const uint32_t number : {0, 1, 0, 2, 1, 0}) {
        const Texture* const texture = cache.textureOf(materials, number);
        ASSERT_NE(texture, nullptr);
        EXPECT_EQ(texture->sample({0.5f, 0.5f}, {}) & 0xFF, number);
        EXPECT_LE(cache.bytes(), 3000u);
    }
    EXPECT_EQ(cache.textureOf(materials, 3), nullptr);
    EXPECT_EQ(cache.textureOf(materials, 3), nullptr);
    EXPECT_EQ(cache.textureOf(materials, kNoMaterial), nullptr);
    ASSERT_EQ(cache.warnings().size(), 1u);
    EXPECT_NE(cache.warnings()[0].find("/nowhere/picture.png: no such file"), std::string::npos) << cache.warnings()[0];
}

TEST(ColourEncoding, RoundTripsAndModulates) {
    for (unsigned i = 0; i < 256; ++i) EXPECT_EQ(toByte(linearToSrgb(srgbToLinear(i / 255.0))), i);
    EXPECT_EQ(modulate(texelOf(255, 128, 0, 255), texelOf(128, 128, 200, 255)), texelOf(128, 64, 0, 255));
    EXPECT_EQ(toByte(std::nan("")), 0);
}

TEST(ColourEncoding, TablesSayWhatTheFormulasDo) {
    for (int i = -10; i <= 10010; ++i) {
        const double value = i / 10000.0, within = std::clamp(value, 0.0, 1.0);
        EXPECT_NEAR(lightOfStored(value), srgbToLinear(within), 1e-5) << value;
        EXPECT_EQ(byteOfLight(value), toByte(linearToSrgb(within))) << value;
    }
}

TEST(ColourEncoding, MeansAreOfLight) {
    LightMean mean;
    mean.add(texelOf(0, 255, 16, 0));
    mean.add(texelOf(0, 0, 49, 255));
    const double green = linearToSrgb(0.5),
                 blue = linearToSrgb((srgbToLinear(16 / 255.0) + srgbToLinear(49 / 255.0)) / 2);
    EXPECT_EQ(mean.mean(), texelOf(0, toByte(green), toByte(blue), 128));
    for (unsigned i = 0; i < 256; ++i) {
        LightMean same;
        for (int k = 0; k < 3; ++k) same.add(texelOf(i, 255 - i, i, i));
        EXPECT_EQ(same.mean(), texelOf(i, 255 - i, i, i));
    }
}

}  // namespace
}  // namespace vcp
