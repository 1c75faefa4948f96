// Legends against the pixels that they explain.
#include "viewer/annotation/legend.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <gtest/gtest.h>
#include <glm/common.hpp>

#include "render/view/renderer.h"
#include "tests/support/built_ball.h"
#include "viewer/camera/orbit_camera.h"

namespace vcp {
namespace {

using Rgb = glm::ivec3;

Rgb bytesOf(glm::vec3 colour) { return Rgb(255.0f * colour + 0.5f); }
Rgb pixelOf(const Picture& picture, size_t i) {
    return {picture.rgba[4 * i], picture.rgba[4 * i + 1], picture.rgba[4 * i + 2]};
}
/// Processors round differently.
bool isSame(Rgb a, Rgb b) {
    const Rgb by = glm::abs(a - b);
    return std::max({by.x, by.y, by.z}) <= 1;
}

class LegendTest : public BuiltBall {
protected:
    void SetUp() override {
        if (!listDevices()) GTEST_SKIP() << "no Vulkan device";
        RendererOptions options;
        options.budgetBytes = 64 << 20;
        renderer_ = Renderer::create(options).value();
        auto reader = openFile(*folder_ / "ball.vcp").value();
        dataset_ = std::make_shared<const Dataset>(readDataset(*reader).value());
        ASSERT_TRUE(renderer_->open({{dataset_, std::make_shared<FilePageSource>(reader, dataset_), {}}}, {}));
    }

    static FrameRequest request(ShadingMode mode, double errorPixels) {
        OrbitCamera camera;
        camera.projection = Projection::Orthographic;
        camera.look(View::Isometric, {glm::dvec3(-1.1), glm::dvec3(1.1)}, {96, 64});
        FrameRequest request;
        request.camera = camera.current();
        request.width = 96;
        request.height = 64;
        request.errorPixels = errorPixels;
        request.shading.mode = mode;
        return request;
    }

    /// Colours of the pixels that are hit.
    std::vector<Rgb> hitColours(const FrameRequest& request) {
        EXPECT_TRUE(renderer_->settle(request));
        EXPECT_TRUE(renderer_->render(request));
        const Picture picture = renderer_->readPicture().value();
        const std::vector<float> depth = renderer_->readDepth().value();
        std::vector<Rgb> colours;
        for (size_t i = 0; i < depth.size(); ++i)
            if (std::isfinite(depth[i])) colours.push_back(pixelOf(picture, i));
        EXPECT_GT(colours.size(), 500u);
        return colours;
    }
    [[nodiscard]] Legend legendOf(ShadingMode mode) const {
        return legendsOf(mode, {.levels = {dataset_->header.levels}, .hasRelief = false}).at(0);
    }

    std::unique_ptr<Renderer> renderer_;
    std::shared_ptr<const Dataset> dataset_;
};

TEST_F(LegendTest, CountsHaveTheColoursOfTheirPixels) {
    for (const ShadingMode mode : {ShadingMode::Steps, ShadingMode::Cells, ShadingMode::Fetches}) {
        const FrameRequest counted = request(mode, 0.5);
        ASSERT_FALSE(hitColours(counted).empty());
        const Picture picture = renderer_->readPicture().value();
        const std::vector<uint32_t> work = renderer_->readWork().value();
        const Legend legend = legendOf(mode);
        std::set<uint32_t> seen;
        for (size_t i = 0; i < work.size(); ++i) {
            if (work[i] == 0) continue;
            seen.insert(work[i]);
            EXPECT_TRUE(isSame(pixelOf(picture, i), bytesOf(legend.colourOf(work[i])))) << work[i];
        }
        EXPECT_GT(seen.size(), 2u);
    }
}

TEST_F(LegendTest, LevelsHaveTheColoursOfTheirPixels) {
    const Legend legend = legendOf(ShadingMode::Level);
    ASSERT_EQ(legend.bands, dataset_->header.levels);
    for (const Rgb& colour : hitColours(request(ShadingMode::Level, 1000)))
        ASSERT_TRUE(isSame(colour, bytesOf(legend.colourOf(0))));
    for (const Rgb& colour : hitColours(request(ShadingMode::Level, 0.01)))
        ASSERT_TRUE(isSame(colour, bytesOf(legend.colourOf(dataset_->header.levels - 1))));
}

TEST_F(LegendTest, ErrorsHaveTheColoursOfTheirPixels) {
    FrameRequest coarse = request(ShadingMode::Error, 1000);
    // Pixels so large that the coarsest page errs by a part of one.
    const double error = dataset_->pages[0].certifiedError;
    coarse.camera.orthographicHeight = std::max(coarse.camera.orthographicHeight, error * coarse.height / 0.6);
    const double pixels = error * coarse.height / coarse.camera.orthographicHeight;
    ASSERT_GT(pixels, 0.01);
    // Shaders get errors rounded up, to 8 bits.
    const Legend legend = legendOf(ShadingMode::Error);
    const Rgb least = bytesOf(legend.colourOf(pixels)), most = bytesOf(legend.colourOf(pixels * (1 + 1.0 / 128)));
    for (const Rgb& colour : hitColours(coarse)) {
        const Rgb outside = glm::max(glm::min(least, most) - colour, colour - glm::max(least, most));
        ASSERT_LE(std::max({outside.x, outside.y, outside.z}), 1) << pixels;
    }
}

TEST(Legend, SaysWhatIsThere) {
    const LegendSubject ball{.levels = {4}, .hasRelief = false};
    EXPECT_TRUE(legendsOf(ShadingMode::Lit, ball).empty());
    EXPECT_TRUE(legendsOf(ShadingMode::Normals, ball).empty());
    EXPECT_TRUE(legendsOf(ShadingMode::Error, {}).empty());
    EXPECT_TRUE(legendsOf(ShadingMode::Error, {.levels = {0}, .hasRelief = false}).empty())
        << "nothing is certified of the paper's method";
    EXPECT_EQ(legendsOf(ShadingMode::Error, ball).at(0).title(), "Error, pixels");
    EXPECT_EQ(legendsOf(ShadingMode::Steps, {.levels = {4}, .hasRelief = true}).size(), 2u);
    const Legend mixed = legendsOf(ShadingMode::Level, {.levels = {4, 6}, .hasRelief = false}).at(0);
    EXPECT_EQ(mixed.bands, 0u);
    EXPECT_EQ(mixed.ticks.at(0).text, "coarsest");
}

}  // namespace
}  // namespace vcp
