// Depth and normals as PFM and PNG.
#include "viewer/picture/image_files.h"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <png.h>
#include <unistd.h>

namespace vcp {
namespace {

namespace fs = std::filesystem;
constexpr float kNoHit = std::numeric_limits<float>::infinity();

class ImageFiles : public testing::Test {
protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() / ("vcp_image_test." + std::to_string(getpid()));
        fs::remove_all(folder_);
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }

    static std::string contentOf(const fs::path& path) {
        std::ifstream file(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }

    struct Png {
        uint32_t width = 0, height = 0;
        int bits = 0, channels = 0;
        std::vector<uint16_t> values;
    };
    static Png readPngValues(const fs::path& path) {
        Png image;
        std::FILE* file = std::fopen(path.c_str(), "rb");
        if (!file) return image;
        png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
        png_infop info = png_create_info_struct(png);
        png_init_io(png, file);
        png_read_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);
        image.width = png_get_image_width(png, info);
        image.height = png_get_image_height(png, info);
        image.bits = png_get_bit_depth(png, info);
        image.channels = png_get_channels(png, info);
        png_bytepp rows = png_get_rows(png, info);
        for (uint32_t y = 0; y < image.height; ++y)
            for (uint32_t i = 0; i < image.width * image.channels; ++i)
                image.values.push_back(image.bits == 16 ? uint16_t(rows[y][2 * i] << 8 | rows[y][2 * i + 1])
                                                        : rows[y][i]);
        png_destroy_read_struct(&png, &info, nullptr);
        std::fclose(file);
        return image;
    }

    fs::path folder_;
};

TEST_F(ImageFiles, DepthAsPfmKeepsEveryBitLowerRowFirst) {
    const std::vector<float> depth = {1.5f, kNoHit, 3.25f, 4, 5, 6e20f};
    const fs::path path = folder_ / "depth.pfm";
    ASSERT_TRUE(writeDepth(depth, 3, 2, path));
    const std::string content = contentOf(path);
    const std::string head = "Pf\n3 2\n-1.0\n";
    ASSERT_EQ(content.size(), head.size() + 24);
    EXPECT_EQ(content.substr(0, head.size()), head);
    std::vector<float> read(6);
    std::memcpy(read.data(), content.data() + head.size(), 24);
    EXPECT_EQ(read, (std::vector<float>{4, 5, 6e20f, 1.5f, kNoHit, 3.25f}));
}

TEST_F(ImageFiles, DepthAsPngSpansTheHits) {
    const std::vector<float> depth = {10, kNoHit, 20, 15};
    const fs::path path = folder_ / "depth.png";
    ASSERT_TRUE(writeDepth(depth, 2, 2, path));
    const Png image = readPngValues(path);
    EXPECT_EQ(image.bits, 16);
    EXPECT_EQ(image.channels, 1);
    EXPECT_EQ(image.values, (std::vector<uint16_t>{1, 0, 65535, 32768}));
}

TEST_F(ImageFiles, DepthOfOneDistanceAndOfNothing) {
    ASSERT_TRUE(writeDepth(std::vector<float>{7, 7}, 2, 1, folder_ / "one.png"));
    EXPECT_EQ(readPngValues(folder_ / "one.png").values, (std::vector<uint16_t>{1, 1}));
    ASSERT_TRUE(writeDepth(std::vector<float>{kNoHit, kNoHit}, 2, 1, folder_ / "none.png"));
    EXPECT_EQ(readPngValues(folder_ / "none.png").values, (std::vector<uint16_t>{0, 0}));
    EXPECT_EQ(depthRange(std::vector<float>{kNoHit}).farthest, 0);
}

TEST_F(ImageFiles, Normals) {
    const std::vector<glm::vec3> normals = {{0, 0, 1}, {-1, 0, 0}, {0, 0, 0}};
    ASSERT_TRUE(writeNormals(normals, 3, 1, folder_ / "n.png"));
    const Png image = readPngValues(folder_ / "n.png");
    EXPECT_EQ(image.channels, 3);
    EXPECT_EQ(image.values, (std::vector<uint16_t>{128, 128, 255, 1, 128, 128, 0, 0, 0}));
    ASSERT_TRUE(writeNormals(normals, 3, 1, folder_ / "n.pfm"));
    const std::string content = contentOf(folder_ / "n.pfm");
    EXPECT_EQ(content.substr(0, 12), "PF\n3 1\n-1.0\n");
    EXPECT_EQ(content.size(), 12u + 36u);
}

TEST_F(ImageFiles, FailuresNameTheFileAndLeaveNothing) {
    const std::vector<float> depth = {1};
    const auto unknown = writeDepth(depth, 1, 1, folder_ / "depth.jpg");
    ASSERT_FALSE(unknown);
    EXPECT_EQ(unknown.error().file, (folder_ / "depth.jpg").string());
    const auto nowhere = writeDepth(depth, 1, 1, folder_ / "missing" / "depth.png");
    ASSERT_FALSE(nowhere);
    EXPECT_EQ(nowhere.error().code, ErrorCode::Io);
    fs::create_directories(folder_ / "folder.pfm" / "full");
    ASSERT_FALSE(writeDepth(depth, 1, 1, folder_ / "folder.pfm"));
    EXPECT_FALSE(fs::exists(folder_ / "folder.pfm.partial"));
}

}  // namespace
}  // namespace vcp
