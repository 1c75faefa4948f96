// PNG files.
#include "render/picture.h"

#include <filesystem>
#include <fstream>
#include <random>

#include <gtest/gtest.h>

namespace vcp {
namespace {

namespace fs = std::filesystem;

class PictureFile : public testing::Test {
protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / ("vcp_picture_test_" + std::to_string(std::random_device{}()));
        fs::create_directory(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }
    [[nodiscard]] size_t files() const {
        return size_t(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
    }
    fs::path folder_;
};

Picture noise(uint32_t width, uint32_t height) {
    Picture picture{width, height, std::vector<uint8_t>(size_t{4} * width * height)};
    std::mt19937 random(width * 31 + height);
    for (uint8_t& byte : picture.rgba) byte = uint8_t(random());
    return picture;
}

TEST_F(PictureFile, RoundTrip) {
    for (const auto& [width, height] : {std::pair{1u, 1u}, {1u, 7u}, {63u, 5u}, {256u, 100u}}) {
        const Picture picture = noise(width, height);
        const auto written = writePng(picture, folder_ / "a.png");
        ASSERT_TRUE(written) << written.error().line();
        const auto read = readPng(folder_ / "a.png");
        ASSERT_TRUE(read) << read.error().line();
        EXPECT_EQ(*read, picture);
    }
    EXPECT_EQ(files(), 1u) << "no partial file is left";
}

TEST_F(PictureFile, UnwritableNamesTheFileAndLeavesNothing) {
    const fs::path path = folder_ / "missing" / "a.png";
    const auto written = writePng(noise(4, 4), path);
    ASSERT_FALSE(written);
    EXPECT_NE(written.error().line().find(path.string()), std::string::npos);
    EXPECT_EQ(files(), 0u);
}

TEST_F(PictureFile, WrongSizeIsRefused) {
    Picture picture = noise(4, 4);
    picture.rgba.pop_back();
    const auto written = writePng(picture, folder_ / "a.png");
    ASSERT_FALSE(written);
    EXPECT_EQ(written.error().code, ErrorCode::Usage);
    EXPECT_EQ(files(), 0u);
}

TEST_F(PictureFile, HostileFilesAreErrors) {
    ASSERT_TRUE(writePng(noise(16, 16), folder_ / "a.png"));
    std::ifstream in(folder_ / "a.png", std::ios::binary);
    const std::string whole((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    for (size_t length = 0; length < whole.size() - 12; length += 7) {
        std::ofstream(folder_ / "b.png", std::ios::binary).write(whole.data(), std::streamsize(length));
        EXPECT_FALSE(readPng(folder_ / "b.png")) << length;
    }
    EXPECT_FALSE(readPng(folder_ / "absent.png"));
}

}  // namespace
}  // namespace vcp
