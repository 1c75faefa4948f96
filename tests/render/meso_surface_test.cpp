// Mesostructure on surfaces: pictures whose answer is known.
#include <algorithm>
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "render/meso_renderer.h"
#include "tests/mesostructure/meso_rays.h"

namespace vcp {
namespace {

using namespace meso;

constexpr uint32_t kEdge = 96;

Asset heightAsset(const std::string& name, HeightMap map) {
    Asset asset;
    asset.name = name;
    asset.extent = map.extent();
    asset.heights = std::move(map);
    return asset;
}

/// Everywhere 3/5 of the slab high.
Asset plateau() { return heightAsset("plateau", {{8, 8}, 0.25, std::vector<uint16_t>(64, 39321)}); }

class MesoSurfaces : public testing::Test {
protected:
    void SetUp() override {
        auto made = MesoRenderer::create({.validation = true});
        ASSERT_TRUE(made) << made.error().line();
        renderer_ = std::move(*made);
    }
    void TearDown() override {
        if (!renderer_) return;
        for (const std::string& message : renderer_->validationMessages()) ADD_FAILURE() << message;
    }

    static MesoSurface surfaceOf(const Asset& asset, const std::string& method, std::string_view base, double height, double tiles = 2) {
        const auto shape = shapeOf(asset);
        const auto made = buildMethod(asset, **shape, {.name = method, .cells = 8});
        EXPECT_TRUE(made) << made.error().line();
        const BaseSurface surface = *makeBaseSurface(base, tiles);
        MesoSurface placed;
        placed.arrays = std::make_shared<const MesoArrays>(*packMesoArrays(*made));
        placed.shell = *buildShell(surface, height, asset.extent);
        placed.lift = shadowLift(*placed.arrays, tileEdge(surface));
        return placed;
    }
    /// Orthographic, from above, 3 units across.
    static MesoRequest fromAbove() {
        MesoRequest request;
        request.width = request.height = kEdge;
        request.look.camera = {.eye = {0, 0, 5}, .forward = {0, 0, -1}, .up = {0, 1, 0}, .projection = Projection::Orthographic, .orthographicHeight = 3};
        return request;
    }
    MesoFrameStats draw(const std::vector<MesoSurface>& surfaces, const MesoRequest& request) {
        EXPECT_TRUE(renderer_->setSurfaces(surfaces).ok());
        const auto stats = renderer_->render(request);
        EXPECT_TRUE(stats) << stats.error().line();
        return *stats;
    }
    /// Distance of a pixel's middle from the picture's, world units.
    static glm::dvec2 placeOf(uint32_t x, uint32_t y) { return {(x + 0.5) / kEdge * 3 - 1.5, 1.5 - (y + 0.5) / kEdge * 3}; }

    std::unique_ptr<MesoRenderer> renderer_;
};

TEST_F(MesoSurfaces, PlateauOnAQuadIsAPlane) {
    const Asset asset = plateau();
    for (const auto method : methodNames()) {
        SCOPED_TRACE(method);
        draw({surfaceOf(asset, std::string(method), "quad", 0.5)}, fromAbove());
        const auto depths = *renderer_->readDepth();
        const auto normals = *renderer_->readNormals();
        // Distance maps alone show whole cells.
        const bool isCells = method == "dm" || method == "ddm";
        // A hundredth of the slab for relief mapping; what a sampled distance may be too long for sphere tracing.
        const double tolerance = isCells ? 0.13 : method.starts_with("relief") ? 0.006 : method == "sphere" ? 0.07 : 2e-3;
        for (uint32_t y = 0; y < kEdge; ++y)
            for (uint32_t x = 0; x < kEdge; ++x) {
                const glm::dvec2 p = placeOf(x, y);
                const float depth = depths[y * kEdge + x];
                ASSERT_EQ(std::isfinite(depth), std::abs(p.x) < 1 && std::abs(p.y) < 1) << x << ", " << y;
                if (!std::isfinite(depth)) continue;
                ASSERT_NEAR(depth, 5 - 0.5 * 0.6, tolerance) << x << ", " << y;
                ASSERT_GT(normals[y * kEdge + x].z, 0.99f) << x << ", " << y;
            }
    }
}

TEST_F(MesoSurfaces, BordersShowTheCut) {
    MesoRequest request = fromAbove();
    request.look.camera.eye = {5, 0, 0}, request.look.camera.forward = {-1, 0, 0}, request.look.camera.up = {0, 0, 1};
    for (const char* method : {"boxes", "cells", "pyramid", "relief-illinois", "sphere"}) {
        SCOPED_TRACE(method);
        draw({surfaceOf(plateau(), method, "quad", 1)}, request);
        const auto depths = *renderer_->readDepth();
        const auto normals = *renderer_->readNormals();
        for (uint32_t y = 0; y < kEdge; ++y)
            for (uint32_t x = 0; x < kEdge; ++x) {
                const glm::dvec2 p = placeOf(x, y);  // y and z of the world
                const size_t i = y * kEdge + x;
                const bool isOver = std::abs(p.x) > 1 || p.y < 0 || p.y > 0.7, isIn = std::abs(p.x) < 0.95 && p.y > 0.02 && p.y < 0.5;
                ASSERT_FALSE(isOver && std::isfinite(depths[i])) << x << ", " << y;
                ASSERT_FALSE(isIn && std::abs(depths[i] - 4) > 1e-3f) << x << ", " << y << ": " << depths[i];
                ASSERT_FALSE(isIn && normals[i].x < 0.99f) << x << ", " << y;
            }
    }
}

TEST_F(MesoSurfaces, PlateauOnASphereIsASphereWithoutHoles) {
    const Asset asset = plateau();
    const double height = 0.2, radius = 1 + 0.6 * height;
    for (const char* method : {"boxes", "pyramid", "ddm-quadric", "relief-illinois"}) {
        SCOPED_TRACE(method);
        draw({surfaceOf(asset, method, "sphere", height, 3)}, fromAbove());
        const auto depths = *renderer_->readDepth();
        const auto normals = *renderer_->readNormals();
        for (uint32_t y = 0; y < kEdge; ++y)
            for (uint32_t x = 0; x < kEdge; ++x) {
                const glm::dvec2 p = placeOf(x, y);
                const float depth = depths[y * kEdge + x];
                const double r = glm::length(p);
                // The sphere is of flat pieces: up to 0.003 within.
                EXPECT_FALSE(r > radius + 0.002 && std::isfinite(depth)) << x << ", " << y;
                if (r > radius - 0.01) continue;
                ASSERT_TRUE(std::isfinite(depth)) << x << ", " << y;
                const glm::dvec3 hit(p, 5 - double(depth));
                EXPECT_NEAR(glm::length(hit), radius, 0.006) << x << ", " << y;
                EXPECT_GT(glm::dot(glm::dvec3(normals[y * kEdge + x]), glm::normalize(hit)), 0.97) << x << ", " << y;
            }
    }
}

/// Many triangles in one place: what a ray may look at is bounded, and it is said that it was not all.
TEST_F(MesoSurfaces, RaysThroughCoincidentPiecesAreBounded) {
    const Asset asset = plateau();
    MesoSurface surface = surfaceOf(asset, "boxes", "quad", 0.5);
    MesoRequest request = fromAbove();
    request.look.shadows = true;
    EXPECT_EQ(draw({surface}, request).unresolved, 0u);
    BaseSurface base = *makeBaseSurface("quad", 2);
    for (int copy = 0; copy < 40'000; ++copy)
        for (size_t i = 0; i < 2; ++i) {
            const auto triangle = base.triangles[i];
            const auto map = base.uvs[i];
            base.triangles.push_back(triangle), base.uvs.push_back(map);
        }
    surface.shell = *buildShell(base, 0.5, asset.extent);
    request.width = request.height = 8;
    EXPECT_GT(draw({surface}, request).unresolved, 0u);
    // No ray marched more than the cap, and one more piece.
    const auto iterations = *renderer_->readIterations();
    EXPECT_LE(*std::ranges::max_element(iterations), 65536u + 8193u);
    const auto depths = *renderer_->readDepth();
    EXPECT_NEAR(depths[3 * 8 + 3], 5 - 0.5 * 0.6, 2e-3);
}

TEST_F(MesoSurfaces, WaysToSkipShowTheSame) {
    MesoRequest request = fromAbove();
    request.look.camera.forward = {0.5, 0.3, -0.4}, request.look.camera.eye = -5.0 * request.look.camera.forward;
    uint64_t many = 0, few = 0;
    // Many small pieces, and a few large ones with little in them.
    for (const auto& [name, base] : {std::pair("beads", "torus"), std::pair("ball", "quad")}) {
        SCOPED_TRACE(name);
        Asset asset;
        asset.name = asset.solid = name;
        asset.extent = test::solid(name)->extent();
        const auto depthsAndWork = [&](const char* method, uint64_t& work) {
            draw({surfaceOf(asset, method, base, 0.2)}, request);
            const auto iterations = *renderer_->readIterations();
            work = std::accumulate(iterations.begin(), iterations.end(), work);
            return *renderer_->readDepth();
        };
        const auto all = depthsAndWork("cells", many), skipped = depthsAndWork("boxes", few);
        uint64_t hits = 0, different = 0;
        for (size_t i = 0; i < all.size(); ++i) {
            hits += std::isfinite(all[i]);
            different += std::isfinite(all[i]) != std::isfinite(skipped[i]) || std::abs(all[i] - skipped[i]) > 1e-3f;
        }
        EXPECT_GT(hits, all.size() / 8);
        EXPECT_EQ(different, 0u);
    }
    EXPECT_LT(few, many);
}

TEST_F(MesoSurfaces, ComposesByDepth) {
    const std::vector<MesoSurface> surfaces = {surfaceOf(plateau(), "boxes", "quad", 0.5)};
    MesoBehind behind{{kEdge, kEdge, std::vector<uint8_t>(4 * kEdge * kEdge, 7)}, std::vector<float>(kEdge * kEdge, 4.0f)};
    for (uint32_t i = 0; i < kEdge * kEdge / 2; ++i) behind.depths[i] = 4.9f;
    MesoRequest request = fromAbove();
    request.behind = &behind;
    draw(surfaces, request);
    const auto picture = *renderer_->readPicture();
    const auto depths = *renderer_->readDepth();
    const auto isBehind = [&](uint32_t x, uint32_t y) { return picture.rgba[4 * (y * kEdge + x)] == 7; };
    EXPECT_FALSE(isBehind(kEdge / 2, kEdge / 4));
    EXPECT_NEAR(depths[kEdge / 4 * kEdge + kEdge / 2], 4.7f, 1e-3f);
    EXPECT_TRUE(isBehind(kEdge / 2, 3 * kEdge / 4));
    EXPECT_EQ(depths[3 * kEdge / 4 * kEdge + kEdge / 2], 4.0f);
    EXPECT_TRUE(isBehind(0, 0));
}

TEST_F(MesoSurfaces, ShadowsFallBehindWhatStands) {
    MesoRequest request = fromAbove();
    request.look.light = {0.8, 0.2, 0.35};
    const auto brightness = [&](const Asset& asset, bool shadows) {
        request.look.shadows = shadows;
        draw({surfaceOf(asset, "boxes", "quad", 0.3)}, request);
        uint64_t sum = 0;
        const Picture picture = *renderer_->readPicture();
        for (const uint8_t byte : picture.rgba) sum += byte;
        return sum;
    };
    const Asset maze = heightAsset("maze", *makeHeightField("maze", 64, 1));
    EXPECT_LT(brightness(maze, true), brightness(maze, false));
    // Nothing stands on a plateau, and a surface does not shadow itself.
    EXPECT_EQ(brightness(plateau(), true), brightness(plateau(), false));
}

TEST_F(MesoSurfaces, SceneWithoutMesostructureMakesNothing) {
    MesoBehind behind{{kEdge, kEdge, std::vector<uint8_t>(4 * kEdge * kEdge, 9)}, std::vector<float>(kEdge * kEdge, 2.0f)};
    MesoRequest request = fromAbove();
    request.behind = &behind;
    const MesoFrameStats stats = draw({}, request);
    EXPECT_EQ(stats.pipelines, 0u);
    EXPECT_EQ(stats.assetBytes, 0u);
    EXPECT_EQ(*renderer_->readPicture(), behind.picture);
    EXPECT_EQ(*renderer_->readDepth(), behind.depths);
}

TEST_F(MesoSurfaces, OnePipelineAMethod) {
    const Asset asset = plateau();
    const MesoSurface boxes = surfaceOf(asset, "boxes", "quad", 0.5), pyramid = surfaceOf(asset, "pyramid", "quad", 0.5);
    // With the one that shades.
    EXPECT_EQ(draw({boxes, boxes}, fromAbove()).pipelines, 2u);
    EXPECT_EQ(draw({boxes, pyramid}, fromAbove()).pipelines, 3u);
    EXPECT_EQ(draw({pyramid}, fromAbove()).pipelines, 3u);
}

TEST_F(MesoSurfaces, RefusesPicturesOfNoSize) {
    MesoRequest request = fromAbove();
    request.width = 0;
    EXPECT_EQ(renderer_->render(request).error().code, ErrorCode::Usage);
    request = fromAbove();
    const MesoBehind behind{{4, 4, std::vector<uint8_t>(64)}, std::vector<float>(16)};
    request.behind = &behind;
    EXPECT_EQ(renderer_->render(request).error().code, ErrorCode::Usage);
    EXPECT_EQ(renderer_->readPicture().error().code, ErrorCode::Usage);
}

}  // namespace
}  // namespace vcp
