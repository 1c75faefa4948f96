// Pictures of light: Radiance's in all its codings, EXR, and hostile ones.
#include "viewer/asset/radiance_picture.h"

#include <cmath>
#include <fstream>
#include <limits>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/exr_file.h"
#include "tests/support/test_folder.h"
#include "viewer/asset/exr_picture.h"

namespace vcp {
namespace {

using Texel = std::array<uint8_t, 4>;

Result<RadiancePicture> decoded(const std::string& file) { return decodeRadiance(std::as_bytes(std::span(file))); }

std::string head(uint32_t width, uint32_t height) {
    return "#?RADIANCE\n# a comment\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n\n-Y " + std::to_string(height) + " +X " +
           std::to_string(width) + "\n";
}

/// Texels with runs among them.
std::vector<Texel> someTexels(size_t count) {
    std::mt19937 random(1);
    std::vector<Texel> texels(count);
    for (size_t i = 0; i < count; ++i)
        if (i > 0 && random() % 3 > 0)
            texels[i] = texels[i - 1];
        else
            texels[i] = {uint8_t(random()), uint8_t(random()), uint8_t(random() | 2), uint8_t(random() % 20 + 120)};
    return texels;
}

std::string plain(const std::vector<Texel>& texels) {
    std::string bytes;
    for (const Texel& texel : texels) bytes.append(reinterpret_cast<const char*>(texel.data()), 4);
    return bytes;
}

/// Codes each row as four planes, of runs from four on and of what lies between.
std::string inPlanes(const std::vector<Texel>& texels, uint32_t width) {
    std::string bytes;
    for (size_t row = 0; row < texels.size(); row += width) {
        bytes += {2, 2, char(width >> 8), char(width & 255)};
        for (size_t plane = 0; plane < 4; ++plane)
            for (uint32_t x = 0; x < width;) {
                const auto at = [&](uint32_t i) { return char(texels[row + i][plane]); };
                uint32_t run = 1;
                while (x + run < width && run < 127 && at(x + run) == at(x)) ++run;
                if (run >= 4)
                    bytes += {char(128 + run), at(x)};
                else
                    for (uint32_t i = x; i < x + run; ++i) bytes += {1, at(i)};
                x += run;
            }
    }
    return bytes;
}

/// Repeats texels in the old way.
std::string withRepeats(const std::vector<Texel>& texels, uint32_t width) {
    std::string bytes;
    for (size_t i = 0; i < texels.size();) {
        size_t run = 1;
        while ((i + run) % width != 0 && texels[i + run] == texels[i]) ++run;
        bytes += plain({texels[i]});
        if (run > 1) bytes += plain({{1, 1, 1, uint8_t((run - 1) & 255)}});
        if (run > 256) bytes += plain({{1, 1, 1, uint8_t((run - 1) >> 8)}});
        i += run;
    }
    return bytes;
}

void expectTexels(const std::string& file, glm::uvec2 size, const std::vector<Texel>& texels) {
    const auto picture = decoded(file);
    ASSERT_TRUE(picture) << picture.error().line();
    ASSERT_EQ(picture->size, size);
    ASSERT_EQ(picture->texels.size(), texels.size());
    for (size_t i = 0; i < texels.size(); ++i)
        for (int c = 0; c < 3; ++c)
            ASSERT_EQ(picture->texels[i][c], float(texels[i][size_t(c)] * std::ldexp(1.0, texels[i][3] - 136)))
                << "texel " << i;
}

TEST(Radiance, EveryCodingGivesTheSame) {
    const std::vector<Texel> texels = someTexels(300 * 7);
    expectTexels(head(300, 7) + plain(texels), {300, 7}, texels);
    expectTexels(head(300, 7) + inPlanes(texels, 300), {300, 7}, texels);
    expectTexels(head(300, 7) + withRepeats(texels, 300), {300, 7}, texels);
    const std::vector<Texel> narrow(3 * 700, Texel{9, 8, 7, 130});
    expectTexels(head(3, 700) + plain(narrow), {3, 700}, narrow);
    expectTexels(head(2100, 1) + withRepeats(narrow, 2100), {2100, 1}, narrow);
    const std::vector<Texel> black(8, Texel{200, 100, 50, 0});
    const auto dark = decoded(head(8, 1) + plain(black));
    ASSERT_TRUE(dark);
    for (const glm::vec3& texel : dark->texels) EXPECT_EQ(texel, glm::vec3(0));
}

TEST(Radiance, NoBeginningOfOneIsAPicture) {
    const std::vector<Texel> texels = someTexels(64 * 3);
    for (const std::string& file : {head(64, 3) + plain(texels), head(64, 3) + inPlanes(texels, 64)})
        for (size_t bytes = 0; bytes < file.size(); ++bytes) EXPECT_FALSE(decoded(file.substr(0, bytes))) << bytes;
}

TEST(Radiance, LiesAreRefused) {
    const auto refused = [](const std::string& file, ErrorCode code, const char* why) {
        const auto picture = decoded(file);
        ASSERT_FALSE(picture) << why;
        EXPECT_EQ(picture.error().code, code) << why;
        EXPECT_NE(picture.error().line().find(why), std::string::npos) << picture.error().line();
    };
    refused("PNG", ErrorCode::InvalidInput, "neither");
    refused("", ErrorCode::InvalidInput, "neither");
    refused(head(100000, 100000), ErrorCode::Limit, "8192 x 4096");
    refused(head(8192, 8192), ErrorCode::Limit, "8192 x 4096");
    refused("#?RADIANCE\n\n+X 4 -Y 4\n", ErrorCode::Unsupported, "upper left");
    refused("#?RADIANCE\n\n-Y 0 +X 4\n", ErrorCode::InvalidInput, "size");
    refused("#?RADIANCE\n\n-Y 99999999999 +X 4\n", ErrorCode::InvalidInput, "size");
    refused("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\nabcd", ErrorCode::Unsupported, "XYZ");
    refused("#?RADIANCE\n\n+Y 4 +X 4\n", ErrorCode::Unsupported, "upper left");
    EXPECT_TRUE(decoded("#?RADIANCE\r\nFORMAT=32-bit_rle_rgbe\r\n\r\n-Y 1 +X 1\r\nabcd"));
    // A run beyond the row, of no texel, and a repeat of none before.
    const std::string planes = head(8, 1) + std::string("\2\2\0\10", 4);
    refused(planes + std::string("\211\1", 2), ErrorCode::InvalidInput, "row 1 of 1");
    refused(planes + std::string(64, '\0'), ErrorCode::InvalidInput, "row 1 of 1");
    refused(head(8, 1) + std::string("\1\1\1\10", 4) + std::string(64, 'a'), ErrorCode::InvalidInput, "row 1 of 1");
}

TEST(Radiance, ColoursOfExr) {
    if (!readsExr()) GTEST_SKIP() << "built without OpenEXR";
    const auto decodedExr = [](const test::ExrFile& file) { return decodeRadiance(file.bytes()); };
    const auto picture =
        decodedExr(test::ExrFile(0, 0, 2, 1).channel("B", {0.5f, -1}).channel("G", {2, 3}).channel("R", {1000, 0}));
    ASSERT_TRUE(picture) << picture.error().line();
    EXPECT_EQ(picture->size, glm::uvec2(2, 1));
    EXPECT_EQ(picture->texels, (std::vector<glm::vec3>{{1000, 2, 0.5f}, {0, 3, 0}}));
    EXPECT_EQ(decodedExr(test::ExrFile(0, 0, 1, 1).channel("Y", {7}))->texels[0], glm::vec3(7));
    EXPECT_EQ(decodedExr(test::ExrFile(0, 0, 1, 1).channel("Z", {7})).error().code, ErrorCode::Unsupported);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(decodedExr(test::ExrFile(0, 0, 1, 1).channel("Y", {nan})).error().code, ErrorCode::InvalidInput);
}

TEST(Radiance, FilesAreNamed) {
    const TestFolder folder("vcp_radiance");
    const auto missing = readRadiancePicture(folder / "none.hdr");
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().file, (folder / "none.hdr").string());
    std::ofstream(folder / "cut.hdr") << head(64, 64);
    EXPECT_EQ(readRadiancePicture(folder / "cut.hdr").error().file, (folder / "cut.hdr").string());
}

}  // namespace
}  // namespace vcp
