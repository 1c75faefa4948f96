// No seams: pictures of surfaces of many pages, whose image of many tiles changes evenly, have the colour of the place
// that each pixel shows: along the borders of leaves, pages and tiles as elsewhere, at every distance.
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

#include <gtest/gtest.h>

#include "builder/stream/colour_encoding.h"
#include "render/host_renderer.h"
#include "tests/support/built_walls.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

constexpr uint32_t kTexels = 1024;  // of the image, along both axes: 4 x 4 tiles, and a tile at level 2
constexpr uint32_t kSize = 160;     // of pictures, pixels
constexpr double kDarkest = 0.05, kLightest = 0.8;

/// Light that grows and falls evenly along an axis of the image, between kDarkest and kLightest, over `ramp` texels
/// each. Borders of tiles, each 256 texels, lie in the middle between two turns.
struct Ramps {
    double ramp;

    /// `at`: texels from the image's border.
    [[nodiscard]] double light(double at) const {
        const double inPeriod = std::fmod(at + 1.5 * ramp, 2 * ramp) / ramp;
        return kDarkest + (kLightest - kDarkest) * (1 - std::abs(1 - inPeriod));
    }
    /// Returns how far the next turn or border of the image is, texels.
    [[nodiscard]] double toTurn(double at) const {
        const double inRamp = std::fmod(at + 0.5 * ramp, ramp);
        return std::min({inRamp, ramp - inRamp, at, kTexels - at});
    }
};

/// What a picture has.
struct Seen {
    uint64_t compared = 0, wrong = 0;
    double farthest = 0;  ///< stored values, of 255
    uint32_t coarsestLevel = 0, finestLevel = 0;
};

class ImageSeams : public testing::Test {
protected:
    /// Builds a surface over the unit square, `height` above it, with 2 x kQuads x kQuads triangles. Its image lies
    /// straight over the square: red grows along x, green along y.
    template <class Height>
    void build(const Ramps& ramps, const Height& height) {
        constexpr int kQuads = 48;
        ramps_ = ramps;
        const auto stored = [&](uint32_t texel) { return uint32_t(toByte(linearToSrgb(ramps.light(texel + 0.5)))); };
        test::writeTexels(folder_ / "ramps.png", kTexels, kTexels,
                          [&](uint32_t x, uint32_t y) { return stored(x) | stored(kTexels - 1 - y) << 8; });
        std::ofstream(folder_ / "ramps.mtl") << "newmtl m\nmap_Kd ramps.png\n";
        std::ofstream obj(folder_ / "ramps.obj");
        obj << "mtllib ramps.mtl\nusemtl m\n";
        for (int j = 0; j <= kQuads; ++j)
            for (int i = 0; i <= kQuads; ++i) {
                const double x = double(i) / kQuads, y = double(j) / kQuads;
                obj << fmt::format("v {0} {1} {2}\nvt {0} {1}\n", x, y, height(x, y));
            }
        for (int j = 0; j < kQuads; ++j)
            for (int i = 0; i < kQuads; ++i) {
                const int a = j * (kQuads + 1) + i + 1, b = a + 1, c = b + kQuads + 1, d = a + kQuads + 1;
                obj << fmt::format("f {0}/{0} {1}/{1} {2}/{2}\nf {0}/{0} {2}/{2} {3}/{3}\n", a, b, c, d);
            }
        obj.close();
        const auto report = buildOctree(test::keepingImages(folder_ / "ramps.obj", folder_ / "ramps.vcp", 1.0 / 96));
        ASSERT_TRUE(report.ok()) << report.error().line();
        surface_ = test::placedFile(folder_ / "ramps.vcp");
        ASSERT_TRUE(surface_.dataset);
        ASSERT_GT(surface_.dataset->pages.size(), 20u);
        auto renderer = HostRenderer::create({});
        ASSERT_TRUE(renderer.ok());
        renderer_ = *std::move(renderer);
        ASSERT_TRUE(renderer_->open({surface_}, {}).ok());
    }

    /// Looks at a point of the surface from so far, `towards` it.
    [[nodiscard]] static FrameRequest from(glm::dvec3 at, double distance, glm::dvec3 towards) {
        FrameRequest request;
        request.width = request.height = kSize;
        request.shading.mode = ShadingMode::Unlit;
        request.camera.forward = glm::normalize(towards);
        request.camera.eye = at - distance * request.camera.forward;
        request.camera.up = {0, 1, 0.1};
        request.camera.verticalFov = 0.7;
        return request;
    }

    /// Draws from so far, and compares each pixel that is as far from the image's turns as its filter may reach.
    /// `pixels`: how far, in pixels, the place that a pixel shows the colour of may be from its own.
    Seen seen(double distance, glm::dvec3 towards, double pixels) {
        // What 8 bits, their means in coarser levels, and those levels' coding come to.
        constexpr double kRounding = 2;
        const FrameRequest request = from({0.5, 0.5, 0}, distance, towards);
        const double texels = distance * 2 * std::tan(request.camera.verticalFov / 2) / kSize * kTexels;
        const double step = pixels * texels / std::abs(request.camera.forward.z);
        Seen found;
        const auto settled = renderer_->drawSettled(request);
        EXPECT_TRUE(settled.ok());
        found.coarsestLevel = settled->update.coarsestLevel;
        found.finestLevel = settled->update.finestLevel;
        const auto picture = renderer_->readPicture();
        const auto depth = renderer_->readDepth();
        const auto stored = [&](double at) { return 255 * linearToSrgb(ramps_.light(at)); };
        for (uint32_t y = 0; y < kSize; ++y)
            for (uint32_t x = 0; x < kSize; ++x) {
                const size_t pixel = size_t{y} * kSize + x;
                if (!std::isfinite((*depth)[pixel])) continue;
                const CameraRay ray = cameraRay(request.camera, kSize, kSize, x + 0.5, y + 0.5);
                const glm::dvec3 at = double(kTexels) * (ray.origin + double((*depth)[pixel]) * ray.direction);
                if (std::min(ramps_.toTurn(at.x), ramps_.toTurn(at.y)) < 2 + 3 * texels) continue;
                ++found.compared;
                double off = 0;
                for (glm::length_t c = 0; c < 2; ++c) {
                    const auto [low, high] = std::minmax({stored(at[c] - step), stored(at[c] + step)});
                    const double shown = picture->rgba[4 * pixel + size_t(c)];
                    off = std::max({off, low - shown, shown - high});
                }
                found.wrong += off > kRounding ? 1 : 0;
                found.farthest = std::max(found.farthest, off);
            }
        return found;
    }

    TestFolder folder_{"vcp_image_seams"};
    Ramps ramps_{0};
    PlacedDataset surface_;
    std::unique_ptr<HostRenderer> renderer_;
};

double flat(double, double) { return 0; }
double waves(double x, double y) { return 0.05 * std::sin(7 * x) * std::cos(9 * y); }
constexpr std::array kSurfaces = {flat, waves};
constexpr std::array kDirections = {glm::dvec3(0, 0, -1), glm::dvec3(0.5, 0.7, -1)};

TEST_F(ImageSeams, ImagesHaveNoneBetweenTrianglesPagesAndTiles) {
    for (const auto surface : kSurfaces) {
        build({64}, surface);
        uint64_t compared = 0;
        for (const glm::dvec3 towards : kDirections)
            for (const double distance : {0.02, 0.1, 0.3, 0.7, 1.5}) {
                const Seen found = seen(distance, towards, 0);
                EXPECT_EQ(found.wrong, 0u) << distance << ", " << towards.x << ": " << found.farthest << " off";
                EXPECT_EQ(found.finestLevel + 1, surface_.dataset->header.levels) << distance;
                compared += found.compared;
            }
        EXPECT_GT(compared, 100000u);
    }
}

TEST_F(ImageSeams, SlabsHaveNoneBetweenThemPagesAndLevels) {
    for (const auto surface : kSurfaces) {
        build({512}, surface);
        uint64_t compared = 0;
        uint32_t coarsest = 9;
        for (const glm::dvec3 towards : kDirections)
            for (const double distance : {3.0, 4.0, 6.0, 10.0}) {
                // A slab has one colour, and may be 1.4 pixels wide.
                const Seen found = seen(distance, towards, 0.7);
                EXPECT_EQ(found.wrong, 0u) << distance << ", " << towards.x << ": " << found.farthest << " off";
                coarsest = std::min(coarsest, found.finestLevel);
                compared += found.compared;
            }
        EXPECT_EQ(coarsest, 0u) << "each level is seen";
        EXPECT_GT(compared, 5000u);
    }
}

}  // namespace
}  // namespace vcp
