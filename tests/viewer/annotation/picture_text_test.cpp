// Text in pictures: every letter is seen, stands where it is said to, and is as wide as it is said to be.
#include "viewer/annotation/picture_text.h"

#include <algorithm>
#include <string>

#include <gtest/gtest.h>

namespace vcp {
namespace {

/// The box about what was drawn, in pixels; `high` is behind the last one.
struct Ink {
    glm::ivec2 low{1000}, high{-1};
    uint64_t pixels = 0;
};

Picture white(uint32_t width, uint32_t height) {
    return {width, height, std::vector<uint8_t>(size_t{4} * width * height, 255)};
}

Ink inkOf(const Picture& picture) {
    Ink ink;
    for (int y = 0; y < int(picture.height); ++y)
        for (int x = 0; x < int(picture.width); ++x) {
            if (picture.rgba[4 * (size_t(y) * picture.width + size_t(x))] >= 128) continue;
            ink.low = {std::min(ink.low.x, x), std::min(ink.low.y, y)};
            ink.high = {std::max(ink.high.x, x + 1), std::max(ink.high.y, y + 1)};
            ++ink.pixels;
        }
    return ink;
}

Ink drawn(std::string_view text, double height, glm::dvec2 at = {20, 60}) {
    Picture picture = white(400, 100);
    drawText(picture, text, at, height, {0, 0, 0});
    return inkOf(picture);
}

TEST(PictureText, HasLettersDigitsAndSigns) {
    for (char letter = '!'; letter <= '~'; ++letter) EXPECT_GT(drawn(std::string(1, letter), 20).pixels, 3u) << letter;
    for (const char* letter : {"\u00e4", "\u00d8", "\u0141", "\u00b1", "\u00d7", "\u00b0", "\u2026"})
        EXPECT_GT(drawn(letter, 20).pixels, 5u) << letter;
    EXPECT_EQ(drawn(" ", 20).pixels, 0u);
    EXPECT_NE(drawn("a", 20).pixels, drawn("A", 20).pixels) << "capitals are capitals";
}

TEST(PictureText, StandsOnItsLineAndIsAsHighAsItsCapitals) {
    for (const double height : {12.0, 20.0, 40.0}) {
        const Ink ink = drawn("HEIM", height);
        EXPECT_EQ(ink.high.y, 60);
        EXPECT_NEAR(ink.high.y - ink.low.y, height, 1);
        EXPECT_NEAR(ink.low.x, 20 + 0.1 * height, 0.1 * height);
        EXPECT_NEAR(ink.high.x, 20 + textWidth("HEIM", height), 0.2 * height);
    }
    EXPECT_NEAR(textWidth("HEIM", 40), 2 * textWidth("HEIM", 20), 0.1);
    EXPECT_NEAR(textWidth("0123", 20), textWidth("7777", 20), 0.1) << "figures are tabular";
    EXPECT_EQ(textWidth("", 20), 0);
}

TEST(PictureText, IsCutAtTheEdgesOfAPicture) {
    for (const glm::dvec2 at : {glm::dvec2(-7, 5), {395, 60}, {100, -4}, {100, 104}, {-1e4, 1e4}})
        EXPECT_LT(drawn("Words", 20, at).pixels, drawn("Words", 20).pixels);
}

// Rows of a picture get the same as the whole: tiles are drawn by themselves.
TEST(PictureText, RowsGetWhatThePictureGets) {
    Picture whole = white(200, 60), rows = white(200, 20);
    drawText(whole, "Quay g", {10.25, 37.5}, 24, {0, 0, 0});
    drawText(rows, "Quay g", {10.25, 37.5 - 20}, 24, {0, 0, 0});
    const auto from = whole.rgba.begin() + 4 * 200 * 20;
    EXPECT_TRUE(std::equal(rows.rgba.begin(), rows.rgba.end(), from));
}

TEST(PictureText, BytesThatAreNoTextAreBoxes) {
    for (const char* text : {"\xff", "\xc3", "a\xe2\x82", "\x80\x80", "\xf0\x9f\x98\x80"}) {
        EXPECT_GT(drawn(text, 20).pixels, 5u);
        EXPECT_GT(textWidth(text, 20), 0);
    }
}

}  // namespace
}  // namespace vcp
