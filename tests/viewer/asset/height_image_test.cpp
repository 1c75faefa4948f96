// Heights from EXR and PNG pictures, whole and hostile. PNG is tested through the program, too
// (meso_commands_test.cpp).
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>

#include <sys/stat.h>

#include <gtest/gtest.h>

#include "tests/support/exr_file.h"
#include "tests/support/peak_memory.h"
#include "tests/support/png_files.h"
#include "tests/support/test_folder.h"
#include "viewer/asset/height_image.h"

namespace vcp {
namespace {

using test::Bytes, test::ExrFile;

class Exr : public testing::Test {
protected:
    Exr() : folder_("vcp_exr_test") {}
    void SetUp() override {
        if (!readsExr()) GTEST_SKIP() << "built without OpenEXR";
    }
    Result<meso::HeightMap> read(const Bytes& bytes, double range = 0.5) const {
        const std::string path = (folder_ / "a.exr").string();
        std::ofstream(path, std::ios::binary)
            .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
        return readHeightImage(path, range);
    }
    TestFolder folder_;
};

TEST_F(Exr, WhatIsNoFileIsNotWaitedForAndDamageNamesTheFile) {
    const std::string pipe = (folder_ / "pipe.exr").string();
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    const auto refused = readHeightImage(pipe, 1);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().line(), pipe + ": is a pipe, not a file");
    const Bytes whole = ExrFile(0, 0, 3, 2).channel("Y", {-2, 0, 2, 6, 1, -2}).bytes();
    for (size_t size = 4; size < whole.size(); ++size) {
        const auto map = read(Bytes(whole.begin(), whole.begin() + std::ptrdiff_t(size)));
        if (map) continue;
        EXPECT_TRUE(map.error().line().starts_with((folder_ / "a.exr").string() + ": ")) << map.error().line();
        EXPECT_EQ(map.error().message.find("\"\""), std::string::npos) << map.error().line();
    }
}

TEST_F(Exr, FloatsBecomeHeightsBetweenTheirLeastAndGreatest) {
    // Rows from the top, a data window away from the origin, values below 0 and above 1.
    const auto map = read(ExrFile(-7, 12, 3, 2).channel("Y", {-2, 0, 2, 6, 1, -2}).bytes());
    ASSERT_TRUE(map) << map.error().line();
    EXPECT_EQ(map->size, glm::ivec2(3, 2));
    EXPECT_EQ(map->range, 0.5);
    const double wanted[2][3] = {{8, 3, 0}, {0, 2, 4}};  // from the lower row, over the least
    for (int y = 0; y < 2; ++y)
        for (int x = 0; x < 3; ++x)
            EXPECT_NEAR(map->height(x, y), wanted[y][x] / 8 * 0.5, 0.5 / 65535) << x << ", " << y;
}

TEST_F(Exr, ChannelsAreChosenByName) {
    const std::vector<float> ramp = {0, 1, 2, 3}, back = {3, 2, 1, 0}, other = {5, 0, 0, 5};
    const auto texels = [&](ExrFile file) {
        const auto map = read(file.bytes());
        EXPECT_TRUE(map) << map.error().line();
        return map ? map->texels : std::vector<uint16_t>();
    };
    const std::vector<uint16_t> rising = {0, 21845, 43690, 65535};
    EXPECT_EQ(texels(ExrFile(0, 0, 4, 1).channel("height", ramp)), rising) << "the only one";
    EXPECT_EQ(texels(ExrFile(0, 0, 4, 1).channel("R", ramp, true)), rising) << "half";
    EXPECT_EQ(texels(ExrFile(0, 0, 4, 1).channel("A", other).channel("Y", ramp)), rising) << "Y before others";
    EXPECT_EQ(
        texels(ExrFile(0, 0, 4, 1).channel("A", other).channel("B", ramp).channel("G", ramp).channel("R", ramp, true)),
        rising)
        << "the mean";
    EXPECT_EQ(texels(ExrFile(0, 0, 4, 1).channel("G", back).channel("R", ramp)), std::vector<uint16_t>(4, 0))
        << "the mean is flat, and flat is the bottom";
    const auto none = read(ExrFile(0, 0, 4, 1).channel("U", ramp).channel("V", ramp).bytes());
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().code, ErrorCode::Unsupported) << none.error().line();
}

TEST_F(Exr, RefusesWhatIsNoNumber) {
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                            -std::numeric_limits<float>::infinity()}) {
        const auto map = read(ExrFile(0, 0, 2, 2).channel("Y", {0, 1, bad, 3}).bytes());
        ASSERT_FALSE(map);
        EXPECT_EQ(map.error().code, ErrorCode::InvalidInput);
        EXPECT_EQ(map.error().element, "texel 0, 1") << map.error().line();
        EXPECT_NE(map.error().line().find("a.exr"), std::string::npos);
    }
}

TEST_F(Exr, SizesAreCheckedBeforeTexels) {
    // The header alone, so that only its words can be what is wrong.
    const auto refused = [&](int width, int height, ErrorCode code) {
        Bytes bytes = ExrFile(0, 0, 1, 1).channel("Y", {1}).bytes();
        const std::string name = "dataWindow";
        const auto at = std::search(bytes.begin(), bytes.end(), name.begin(), name.end(),
                                    [](std::byte a, char b) { return a == std::byte(b); });
        const int32_t window[4] = {0, 0, width - 1, height - 1};
        std::memcpy(&*at + name.size() + 1 + sizeof "box2i" + 4, window, sizeof window);
        const auto map = read(bytes);
        ASSERT_FALSE(map) << width << " x " << height;
        EXPECT_EQ(map.error().code, code) << map.error().line();
    };
    refused(meso::kMaxMapEdge + 1, 1, ErrorCode::Limit);
    refused(1, std::numeric_limits<int>::max(), ErrorCode::Limit);
    refused(0, 1, ErrorCode::InvalidInput);
    refused(std::numeric_limits<int>::min() + 2, 1, ErrorCode::InvalidInput);
    refused(4096, 4096, ErrorCode::InvalidInput);  // texels that are not there
}

/// Where the value of an attribute begins.
size_t valueAt(const Bytes& bytes, const std::string& name, const std::string& type) {
    const std::string words = name + '\0' + type + '\0';
    const auto at = std::search(bytes.begin(), bytes.end(), words.begin(), words.end(),
                                [](std::byte a, char b) { return a == std::byte(b); });
    return size_t(at - bytes.begin()) + words.size() + 4;
}

Bytes seed(const char* name) {
    std::ifstream file(std::string(VCP_SOURCE_DIR) + "/tests/fuzz/seeds/fuzz_heights/" + name, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    Bytes bytes(text.size());
    std::memcpy(bytes.data(), text.data(), text.size());
    return bytes;
}

void expectRefused(const Bytes& bytes, ErrorCode code, const char* part) {
    const auto picture = decodeExr(bytes, meso::kMaxMapEdge);
    ASSERT_FALSE(picture) << part;
    EXPECT_EQ(picture.error().code, code) << picture.error().line();
    EXPECT_NE(picture.error().message.find(part), std::string::npos) << picture.error().line();
}

TEST_F(Exr, TilesOutOfProportionAreRefused) {
    const Bytes tiled = seed("tiles.exr");
    const auto whole = decodeExr(tiled, 64);
    ASSERT_TRUE(whole) << whole.error().line();
    // A hundred million lines, for 4 x 3 texels.
    expectRefused(seed("tall_tiles.exr"), ErrorCode::Limit, "in tiles of 1 x 100663296");
    const size_t at = valueAt(tiled, "tiles", "tiledesc");
    const auto with = [&](uint32_t x, uint32_t y) {
        Bytes bytes = tiled;
        std::memcpy(bytes.data() + at, &x, sizeof x), std::memcpy(bytes.data() + at + sizeof x, &y, sizeof y);
        return bytes;
    };
    for (const auto& [x, y] : {std::pair(65537u, 1u), std::pair(1u, 65537u), std::pair(~0u, ~0u),
                               std::pair(1u << 31, 2u), std::pair(65536u, 65536u), std::pair(8192u, 8192u)})
        expectRefused(with(x, y), ErrorCode::Limit, "in tiles of");
    expectRefused(with(0, 4), ErrorCode::InvalidInput, "tiles without texels");
}

TEST_F(Exr, LinesAndChannelsOutOfProportionAreRefused) {
    // DWAB takes 256 lines together, of all channels: 256 MiB for a picture of one line.
    ExrFile wide(0, 0, 4096, 1);
    for (int i = 0; i < 64; ++i) wide.channel(std::string(1, char('0' + i)), std::vector<float>(4096));
    Bytes bytes = wide.bytes();
    bytes[valueAt(bytes, "compression", "compression")] = std::byte{9};
    expectRefused(bytes, ErrorCode::Limit, "256 lines together");
    ExrFile many(0, 0, 2, 1);
    for (int i = 0; i < 65; ++i) many.channel(std::string(1, char('0' + i)), {1, 2});
    expectRefused(many.bytes(), ErrorCode::Limit, "65 channels");
    // What the library would join, or take the last of.
    expectRefused(ExrFile(0, 0, 2, 1).channel("Y", {0, 1}).with("compression", "compression", 1).bytes(),
                  ErrorCode::InvalidInput, "twice");
}

TEST_F(Exr, APictureIsNotLargerThanItsBytesCanHold) {
    for (const int compression : {0, 3, 9}) {
        Bytes bytes = ExrFile(0, 0, 1, 1).channel("Y", {1}).bytes();
        const int32_t window[4] = {0, 0, 4095, compression == 9 ? 4095 : 255};
        std::memcpy(bytes.data() + valueAt(bytes, "dataWindow", "box2i"), window, sizeof window);
        bytes[valueAt(bytes, "compression", "compression")] = std::byte(compression);
        expectRefused(bytes, ErrorCode::InvalidInput, "cannot hold");
    }
}

TEST_F(Exr, OtherAttributesArePassedOver) {
    // Their sizes are not those of their types: a reader that goes by type would take other bytes for what follows.
    for (const auto& [type, size] :
         {std::pair("string", size_t{40}), std::pair("int", size_t{0}), std::pair("m44f", size_t{3}),
          std::pair("stringvector", size_t{12}), std::pair("preview", size_t{8}), std::pair("of mine", size_t{5})}) {
        const auto map = read(ExrFile(0, 0, 2, 1).channel("Y", {0, 1}).with("other", type, size).bytes());
        ASSERT_TRUE(map) << type << ": " << map.error().line();
        EXPECT_EQ(map->texels, (std::vector<uint16_t>{0, 65535}));
    }
    EXPECT_FALSE(read(ExrFile(0, 0, 2, 1).channel("Y", {0, 1}).with("dataWindow", "box2i", 12).bytes()));
    EXPECT_FALSE(read(ExrFile(0, 0, 2, 1).channel("Y", {0, 1}).with("dataWindow", "int", 4).bytes()));
}

TEST_F(Exr, HostileBytesAreOneLine) {
    const Bytes whole = ExrFile(3, 4, 5, 3).channel("Y", std::vector<float>(15, 2)).bytes();
    ASSERT_TRUE(decodeExr(whole, 64));
    for (size_t size = 0; size < whole.size(); ++size) {
        const auto cut = decodeExr(std::span(whole).first(size), 64);
        ASSERT_FALSE(cut) << size << " of " << whole.size() << " bytes";
        EXPECT_EQ(cut.error().line().find('\n'), std::string::npos);
    }
    for (size_t bit = 0; bit < 8 * whole.size(); ++bit) {
        Bytes bytes = whole;
        bytes[bit / 8] ^= std::byte(1 << bit % 8);
        const auto flipped = decodeExr(bytes, 64);
        if (!flipped)
            EXPECT_EQ(flipped.error().line().find('\n'), std::string::npos) << bit;
        else
            EXPECT_EQ(flipped->values.size(), size_t(flipped->size.x) * size_t(flipped->size.y)) << bit;
    }
}

Result<meso::HeightMap> heightsOfPng(const std::string& file) {
    return decodeHeights(std::as_bytes(std::span(file)), 1);
}

TEST(PngHeights, EveryDepthInterlacedAndPalette) {
    const std::string four("\0\x1b", 2);  // of 2 bits: 0, 1, 2, 3
    const std::string eight("\0\x00\x55\xaa\xff", 5), sixteen("\0\x00\x00\x55\x55\xaa\xaa\xff\xff", 9);
    const std::string palette = test::pngChunk("PLTE", std::string("\0\0\0\x55\x55\x55\xaa\xaa\xaa\xff\xff\xff", 12));
    const std::vector<uint16_t> rising = {0, 0x5555, 0xaaaa, 0xffff};
    for (const std::string& file : {test::pngFile(4, 1, 2, 0, four), test::pngFile(4, 1, 8, 0, eight),
                                    test::pngFile(4, 1, 16, 0, sixteen), test::pngFile(4, 1, 2, 3, four, palette),
                                    test::pngFile(4, 1, 2, 3, four, palette + test::pngChunk("tRNS", "\x10"))}) {
        const auto map = heightsOfPng(file);
        ASSERT_TRUE(map) << map.error().line();
        EXPECT_EQ(map->texels, rising);
        for (size_t size = 0; size < file.size() - 12; ++size) EXPECT_FALSE(heightsOfPng(file.substr(0, size))) << size;
    }
    // Adam7 of 4 x 1: the first texel, the third, the second and the fourth; each pass has its filter byte.
    const auto passes = heightsOfPng(test::pngFile(4, 1, 8, 0, std::string("\0\x00\0\xaa\0\x55\xff", 7), "", true));
    ASSERT_TRUE(passes) << passes.error().line();
    EXPECT_EQ(passes->texels, rising);
}

TEST(PngHeights, TextIsNotInflatedAndSizesAreChecked) {
    const std::string bombs = test::pngFile(2, 1, 8, 0, std::string("\0\1\2", 3), test::textBombs(100));
    const uint64_t before = test::peakBytes();
    const auto map = heightsOfPng(bombs);
    ASSERT_TRUE(map) << map.error().line();
    EXPECT_LT(test::peakBytes() - before, 64u << 20) << "of some 800";
    EXPECT_EQ(map->texels, (std::vector<uint16_t>{257, 514}));
    const auto refused = [](const std::string& file, ErrorCode code, const char* part) {
        const auto heights = heightsOfPng(file);
        ASSERT_FALSE(heights) << part;
        EXPECT_EQ(heights.error().code, code) << heights.error().line();
        EXPECT_NE(heights.error().message.find(part), std::string::npos) << heights.error().line();
    };
    refused(test::pngFile(4096, 4096, 16, 0, "few"), ErrorCode::InvalidInput, "cannot hold 4096 by 4096");
    refused(test::pngFile(16385, 1, 1, 0, std::string(2050, '\0')), ErrorCode::Limit, "16385 x 1 texels");
}

}  // namespace
}  // namespace vcp
