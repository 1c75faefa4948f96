// Pictures in tiles against the same picture at once, and against the small picture.
#include "viewer/picture/tiled_picture.h"

#include <chrono>
#include <cmath>
#include <cstdlib>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "tests/support/built_ball.h"
#include "viewer/camera/orbit_camera.h"

namespace vcp {
namespace {

/// By a Vulkan device and by the host.
class TiledPictureTest : public BuiltBall, public testing::WithParamInterface<const char*> {
protected:
    void SetUp() override {
        RendererOptions options;
        options.device = GetParam();
        if (!isHostName(options.device) && !listDevices()) GTEST_SKIP() << "no Vulkan device";
        options.budgetBytes = 64 << 20;
        renderer_ = *createPictureRenderer(options);
        auto reader = openFile(*folder_ / "ball.vcp").value();
        const auto dataset = std::make_shared<const Dataset>(readDataset(*reader).value());
        ASSERT_TRUE(renderer_->open({{dataset, std::make_shared<FilePageSource>(reader, dataset), {}}}, {}));
    }

    static FrameRequest request(uint32_t width, uint32_t height, Projection projection = Projection::Perspective) {
        OrbitCamera camera;
        camera.projection = projection;
        camera.look(View::Isometric, {glm::dvec3(-1.1), glm::dvec3(1.1)}, {int(width), int(height)});
        FrameRequest request;
        request.camera = camera.current();
        request.width = width;
        request.height = height;
        request.errorPixels = 0.02;  // the finest level, whatever the size
        return request;
    }

    Picture atOnce(const FrameRequest& request) {
        EXPECT_TRUE(renderer_->settle(request));
        EXPECT_TRUE(renderer_->render(request));
        return renderer_->readPicture().value();
    }

    Picture inTiles(const FrameRequest& request, uint32_t tile, PictureBand* planes = nullptr, uint32_t samples = 1) {
        TiledPictureOptions options;
        options.tile = tile;
        options.samples = samples;
        options.depth = options.normals = planes != nullptr;
        Picture picture{request.width, request.height, {}};
        TiledPicture tiled(*renderer_, request, options, [&](const PictureBand& band) -> Result<void> {
            picture.rgba.insert(picture.rgba.end(), band.picture.rgba.begin(), band.picture.rgba.end());
            if (planes) planes->depth.insert(planes->depth.end(), band.depth.begin(), band.depth.end());
            if (planes) planes->normals.insert(planes->normals.end(), band.normals.begin(), band.normals.end());
            return {};
        });
        double last = 0;
        for (Result<bool> done = false; done && !*done;) {
            done = tiled.step();
            EXPECT_TRUE(done) << done.error().line();
            if (tiled.isWaiting()) renderer_->waitForPage(std::chrono::milliseconds(100));
            EXPECT_GE(tiled.fraction(), last);
            last = tiled.fraction();
        }
        EXPECT_EQ(last, 1);
        EXPECT_EQ(picture.rgba.size(), size_t{4} * request.width * request.height);
        return picture;
    }

    /// Part of the pixels that differ by more than `by`.
    static double differing(const Picture& a, const Picture& b, int by) {
        if (a.rgba.size() != b.rgba.size()) return 1;
        size_t count = 0;
        for (size_t i = 0; i < a.rgba.size(); i += 4)
            for (size_t c = 0; c < 4; ++c)
                if (std::abs(a.rgba[i + c] - b.rgba[i + c]) > by) {
                    ++count;
                    break;
                }
        return 4.0 * double(count) / double(a.rgba.size());
    }

    std::unique_ptr<PictureRenderer> renderer_;
};

// Rays of a tile are those of the whole but for rounding: a silhouette's pixel may flip.
TEST_P(TiledPictureTest, TilesMakeThePictureThatIsDrawnAtOnce) {
    for (const Projection projection : {Projection::Perspective, Projection::Orthographic}) {
        const FrameRequest whole = request(250, 170, projection);
        const Picture expected = atOnce(whole);
        EXPECT_LT(differing(inTiles(whole, 100), expected, 2), 5e-4);
        EXPECT_EQ(inTiles(whole, 256), expected) << "one tile is the whole";
    }
}

TEST_P(TiledPictureTest, ShadowsAndOcclusionHaveNoSeams) {
    FrameRequest whole = request(200, 140);
    whole.shading.shadows = true;
    whole.shading.occlusionRays = 4;
    EXPECT_LT(differing(inTiles(whole, 64), atOnce(whole), 3), 3e-3);
}

// Three times the size: each third pixel of the large picture is at the place of one of the small one.
TEST_P(TiledPictureTest, TheLargePictureIsTheSmallOneEnlarged) {
    const Picture small = atOnce(request(96, 64)), large = inTiles(request(288, 192), 80);
    Picture shrunk{96, 64, {}};
    for (uint32_t y = 0; y < 64; ++y)
        for (uint32_t x = 0; x < 96; ++x) {
            const auto at = large.rgba.begin() + 4 * ((3 * y + 1) * 288 + 3 * x + 1);
            shrunk.rgba.insert(shrunk.rgba.end(), at, at + 4);
        }
    EXPECT_LT(differing(shrunk, small, 2), 2e-3);
}

TEST_P(TiledPictureTest, TilesHaveAllSamples) {
    FrameRequest whole = request(200, 150);
    whole.shading.transparent = true;
    const Picture plain = atOnce(whole);
    ASSERT_TRUE(renderer_->refineTo(8, whole));
    const Picture refined = renderer_->readPicture().value();
    EXPECT_GT(differing(refined, plain, 8), 0.005) << "edges are smooth";
    EXPECT_LT(differing(inTiles(whole, 64, nullptr, 8), refined, 4), 1e-3);
}

TEST_P(TiledPictureTest, DepthAndNormalsComeInTilesToo) {
    const FrameRequest whole = request(120, 90);
    PictureBand planes;
    inTiles(whole, 48, &planes, 3);  // depth and normals stay those of the first sample
    atOnce(whole);
    const auto depth = renderer_->readDepth().value();
    const auto normals = renderer_->readNormals().value();
    ASSERT_EQ(planes.depth.size(), depth.size());
    ASSERT_EQ(planes.normals.size(), normals.size());
    size_t wrong = 0;
    for (size_t i = 0; i < depth.size(); ++i)
        if (std::isfinite(depth[i]) != std::isfinite(planes.depth[i]) ||
            (std::isfinite(depth[i]) &&
             (std::abs(depth[i] - planes.depth[i]) > 1e-3f || glm::dot(normals[i], planes.normals[i]) < 0.99f)))
            ++wrong;
    EXPECT_LT(wrong, depth.size() / 500);
}

TEST_P(TiledPictureTest, TransparentIsAlphaZeroWhereNothingIsHit) {
    FrameRequest whole = request(96, 64);
    const Picture opaque = atOnce(whole);
    whole.shading.transparent = true;
    const Picture picture = inTiles(whole, 40);
    size_t clear = 0;
    for (size_t i = 0; i < picture.rgba.size(); i += 4) {
        EXPECT_EQ(opaque.rgba[i + 3], 255);
        if (picture.rgba[i + 3] == 0) {
            ++clear;
            EXPECT_EQ(picture.rgba[i], 0);
        } else {
            EXPECT_EQ(picture.rgba[i + 3], 255);
        }
    }
    EXPECT_GT(clear, 96u * 64u / 5);
    EXPECT_LT(clear, 96u * 64u * 19 / 20);
}

TEST_P(TiledPictureTest, ATileOutsideOfItsPictureIsRefused) {
    FrameRequest tile = request(32, 32);
    tile.tile = {80, 0, 96, 64};
    EXPECT_FALSE(renderer_->render(tile));
    tile.tile = {64, 32, 96, 64};
    EXPECT_TRUE(renderer_->update(tile));
    EXPECT_TRUE(renderer_->render(tile));
}

INSTANTIATE_TEST_SUITE_P(By, TiledPictureTest, testing::Values("", "host"),
                         [](const auto& named) { return std::string(named.param).empty() ? "Vulkan" : "Host"; });

}  // namespace
}  // namespace vcp
