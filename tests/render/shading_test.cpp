// Shadows, ambient occlusion, sections with caps, false colours.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/renderer_fixture.h"

namespace vcp {
namespace {

using test::requestOf;
using test::Scene;

constexpr uint32_t kWidth = 160, kHeight = 120;
const glm::dvec3 kView(-0.3, -0.5, -1);

class ShadingTest : public test::RendererFixture {
protected:
    Picture pictureOf(const FrameRequest& request) {
        draw(request);
        return *renderer_->readPicture();
    }
    glm::ivec3 middleOf(const Picture& picture) {
        const uint8_t* p = &picture.rgba[4 * (size_t{picture.height / 2} * picture.width + picture.width / 2)];
        return {p[0], p[1], p[2]};
    }
};

FrameRequest requestFor(const Scene& scene, glm::dvec3 forward = kView) {
    return requestOf(fitCamera(scene.boxMin, scene.boxMax, forward, {0, 1, 0}, 0.6, double(kWidth) / kHeight), kWidth,
                     kHeight);
}

// Nothing stands between a convex body and its light: not the body itself either.
TEST_F(ShadingTest, AConvexBodyCastsNoShadowOnItself) {
    start();
    for (const Scene& scene :
         {test::sphereScene(), test::sphereScene(3, glm::dvec3(4e6, -3e6, 1e6), 0.01), test::cubeScene(0)}) {
        show(scene);
        for (const double errorPixels : {0.2, 20.0})
            for (const glm::vec3 light :
                 {glm::vec3(-0.35, 0.55, 0.75), glm::vec3(-1, 0.05, 0.1), glm::vec3(0.2, 1, -0.6)}) {
                FrameRequest request = requestFor(scene);
                request.errorPixels = errorPixels;
                request.shading.lightDirection = light;
                const Picture plain = pictureOf(request);
                request.shading.shadows = true;
                request.shading.occlusionRays = 4;
                EXPECT_EQ(pictureOf(request), plain) << scene.name << ", " << errorPixels << " pixels";
            }
    }
}

TEST_F(ShadingTest, ATorusShadesItself) {
    start();
    const Scene scene = test::torusScene();
    show(scene);
    FrameRequest request = requestFor(scene);
    request.shading.lightFollowsCamera = false;
    request.shading.lightDirection = {-1, 0, 0.1};
    const Picture plain = pictureOf(request);
    const auto darker = [&](const Picture& picture) {
        uint64_t count = 0;
        for (size_t i = 0; i < plain.rgba.size(); ++i) {
            EXPECT_LE(picture.rgba[i], plain.rgba[i]);
            count += picture.rgba[i] + 4 < plain.rgba[i] ? 1 : 0;
        }
        return count / 3;
    };
    request.shading.shadows = true;
    EXPECT_GT(darker(pictureOf(request)), 40u);
    request.shading.shadows = false;
    request.shading.occlusionRays = 8;
    request.shading.occlusionRadius = 60;
    EXPECT_GT(darker(pictureOf(request)), 40u);
    request.shading.mode = ShadingMode::Normals;
    const Picture normals = pictureOf(request);
    request.shading.occlusionRays = 0;
    EXPECT_EQ(normals, pictureOf(request)) << "normals have no light";
}

TEST_F(ShadingTest, LightAndSectionsCostNothingWhenOff) {
    start();
    const Scene scene = test::sphereScene();
    show(scene);
    FrameRequest request = requestFor(scene);
    EXPECT_EQ(draw(request).pipelines, 3u);
    request.shading.shadows = true;
    EXPECT_EQ(draw(request).pipelines, 5u) << "light, and shading with it";
    request.shading.occlusionRays = 2;
    EXPECT_EQ(draw(request).pipelines, 5u);
    request.shading = {};
    request.sections = {{{1, 0, 0}, scene.boxMin.x}};
    EXPECT_EQ(draw(request).pipelines, 6u);
    request.sectionCaps = Caps::Closed;
    EXPECT_EQ(draw(request).pipelines, 7u);
    request.sections.clear();
    EXPECT_EQ(draw(request).pipelines, 7u);
}

// A sphere cut in half, looked at along the plane's normal: open, its far wall; with caps, the plane.
TEST_F(ShadingTest, SectionsShowTheFarWallOrTheCap) {
    for (const PageAccess access : {PageAccess::TexelBuffer, PageAccess::StorageBuffer}) {
        RendererOptions options;
        options.access = access;
        start(options);
        const Scene scene = test::sphereScene();
        show(scene);
        const double edge = scene.boxMax.x - scene.boxMin.x, radius = 0.41 * edge;
        const glm::dvec3 centre = scene.boxMin + glm::dvec3(0.503, 0.497, 0.501) * edge;
        FrameRequest request = requestFor(scene, {0, 0, -1});
        request.sections = {{{0, 0, -2}, -2 * (centre.z + 0.1 * radius)}};
        const double toPlane = request.camera.eye.z - (centre.z + 0.1 * radius);
        draw(request);
        const auto open = renderer_->pick(kWidth / 2, kHeight / 2);
        ASSERT_TRUE(open && *open);
        EXPECT_NEAR((*open)->depth, request.camera.eye.z - (centre.z - radius), 0.02 * radius);
        EXPECT_GT((*open)->normal.z, 0.9f);

        request.sectionCaps = Caps::Closed;
        const Picture capped = pictureOf(request);
        const auto cap = renderer_->pick(kWidth / 2, kHeight / 2);
        ASSERT_TRUE(cap && *cap);
        EXPECT_NEAR((*cap)->position.z, centre.z + 0.1 * radius, 1e-4 * toPlane);
        EXPECT_NEAR((*cap)->normal.z, 1, 1e-3);
        EXPECT_GT(middleOf(capped).r, middleOf(capped).g + 30) << "the caps have their colour";
        // Each pixel of the disc, and none about it.
        const std::vector<float> depth = *renderer_->readDepth();
        const double disc = radius * std::sqrt(1 - 0.01);
        for (uint32_t y = 0; y < kHeight; ++y)
            for (uint32_t x = 0; x < kWidth; ++x) {
                const CameraRay ray = cameraRay(request.camera, kWidth, kHeight, x + 0.5, y + 0.5);
                const double t = -toPlane / ray.direction.z;
                const double off = glm::length(glm::dvec2(ray.origin + t * ray.direction - centre));
                if (std::abs(off - disc) < 0.02 * radius) continue;
                const bool isCap = std::abs(depth[size_t{y} * kWidth + x] - t) < 1e-3 * t;
                EXPECT_EQ(isCap, off < disc) << x << " " << y;
            }

        request.sections = {{{0, 0, 1}, centre.z + 2 * radius}};
        EXPECT_EQ(draw(request).hitPixels, 0u) << "all is cut away";
        request.sections = {{{0, 0, -1}, -centre.z - 2 * radius}, {{1, 0, 0}, centre.x - 2 * radius}};
        const Picture whole = pictureOf(request);
        request.sections.clear();
        EXPECT_EQ(whole, pictureOf(request)) << "nothing is cut away";
    }
}

TEST_F(ShadingTest, FalseColours) {
    start();
    const Scene scene = test::sphereScene(3);
    show(scene);
    FrameRequest request = requestFor(scene);
    request.shading.mode = ShadingMode::Level;
    request.errorPixels = 1e-6;
    EXPECT_EQ(middleOf(pictureOf(request)), glm::ivec3(255, 0, 0)) << "the finest level";
    request.errorPixels = 1e6;
    EXPECT_EQ(middleOf(pictureOf(request)), glm::ivec3(0, 76, 255)) << "the coarsest";
    request.shading.mode = ShadingMode::Error;
    const glm::ivec3 coarse = middleOf(pictureOf(request));
    request.errorPixels = 1e-6;
    const glm::ivec3 fine = middleOf(pictureOf(request));
    EXPECT_GT(coarse.r + coarse.g - coarse.b, fine.r + fine.g - fine.b);
    request.shading.mode = ShadingMode::Fetches;
    draw(request);
    EXPECT_GT(std::ranges::max(renderer_->readWork().value()), 0u);
    request.shading.mode = ShadingMode::Unlit;
    const Picture unlit = pictureOf(request);
    request.shading.lightDirection = {0, 0, -1};
    EXPECT_EQ(pictureOf(request), unlit);
}

TEST_F(ShadingTest, WrongUseIsOneClearError) {
    start();
    const Scene scene = test::sphereScene();
    show(scene);
    const auto messageOf = [&](const FrameRequest& request) {
        const auto update = renderer_->update(request);
        return update ? std::string() : update.error().message;
    };
    FrameRequest request = requestFor(scene);
    request.sections.resize(kMostSections + 1);
    EXPECT_NE(messageOf(request), "");
    request.sections = {{{0, 0, 0}, 1}};
    EXPECT_NE(messageOf(request), "");
    request.sections.clear();
    request.shading.occlusionRays = 65;
    EXPECT_NE(messageOf(request), "");
    request.shading.occlusionRays = 0;
    request.shading.occlusionRadius = -1;
    EXPECT_NE(messageOf(request), "");
}

}  // namespace
}  // namespace vcp
