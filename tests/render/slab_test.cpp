// Slab leaves on the device: pictures against the reference ray-caster, and no holes where levels meet.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/reference_comparison.h"

namespace vcp {
namespace {

using test::cameras;
using test::compare;
using test::Comparison;
using test::NamedCamera;
using test::requestOf;
using test::Scene;

const glm::dvec3 kCentre = 64.0 * glm::dvec3(0.503, 0.497, 0.501);
constexpr double kRadius = 26;

/// A sphere of three levels, of which the coarsest `slabLevels` have slab leaves.
test::AnalyticDataset sphereOf(uint32_t slabLevels) {
    test::AnalyticOptions o;
    o.levels = 3;
    o.slabLevels = slabLevels;
    o.errorCells = 0.3;
    test::AnalyticDataset made = test::analyticDataset(test::sphere(kCentre, kRadius), o);
    if (slabLevels == o.levels) made.dataset.header.flags |= kFlagCovering;
    return made;
}

class SlabTest : public test::RendererFixture, public testing::WithParamInterface<PageAccess> {
protected:
    void startWithAccess() {
        RendererOptions options;
        options.access = GetParam();
        start(options);
    }
};

TEST_P(SlabTest, EveryCameraAgreesWithTheReference) {
    startWithAccess();
    for (const uint32_t slabLevels : {1u, 2u, 3u}) {
        test::AnalyticDataset made = sphereOf(slabLevels);
        made.dataset.header.flags &= ~kFlagCovering;  // the reference casts against whole pages
        const Scene scene = test::sceneOf("slabs", std::move(made));
        show(scene);
        uint64_t hits = 0, otherNormals = 0;
        for (const NamedCamera& named : cameras(scene)) {
            SCOPED_TRACE(named.name + std::string(", slab levels ") + std::to_string(slabLevels));
            FrameRequest request = requestOf(named.camera);
            // The coarsest page, the next level, and whatever the camera asks for.
            for (const double errorPixels : {100.0, 5.0, 0.2}) {
                request.errorPixels = errorPixels;
                draw(request);
                const Comparison c = compare(*renderer_, scene, request);
                hits += c.hit;
                otherNormals += c.otherNormal;
                EXPECT_LE(c.missed + c.wrong, 2u) << "single precision may decide differently at an outline, no more";
                const double reach = glm::length(named.camera.eye - kCentre);
                EXPECT_LT(c.depthSum / double(std::max<uint64_t>(c.hit, 1)), 4e-4 + 1e-7 * reach);
                EXPECT_LT(c.normalMax, 0.3);
            }
        }
        EXPECT_GT(hits, 30000u) << "the cameras must see something";
        EXPECT_LE(otherNormals * 1000, hits) << otherNormals << " of " << hits << ": blended otherwise";
    }
}

TEST_P(SlabTest, NoHolesWhereLevelsMeet) {
    startWithAccess();
    const Scene scene = test::sceneOf("slabs", sphereOf(3));
    show(scene);
    uint64_t hits = 0, coarse = 0;
    for (const NamedCamera& named : cameras(scene)) {
        SCOPED_TRACE(named.name);
        for (const double errorPixels : {1.0, 2.0, 4.0, 8.0}) {
            FrameRequest request = requestOf(named.camera);
            request.errorPixels = errorPixels;
            draw(request);
            const auto depth = renderer_->readDepth();
            ASSERT_TRUE(depth);
            for (uint32_t y = 0; y < request.height; ++y)
                for (uint32_t x = 0; x < request.width; ++x) {
                    const CameraRay ray = cameraRay(request.camera, request.width, request.height, x + 0.5, y + 0.5);
                    const double along = glm::dot(kCentre - ray.origin, ray.direction);
                    const double off = glm::length(ray.origin + along * ray.direction - kCentre);
                    // Rays that pass well within the sphere meet it.
                    if (off > kRadius - 0.01 || along < 0) continue;
                    ++hits;
                    const double at = (*depth)[size_t{y} * request.width + x];
                    ASSERT_TRUE(std::isfinite(at)) << "a hole at " << x << ", " << y;
                    const double fromSurface =
                        std::abs(glm::length(ray.origin + at * ray.direction - kCentre) - kRadius);
                    coarse += fromSurface > 0.1 ? 1 : 0;
                    ASSERT_LT(fromSurface, 2) << "half of the coarsest cell";
                }
        }
    }
    // Finest cells and coarser ones were seen.
    EXPECT_GT(coarse, 10000u);
    EXPECT_GT(hits - coarse, 20000u);
}

TEST_P(SlabTest, ColoursAreThoseOfTheVectors) {
    startWithAccess();
    test::AnalyticDataset made = sphereOf(3);
    made.dataset.header.flags |= kFlagColour;
    for (size_t page = 0; page < made.pages.size(); ++page) {
        PageHeader header;
        std::memcpy(&header, made.pages[page].geometryBytes().data(), sizeof header);
        made.pages[page].colour.assign(colourPageBytes(header) / 16, uint4(0xff2040e0));  // RGBA bytes e0 40 20 ff
        made.dataset.pages[page].colourBytes = uint32_t(colourPageBytes(header));
    }
    const Scene scene = test::sceneOf("painted slabs", std::move(made));
    show(scene);
    FrameRequest request = requestOf(cameras(scene)[0].camera);
    draw(request);
    const Picture picture = *renderer_->readPicture();
    const uint8_t* p = &picture.rgba[4 * (size_t{60} * 160 + 80)];
    EXPECT_NEAR(double(p[1]) / p[0], double(0x40) / 0xe0, 0.03);
    EXPECT_NEAR(double(p[2]) / p[0], double(0x20) / 0xe0, 0.03);
}

INSTANTIATE_TEST_SUITE_P(Access, SlabTest, testing::Values(PageAccess::TexelBuffer, PageAccess::StorageBuffer),
                         [](const auto& named) {
                             return named.param == PageAccess::TexelBuffer ? "Texel" : "Storage";
                         });

}  // namespace
}  // namespace vcp
