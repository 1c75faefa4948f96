#include "viewer/picture/png_rows.h"

#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "render/picture.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

Picture noise(uint32_t width, uint32_t height) {
    Picture picture{width, height, std::vector<uint8_t>(size_t{4} * width * height)};
    std::mt19937 random(width * 31 + height);
    for (uint8_t& byte : picture.rgba) byte = uint8_t(random());
    return picture;
}

TEST(PngRows, InAnyPortionsTheSamePicture) {
    const TestFolder folder("vcp_png_rows_test");
    const Picture picture = noise(37, 23);
    for (const uint32_t portion : {1u, 5u, 23u}) {
        auto rows = PngRows::create(folder / "a.png", 37, 23);
        ASSERT_TRUE(rows) << rows.error().line();
        for (uint32_t y = 0; y < 23; y += portion) {
            const size_t begin = size_t{4} * 37 * y, end = size_t{4} * 37 * std::min(23u, y + portion);
            ASSERT_TRUE((*rows)->add(std::span(picture.rgba).subspan(begin, end - begin)));
        }
        EXPECT_FALSE(std::filesystem::exists(folder / "a.png") && portion == 1) << "not before it is whole";
        ASSERT_TRUE((*rows)->finish());
        EXPECT_EQ(readPng(folder / "a.png").value(), picture);
    }
}

TEST(PngRows, UnfinishedLeavesNothing) {
    const TestFolder folder("vcp_png_rows_test");
    const Picture picture = noise(4, 4);
    {
        auto rows = PngRows::create(folder / "a.png", 4, 4);
        ASSERT_TRUE(rows);
        EXPECT_TRUE((*rows)->add(std::span(picture.rgba).first(16)));
        EXPECT_FALSE((*rows)->finish()) << "rows are missing";
        EXPECT_FALSE((*rows)->add(picture.rgba)) << "one row too many";
        EXPECT_FALSE((*rows)->add(std::span(picture.rgba).first(15))) << "no whole row";
    }
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(PngRows, WhatCannotBeWrittenIsNamed) {
    const TestFolder folder("vcp_png_rows_test");
    const auto nowhere = PngRows::create(folder / "no" / "a.png", 4, 4);
    ASSERT_FALSE(nowhere);
    EXPECT_EQ(nowhere.error().file, (folder / "no" / "a.png").string());
    EXPECT_FALSE(PngRows::create(folder / "a.png", 0, 4));
    EXPECT_FALSE(PngRows::create(folder / "a.png", 4, (1 << 20) + 1));
}

}  // namespace
}  // namespace vcp
