#include "viewer/text_strip.h"

#include <algorithm>
#include <string>

#include <gtest/gtest.h>

namespace vcp {
namespace {

size_t inkOf(const Strip& strip) {
    return static_cast<size_t>(std::count_if(strip.pixels.begin(), strip.pixels.end(),
                                             [&](uint32_t pixel) { return pixel != strip.pixels.front(); }));
}

TEST(TextStrip, HasTheSizeAskedForAndIsOpaque) {
    const TextStrip text(1);
    for (const int width : {1, 7, 1280}) {
        const Strip strip = text.draw("happy_buddha_1M.ply | 1 087 716 triangles", width);
        EXPECT_EQ(strip.width, width);
        EXPECT_EQ(strip.height, text.height());
        ASSERT_EQ(strip.pixels.size(), static_cast<size_t>(width * strip.height));
        for (const uint32_t pixel : strip.pixels) ASSERT_EQ(pixel >> 24, 255u);
    }
}

TEST(TextStrip, EveryPrintableCharacterHasInkOfItsOwn) {
    const TextStrip text(1);
    EXPECT_EQ(inkOf(text.draw(" ", 40)), 0u);
    for (char c = 33; c < 127; ++c) {
        EXPECT_GT(inkOf(text.draw(std::string(1, c), 40)), 0u) << c;
        if (c != 'B') {
            EXPECT_NE(text.draw(std::string(1, c), 40).pixels, text.draw("B", 40).pixels) << c;
        }
    }
}

TEST(TextStrip, WhatIsNotAsciiShowsAsQuestionMark) {
    const TextStrip text(1);
    EXPECT_EQ(text.draw("\xff", 40).pixels, text.draw("?", 40).pixels);
    EXPECT_EQ(text.draw(std::string(1, '\0'), 40).pixels, text.draw("?", 40).pixels);
}

TEST(TextStrip, ScalesByWholeNumbers) {
    const TextStrip one(1), two(2), absurd(1e9f), tiny(0);
    EXPECT_EQ(two.widthOf("vcp"), 2 * one.widthOf("vcp"));
    EXPECT_GT(two.height(), one.height());
    EXPECT_LT(absurd.height(), 200);
    EXPECT_EQ(tiny.height(), one.height());
    EXPECT_EQ(inkOf(two.draw("vcp", 400)), 4 * inkOf(one.draw("vcp", 400)));
}

TEST(TextStrip, CutsOffAtTheEnd) {
    const TextStrip text(1);
    const int width = text.widthOf("abc");
    const Strip shorter = text.draw("abc", width), longer = text.draw("abc and more", width);
    EXPECT_EQ(shorter.pixels.size(), longer.pixels.size());
    for (int y = 0; y < text.height(); ++y)
        for (int x = 0; x < width / 2; ++x) EXPECT_EQ(shorter.pixels[y * width + x], longer.pixels[y * width + x]);
}

}  // namespace
}  // namespace vcp
