#include "viewer/scene/option_values.h"

#include <gtest/gtest.h>

namespace vcp {
namespace {

TEST(OptionValues, Lengths) {
    EXPECT_EQ(parseLength("0.25")->value, 0.25);
    EXPECT_FALSE(parseLength("0.25")->isRelative);
    EXPECT_DOUBLE_EQ(parseLength("0.01%")->value, 1e-4);
    EXPECT_TRUE(parseLength("0.01%")->isRelative);
    EXPECT_EQ(parseLength("1e-3")->value, 1e-3);
    for (const char* wrong : {"", "%", "-1", "0", "0%", "nan", "inf", "1e999", "1m", "1%%", " 1", "1 "})
        EXPECT_FALSE(parseLength(wrong)) << wrong;
}

TEST(OptionValues, Bytes) {
    EXPECT_EQ(parseBytes("4096"), 4096u);
    EXPECT_EQ(parseBytes("512K"), 512u << 10);
    EXPECT_EQ(parseBytes("1.5M"), 3u << 19);
    EXPECT_EQ(parseBytes("4g"), uint64_t(4) << 30);
    EXPECT_EQ(parseBytes("4GiB"), uint64_t(4) << 30);
    EXPECT_EQ(parseBytes("4GB"), uint64_t(4) << 30);
    EXPECT_EQ(parseBytes("7B"), 7u);
    for (const char* wrong : {"", "G", "-4G", "0", "0.1", "4X", "4GX", "4 G", "4BB", "9999999999T", "nan", "inf"})
        EXPECT_FALSE(parseBytes(wrong)) << wrong;
}

TEST(OptionValues, Counts) {
    EXPECT_EQ(parseCount("10000"), 10'000u);
    EXPECT_EQ(parseCount("250k"), 250'000u);
    EXPECT_EQ(parseCount("1.1M"), 1'100'000u);
    EXPECT_EQ(parseCount("1G"), 1'000'000'000u);
    EXPECT_EQ(parseCount("1e6"), 1'000'000u);
    for (const char* wrong : {"", "M", "0", "-1", "1.5", "1.2345k", "10MB", "10T", "10 M", "1e16", "nan", "inf"})
        EXPECT_FALSE(parseCount(wrong)) << wrong;
}

TEST(OptionValues, Sizes) {
    EXPECT_EQ(parseSize("1920x1200"), glm::ivec2(1920, 1200));
    EXPECT_EQ(parseSize("1X1"), glm::ivec2(1, 1));
    EXPECT_EQ(parseSize("16384x16384"), glm::ivec2(16384));
    for (const char* wrong :
         {"", "1920", "1920x", "x1200", "0x1", "1x0", "-1x1", "1x-1", "16385x1", "1x1x1", "1 x1", "99999999999x1"})
        EXPECT_FALSE(parseSize(wrong)) << wrong;
}

TEST(OptionValues, PlanesAndDirections) {
    EXPECT_EQ(parsePlane("x<0.2")->normal, glm::dvec3(-1, 0, 0));
    EXPECT_EQ(parsePlane("x<0.2")->offset, -0.2);
    EXPECT_EQ(parsePlane("z>-3")->normal, glm::dvec3(0, 0, 1));
    EXPECT_EQ(parsePlane("z>-3")->offset, -3);
    EXPECT_TRUE(parsePlane("y<25%")->isRelative);
    EXPECT_EQ(parsePlane("y<25%")->offset, -0.25);
    EXPECT_EQ(parsePlane("1,0,-2.5,7")->normal, glm::dvec3(1, 0, -2.5));
    EXPECT_EQ(parsePlane("1,0,-2.5,7")->offset, 7);
    for (const char* wrong :
         {"", "x", "x<", "x=1", "w<1", "x<1cm", "x<nan", "1,2,3", "0,0,0,1", "1,2,3,4,5", "1,2,3,", "1,2,3,inf"})
        EXPECT_FALSE(parsePlane(wrong)) << wrong;
    EXPECT_EQ(*parseDirection("1,0,-0.5"), glm::dvec3(1, 0, -0.5));
    for (const char* wrong : {"", "1,2", "0,0,0", "1,2,3,4", "1 2 3"}) EXPECT_FALSE(parseDirection(wrong)) << wrong;
}

TEST(OptionValues, ListsOfNumbers) {
    EXPECT_EQ(parseNumbers("30,-35.5,1e-2"), (std::vector<double>{30, -35.5, 0.01}));
    EXPECT_EQ(parseNumbers("7"), std::vector<double>{7});
    for (const char* wrong : {"", ",", "1,", ",1", "1,,2", "1;2", "1, 2", "1,nan", "inf", "1,2x", "1,5e999"})
        EXPECT_TRUE(parseNumbers(wrong).empty()) << wrong;
}

TEST(OptionValues, BudgetsAreAMebibyteAtLeast) {
    EXPECT_EQ(parseBudget("1M"), 1u << 20);
    EXPECT_EQ(parseBudget("2G"), uint64_t(2) << 30);
    for (const char* wrong : {"", "0", "1023K", "much", "-1G"}) EXPECT_FALSE(parseBudget(wrong)) << wrong;
}

TEST(OptionValues, NumbersForPeople) {
    EXPECT_EQ(formatCount(0), "0");
    EXPECT_EQ(formatCount(999), "999");
    EXPECT_EQ(formatCount(1087716), "1 087 716");
    EXPECT_EQ(formatCount(0, "line"), "0 lines");
    EXPECT_EQ(formatCount(1, "line"), "1 line");
    EXPECT_EQ(formatCount(1, "leaf", "leaves"), "1 leaf");
    EXPECT_EQ(formatCount(1200, "leaf", "leaves"), "1 200 leaves");
    EXPECT_EQ(formatBytes(0), "0 B");
    EXPECT_EQ(formatBytes(999), "999 B");
    EXPECT_EQ(formatBytes(13'200'000), "13.2 MB");
    EXPECT_EQ(formatBytes(999'999), "1.0 MB");
    EXPECT_EQ(formatBytes(UINT64_MAX), "18.4 EB");
    EXPECT_EQ(formatSeconds(0.824), "0.82 s");
    EXPECT_EQ(formatSeconds(185), "3 min 05 s");
    EXPECT_EQ(formatSeconds(7265), "2 h 01 min");
}

}  // namespace
}  // namespace vcp
