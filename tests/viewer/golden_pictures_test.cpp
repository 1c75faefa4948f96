// Pictures as they were when somebody looked at them: tests/viewer/golden/*.png. Devices and compilers of shaders round
// differently, so a few pixels may differ; and what must hold of a picture whatever it looks like is asked beside it.
//
// After a change that is meant: VCP_KEEP_GOLDEN=1 test_viewer --gtest_filter='GoldenPictures.*', then look at each.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "render/picture.h"
#include "render/view/renderer.h"
#include "tests/support/vcp_program.h"

namespace vcp {
namespace {

constexpr uint32_t kWidth = 160, kHeight = 120;
constexpr int kSame = 6;              // of 255: a channel that differs by no more is the same
constexpr double kMostPixels = 0.01;  // of the picture may differ by more

class GoldenPictures : public testing::Test {
protected:
    static void SetUpTestSuite() {
        folder_ = std::make_unique<TestFolder>("vcp_golden_pictures_test");
        writeBall(*folder_ / "ball.ply", 60, 120);
        const std::string makeScan = (std::filesystem::path(VCP_EXECUTABLE).parent_path() / "make_scan").string();
        ASSERT_EQ(
            std::system((makeScan + " --triangles 30000 --colour -o " + path("statue.ply") + " >/dev/null").c_str()),
            0);
        for (const char* name : {"statue", "ball"}) {
            const Ran built =
                VcpProgram(*folder_).runWords(fmt::format("build {0}.ply -o {0}.vcp --progress none", path(name)));
            ASSERT_EQ(built.status, 0) << built.err;
        }
    }
    static void TearDownTestSuite() { folder_.reset(); }
    void SetUp() override {
        if (!listDevices()) GTEST_SKIP() << "no Vulkan device";
    }

    static std::string path(const std::string& name) { return (*folder_ / name).string(); }

    /// Drawn with `options` and one sample, and as it was.
    Picture draw(const std::string& name, const std::string& options, const std::string& input = path("statue.vcp")) {
        const Ran ran = VcpProgram(*folder_).runWords(
            fmt::format("render {} -o {} --samples 1 --size {}x{} --progress none --depth {} --normals {} {}", input,
                        path(name + ".png"), kWidth, kHeight, path("depth.pfm"), path("normals.pfm"), options));
        EXPECT_EQ(ran.status, 0) << ran.err;
        const auto picture = readPng(path(name + ".png"));
        EXPECT_TRUE(picture) << picture.error().line();
        const std::string kept = VCP_SOURCE_DIR "/tests/viewer/golden/" + name + ".png";
        if (std::getenv("VCP_KEEP_GOLDEN") != nullptr) {
            EXPECT_TRUE(writePng(*picture, kept).ok());
        }
        const auto golden = readPng(kept);
        EXPECT_TRUE(golden) << golden.error().line();
        EXPECT_EQ(picture->rgba.size(), golden->rgba.size());
        size_t different = 0;
        for (size_t i = 0; i < picture->rgba.size(); i += 4) {
            int most = 0;
            for (size_t c = i; c < i + 4; ++c)
                most = std::max(most, std::abs(int(picture->rgba[c]) - int(golden->rgba[c])));
            different += most > kSame;
        }
        EXPECT_LE(double(different), kMostPixels * kWidth * kHeight) << name << ": compare " << kept;
        return *picture;
    }

    /// Floats of a .pfm, upper row first.
    static std::vector<float> plane(const std::string& name, size_t channels) {
        const std::string bytes = contentOf(path(name));
        const size_t row = kWidth * channels * sizeof(float), at = bytes.size() - row * kHeight;
        std::vector<float> values(kWidth * channels * kHeight);
        for (size_t y = 0; y < kHeight; ++y)
            std::memcpy(&values[y * kWidth * channels], &bytes[at + (kHeight - 1 - y) * row], row);
        return values;
    }
    static int brightness(const Picture& p, size_t pixel) {
        return p.rgba[4 * pixel] + p.rgba[4 * pixel + 1] + p.rgba[4 * pixel + 2];
    }

    static std::unique_ptr<TestFolder> folder_;
};
std::unique_ptr<TestFolder> GoldenPictures::folder_;

TEST_F(GoldenPictures, LightMakesNothingBrighter) {
    const Picture lit = draw("lit", "--light raking");
    const Picture shadows = draw("shadows", "--light raking --shadows --occlusion 16");
    size_t darker = 0;
    for (size_t i = 0; i < kWidth * kHeight; ++i) {
        EXPECT_LE(brightness(shadows, i), brightness(lit, i) + kSame) << i;
        darker += brightness(shadows, i) < brightness(lit, i) - 30;
    }
    EXPECT_GT(darker, kWidth * kHeight / 50);
}

TEST_F(GoldenPictures, TransparentWhereNothingIsHit) {
    const Picture picture = draw("transparent", "--shading unlit --transparent --camera iso");
    const std::vector<float> depth = plane("depth.pfm", 1);
    size_t hits = 0;
    for (size_t i = 0; i < depth.size(); ++i) {
        EXPECT_EQ(picture.rgba[4 * i + 3], std::isfinite(depth[i]) ? 255 : 0) << i;
        hits += std::isfinite(depth[i]);
    }
    EXPECT_GT(hits, depth.size() / 20);
}

TEST_F(GoldenPictures, NormalsAreUnitAndFaceTheEye) {
    const Picture picture = draw("normals", "--shading normals --camera front --transparent");
    const std::vector<float> normals = plane("normals.pfm", 3), depth = plane("depth.pfm", 1);
    for (size_t i = 0; i < depth.size(); ++i) {
        if (!std::isfinite(depth[i])) continue;
        const float* n = &normals[3 * i];
        ASSERT_NEAR(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1, 1e-3) << i;
        ASSERT_GT(n[2], -0.5f) << i << ": seen from the front";
        for (int c = 0; c < 3; ++c) ASSERT_NEAR(picture.rgba[4 * i + size_t(c)], (n[c] * 0.5 + 0.5) * 255, 2) << i;
    }
}

TEST_F(GoldenPictures, NothingIsSeenBeforeTheSection) {
    const Picture picture = draw("section", "--section z<0 --caps --camera front --shading clay", path("ball.vcp"));
    const std::vector<float> depth = plane("depth.pfm", 1), normals = plane("normals.pfm", 3);
    // In the middle the ray looks along -z: what it hits first is the cap, and its normal is the plane's.
    const size_t middle = kHeight / 2 * kWidth + kWidth / 2;
    ASSERT_TRUE(std::isfinite(depth[middle]));
    EXPECT_NEAR(normals[3 * middle + 2], 1, 1e-3);
    EXPECT_GT(picture.rgba[4 * middle], picture.rgba[4 * middle + 2] + 40) << "caps are red";
    const float nearest = *std::min_element(depth.begin(), depth.end());
    EXPECT_NEAR(nearest, depth[middle], 0.01f * depth[middle]);
}

TEST_F(GoldenPictures, ErrorsAreWithinWhatWasAsked) {
    draw("error", "--shading error --error-pixels 1");
    draw("level", "--shading level --error-pixels 4 --camera iso");
}

TEST_F(GoldenPictures, MesostructureOverADataset) {
    const std::string scene = path("scene.json");
    std::ofstream(scene) << R"({"datasets": [{"file": "statue.vcp", "scale": 0.45, "translate": [0, 0.1, 0]}],
        "mesostructure": [{"asset": "weave", "tiles": 3, "up": "y", "colour": [0.8, 0.6, 0.4]}],
        "lights": [{"direction": [-0.5, 0.8, 0.4]}], "camera": {"position": [0.9, 1.3, 1.9], "target": [0, 0.1, 0]}})";
    draw("mesostructure", "--shadows", scene);
    size_t hits = 0;
    for (const float depth : plane("depth.pfm", 1)) hits += std::isfinite(depth);
    EXPECT_GT(hits, kWidth * kHeight / 4);
}

}  // namespace
}  // namespace vcp
