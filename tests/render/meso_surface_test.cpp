// Mesostructure on surfaces: pictures whose answer is known.
#include <algorithm>
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "tests/support/meso_surfaces.h"
#include "tests/support/renderer_fixture.h"

namespace vcp {
namespace {

using namespace meso;
using vcp::test::heightAsset;
using vcp::test::mesoSurface;
using vcp::test::plateau;

constexpr uint32_t kEdge = 96;

class MesoSurfaces : public vcp::test::RendererFixture {
protected:
    void SetUp() override { start(); }

    /// Orthographic, from above, 3 units across.
    static FrameRequest fromAbove() {
        FrameRequest request;
        request.width = request.height = kEdge;
        request.camera = {.eye = {0, 0, 5},
                          .forward = {0, 0, -1},
                          .up = {0, 1, 0},
                          .projection = Projection::Orthographic,
                          .orthographicHeight = 3};
        return request;
    }
    FrameStats draw(const std::vector<MesoSurface>& surfaces, const FrameRequest& request) {
        EXPECT_TRUE(renderer_->setSurfaces(surfaces).ok());
        return RendererFixture::draw(request);
    }
    /// Distance of a pixel's middle from the picture's, world units.
    static glm::dvec2 placeOf(uint32_t x, uint32_t y) {
        return {(x + 0.5) / kEdge * 3 - 1.5, 1.5 - (y + 0.5) / kEdge * 3};
    }
};

TEST_F(MesoSurfaces, PlateauOnAQuadIsAPlane) {
    const Asset asset = plateau();
    for (const auto method : methodNames()) {
        SCOPED_TRACE(method);
        draw({mesoSurface(asset, std::string(method), "quad", 0.5)}, fromAbove());
        const auto depths = *renderer_->readDepth();
        const auto normals = *renderer_->readNormals();
        // Distance maps alone show whole cells.
        const bool isCells = method == "dm" || method == "ddm" || method == "ddm-compressed";
        // A step for linear search, a hundredth of the slab for relief mapping; what a sampled distance may be too long
        // for sphere tracing. Displacement maps bend between their points, slices are seen where they lie: both are a
        // third of the slab apart.
        const bool isMap = method == "gdm" || method == "gdm-visibility" || method == "vdm";
        const double tolerance = isCells                        ? 0.13
                                 : method == "relief-linear"    ? 0.5 / 32
                                 : method.starts_with("relief") ? 0.006
                                 : method == "sphere"           ? 0.07
                                 : isMap                        ? 0.06
                                 : method == "slices"           ? 0.5 / 3
                                                                : 2e-3;
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
    FrameRequest request = fromAbove();
    request.camera.eye = {5, 0, 0}, request.camera.forward = {-1, 0, 0}, request.camera.up = {0, 0, 1};
    for (const char* method : {"boxes", "cells", "pyramid", "relief-illinois", "sphere"}) {
        SCOPED_TRACE(method);
        draw({mesoSurface(plateau(), method, "quad", 1)}, request);
        const auto depths = *renderer_->readDepth();
        const auto normals = *renderer_->readNormals();
        for (uint32_t y = 0; y < kEdge; ++y)
            for (uint32_t x = 0; x < kEdge; ++x) {
                const glm::dvec2 p = placeOf(x, y);  // y and z of the world
                const size_t i = y * kEdge + x;
                const bool isOver = std::abs(p.x) > 1 || p.y < 0 || p.y > 0.7,
                           isIn = std::abs(p.x) < 0.95 && p.y > 0.02 && p.y < 0.5;
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
        draw({mesoSurface(asset, method, "sphere", height, 3)}, fromAbove());
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

/// On a smooth base one question answers for all of a ray's way, where the base bends away as well.
TEST_F(MesoSurfaces, ViewDependentMapsAreAskedOnceARay) {
    const double height = 0.2, radius = 1 + 0.6 * height;
    draw({mesoSurface(plateau(), "vdm", "sphere", height, 3)}, fromAbove());
    const auto depths = *renderer_->readDepth();
    const auto normals = *renderer_->readNormals();
    const auto questions = *renderer_->readIterations();
    int missed = 0;
    double asked = 0, over = 0;
    for (uint32_t y = 0; y < kEdge; ++y)
        for (uint32_t x = 0; x < kEdge; ++x) {
            const glm::dvec2 p = placeOf(x, y);
            const size_t i = y * kEdge + x;
            const double r = glm::length(p);
            // Where pieces meet, all that are met within rounding are asked.
            EXPECT_LE(questions[i], 6u) << x << ", " << y;
            asked += questions[i];
            over += questions[i] > 0;
            // Towards the silhouette eight points a tile and samples of curvature that are far apart say little.
            if (r > 0.6) continue;
            missed += !std::isfinite(depths[i]);
            if (!std::isfinite(depths[i])) continue;
            const glm::dvec3 hit(p, 5 - double(depths[i]));
            EXPECT_NEAR(glm::length(hit), radius, 0.05) << x << ", " << y;
            EXPECT_GT(glm::dot(glm::dvec3(normals[i]), glm::normalize(hit)), 0.95) << x << ", " << y;
        }
    EXPECT_EQ(missed, 0);
    EXPECT_LT(asked, 1.1 * over);
    // A base with edges is asked in each piece.
    draw({mesoSurface(plateau(), "vdm", "box", height, 3)}, fromAbove());
    const auto ofBox = *renderer_->readIterations();
    EXPECT_GT(*std::ranges::max_element(ofBox), 2u);
}

/// Pieces are flat between their corners, by 6 degrees here; normals are those of the ball that they stand for.
TEST_F(MesoSurfaces, NormalsTurnAsASmoothBaseDoes) {
    draw({mesoSurface(plateau(), "pyramid", "sphere", 0.2, 3)}, fromAbove());
    const auto depths = *renderer_->readDepth();
    const auto normals = *renderer_->readNormals();
    const auto degrees = [](glm::dvec3 a, glm::dvec3 b) {
        return glm::degrees(2 * std::asin(std::min(0.5 * glm::distance(glm::normalize(a), glm::normalize(b)), 1.0)));
    };
    double error = 0, jump = 0;
    int pairs = 0;
    for (uint32_t y = 0; y < kEdge; ++y)
        for (uint32_t x = 0; x + 1 < kEdge; ++x) {
            const size_t i = y * kEdge + x;
            const glm::dvec3 a(placeOf(x, y), 5 - double(depths[i])), b(placeOf(x + 1, y), 5 - double(depths[i + 1]));
            if (std::max(glm::length(glm::dvec2(a)), glm::length(glm::dvec2(b))) > 0.9) continue;
            ++pairs;
            const double turns = degrees(glm::dvec3(normals[i]), glm::dvec3(normals[i + 1]));
            error = std::max(error, degrees(glm::dvec3(normals[i]), a));
            jump = std::max(jump, turns - degrees(a, b));
        }
    EXPECT_GT(pairs, 2000);
    EXPECT_LT(error, 0.7);
    EXPECT_LT(jump, 0.7);
}

TEST_F(MesoSurfaces, SharpEdgesOfABaseStaySharp) {
    FrameRequest request = fromAbove();
    draw({mesoSurface(plateau(), "pyramid", "box", 0.2, 3)}, request);
    const auto depths = *renderer_->readDepth();
    const auto normals = *renderer_->readNormals();
    int top = 0;
    for (uint32_t y = 0; y < kEdge; ++y)
        for (uint32_t x = 0; x < kEdge; ++x) {
            const glm::dvec2 p = placeOf(x, y);
            if (std::max(std::abs(p.x), std::abs(p.y)) > 0.95) continue;
            ASSERT_TRUE(std::isfinite(depths[y * kEdge + x])) << x << ", " << y;
            EXPECT_GT(normals[y * kEdge + x].z, 0.999f) << x << ", " << y;
            ++top;
        }
    EXPECT_GT(top, 2000);
}

/// Many triangles in one place: what a ray may look at is bounded, and it is said that it was not all.
TEST_F(MesoSurfaces, RaysThroughCoincidentPiecesAreBounded) {
    const Asset asset = plateau();
    MesoSurface surface = mesoSurface(asset, "boxes", "quad", 0.5);
    FrameRequest request = fromAbove();
    request.shading.shadows = true;
    EXPECT_EQ(draw({surface}, request).unresolvedRays, 0u);
    BaseSurface base = *makeBaseSurface("quad", 2);
    for (int copy = 0; copy < 40'000; ++copy)
        for (size_t i = 0; i < 2; ++i) {
            const auto triangle = base.triangles[i];
            const auto map = base.uvs[i];
            base.triangles.push_back(triangle), base.uvs.push_back(map);
        }
    surface.shell = *buildShell(base, 0.5, asset.extent);
    request.width = request.height = 8;
    EXPECT_GT(draw({surface}, request).unresolvedRays, 0u);
    // No ray marched more than the cap, and one more piece.
    const auto iterations = *renderer_->readIterations();
    EXPECT_LE(*std::ranges::max_element(iterations), 65536u + 8193u);
    const auto depths = *renderer_->readDepth();
    EXPECT_NEAR(depths[3 * 8 + 3], 5 - 0.5 * 0.6, 2e-3);
}

TEST_F(MesoSurfaces, WaysToSkipShowTheSame) {
    FrameRequest request = fromAbove();
    request.camera.forward = {0.5, 0.3, -0.4}, request.camera.eye = -5.0 * request.camera.forward;
    uint64_t many = 0, few = 0;
    // Many small pieces, and a few large ones with little in them.
    for (const auto& [name, base] : {std::pair("beads", "torus"), std::pair("ball", "quad")}) {
        SCOPED_TRACE(name);
        Asset asset;
        asset.name = asset.solid = name;
        asset.extent = meso::test::solid(name)->extent();
        const auto depthsAndWork = [&, base = base](const char* method, uint64_t& work) {
            draw({mesoSurface(asset, method, base, 0.2)}, request);
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

/// A cube from 4 to 12 from above, with a plateau on top of it, one within it and one beside it.
struct OverACube {
    vcp::test::Scene scene = vcp::test::cubeScene(0);
    FrameRequest request;
    OverACube() {
        request.width = request.height = kEdge;
        request.camera = {.eye = {8, 8, 20},
                          .forward = {0, 0, -1},
                          .up = {0, 1, 0},
                          .projection = Projection::Orthographic,
                          .orthographicHeight = 16};
    }
    static size_t pixelOf(double x, double y) { return size_t((16 - y) / 16 * kEdge) * kEdge + size_t(x / 16 * kEdge); }
};

TEST_F(MesoSurfaces, NearerOfDatasetAndSurfaceIsSeen) {
    const OverACube over;
    show(over.scene);
    const FrameStats alone = RendererFixture::draw(over.request);
    const auto cube = *renderer_->readPicture();
    const FrameStats stats = draw({mesoSurface(plateau(), "boxes", "quad", 1, 2, {6, 8, 11.9}),
                                   mesoSurface(plateau(), "boxes", "quad", 1, 2, {10, 8, 10}),
                                   mesoSurface(plateau(), "boxes", "quad", 1, 2, {14, 8, 10})},
                                  over.request);
    const auto picture = *renderer_->readPicture();
    const auto depths = *renderer_->readDepth();
    const auto normals = *renderer_->readNormals();
    const size_t on = OverACube::pixelOf(6, 8), within = OverACube::pixelOf(10, 8), beside = OverACube::pixelOf(14, 8),
                 nothing = OverACube::pixelOf(1, 1);
    EXPECT_NEAR(depths[on], 20 - 12.5, 1e-3);
    EXPECT_NEAR(depths[within], 8, 1e-3);
    EXPECT_NEAR(depths[beside], 20 - 10.6, 1e-3);
    EXPECT_TRUE(std::isinf(depths[nothing]));
    for (const size_t i : {on, within, beside}) EXPECT_GT(normals[i].z, 0.99f) << i;
    EXPECT_TRUE(std::equal(&picture.rgba[4 * within], &picture.rgba[4 * within + 4], &cube.rgba[4 * within]));
    EXPECT_FALSE(std::equal(&picture.rgba[4 * beside], &picture.rgba[4 * beside + 4], &cube.rgba[4 * beside]));
    const auto pickAt = [&](size_t i) { return **renderer_->pick(uint32_t(i % kEdge), uint32_t(i / kEdge)); };
    EXPECT_TRUE(pickAt(on).onSurface);
    EXPECT_NEAR(pickAt(on).position.z, 12.5, 1e-3);
    EXPECT_FALSE(pickAt(within).onSurface);
    const auto finite = uint64_t(std::count_if(depths.begin(), depths.end(), [](float d) { return std::isfinite(d); }));
    EXPECT_EQ(stats.hitPixels, finite);
    EXPECT_GT(finite, alone.hitPixels);
}

TEST_F(MesoSurfaces, TilesAreCutFromTheWhole) {
    const OverACube over;
    show(over.scene);
    const std::vector<MesoSurface> surfaces = {mesoSurface(plateau(), "boxes", "sphere", 0.2, 3, {11, 8, 12})};
    FrameRequest request = over.request;
    for (const Projection projection : {Projection::Orthographic, Projection::Perspective}) {
        request.camera.projection = projection;
        request.tile.reset();
        request.width = request.height = kEdge;
        draw(surfaces, request);
        const auto whole = *renderer_->readPicture();
        request.width = 40, request.height = 24;
        request.tile = PictureTile{48, 32, kEdge, kEdge};
        draw(surfaces, request);
        const auto tile = *renderer_->readPicture();
        int different = 0;
        for (uint32_t y = 0; y < 24; ++y)
            for (uint32_t i = 0; i < 160; ++i)
                different +=
                    std::abs(int(tile.rgba[y * 160 + i]) - int(whole.rgba[4 * ((y + 32) * kEdge + 48) + i])) > 2;
        // The ray of a tile may be rounded in another way, and pass an edge on its other side.
        EXPECT_LE(different, renderer_->device().software ? 0 : 12);
    }
}

TEST_F(MesoSurfaces, AllViewsShowThemAndHearOfThem) {
    const OverACube over;
    show(over.scene);
    auto view = *renderer_->addView();
    ASSERT_TRUE(view->settle(over.request));
    ASSERT_TRUE(view->render(over.request));
    const auto before = *view->readPicture();
    EXPECT_FALSE(view->update(over.request)->changed);
    draw({mesoSurface(plateau(), "boxes", "quad", 1, 2, {14, 8, 10})}, over.request);
    EXPECT_TRUE(view->update(over.request)->changed);
    EXPECT_FALSE(view->update(over.request)->changed);
    ASSERT_TRUE(view->render(over.request));
    EXPECT_EQ(*view->readPicture(), *renderer_->readPicture());
    EXPECT_NE(*view->readPicture(), before);
    // Taken away again, nothing is left of them.
    EXPECT_EQ(draw({}, over.request).surfaceBytes, 0u);
    EXPECT_EQ(*renderer_->readPicture(), before);
    ASSERT_TRUE(view->update(over.request));
    ASSERT_TRUE(view->render(over.request));
    EXPECT_EQ(*view->readPicture(), before);
}

TEST_F(MesoSurfaces, SurviveALostDevice) {
    const OverACube over;
    const std::vector<MesoSurface> surfaces = {mesoSurface(plateau(), "boxes", "quad", 1, 2, {14, 8, 10})};
    show(over.scene);
    draw(surfaces, over.request);
    const auto expected = *renderer_->readPicture();
    for (const uint64_t submission : {4, 6, 8}) {
        RendererOptions options;
        options.faults.lostAtSubmission = submission;
        start(options);
        show(over.scene);
        ASSERT_TRUE(renderer_->setSurfaces(surfaces).ok());
        for (int i = 0; i < 10; ++i) RendererFixture::draw(over.request);  // a submission each
        EXPECT_EQ(renderer_->update(over.request)->deviceLosses, 1u) << submission;
        RendererFixture::draw(over.request);
        EXPECT_EQ(*renderer_->readPicture(), expected) << submission;
    }
}

TEST_F(MesoSurfaces, ShadowsFallBehindWhatStands) {
    FrameRequest request = fromAbove();
    request.shading.lightFollowsCamera = false;
    request.shading.lightDirection = {0.8f, 0.2f, 0.35f};
    const auto brightness = [&](const Asset& asset, bool shadows) {
        request.shading.shadows = shadows;
        draw({mesoSurface(asset, "boxes", "quad", 0.3)}, request);
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

// A plane through the slab leaves a half of it, and shows what is solid there.
TEST_F(MesoSurfaces, SectionPlanesCutThem) {
    for (const char* method : {"boxes", "cells", "pyramid", "relief-illinois"}) {
        SCOPED_TRACE(method);
        FrameRequest request = fromAbove();
        const std::vector<MesoSurface> slab{mesoSurface(plateau(), method, "quad", 0.5)};
        draw(slab, request);
        const auto whole = *renderer_->readDepth();
        request.sections = {{{2, 0, 0}, 0.4}};
        draw(slab, request);
        const auto right = *renderer_->readDepth();
        for (uint32_t y = 0; y < kEdge; ++y)
            for (uint32_t x = 0; x < kEdge; ++x) {
                const size_t i = y * kEdge + x;
                const double at = placeOf(x, y).x;
                if (std::abs(at - 0.2) < 0.05) continue;
                ASSERT_EQ(right[i], at > 0.2 ? whole[i] : std::numeric_limits<float>::infinity()) << x << ", " << y;
            }
        // From above, a plane below the top: its cut is flat, and turned to the eye. Only the methods of cells know
        // what is solid.
        if (std::string_view(method) != "boxes" && std::string_view(method) != "cells") continue;
        request.sections = {{{0, 0, -1}, -0.2}};
        draw(slab, request);
        const auto cut = *renderer_->readDepth();
        const auto normals = *renderer_->readNormals();
        uint64_t hits = 0;
        for (size_t i = 0; i < cut.size(); ++i) {
            if (!std::isfinite(cut[i])) continue;
            ++hits;
            ASSERT_NEAR(cut[i], 5 - 0.2, 2e-3);
            ASSERT_GT(normals[i].z, 0.99f);
        }
        EXPECT_GT(hits, uint64_t{kEdge} * kEdge / 3);
        // What is cut away casts no shadow.
        request.sections = {{{1, 0, 0}, 50}};
        EXPECT_EQ(draw(slab, request).hitPixels, 0u);
    }
}

TEST_F(MesoSurfaces, TheirBytesAreTakenFromTheBudget) {
    const OverACube over;
    const Asset asset = plateau();
    const std::vector<MesoSurface> surfaces{mesoSurface(asset, "boxes", "quad", 0.5)};
    const uint64_t bytes = draw(surfaces, fromAbove()).surfaceBytes;
    ASSERT_GT(bytes, 0u);
    renderer_->close();
    ASSERT_TRUE(renderer_->setBudgets((1 << 20) + bytes - 1, 16 << 20).error().code == ErrorCode::Limit);
    RendererOptions options;
    options.budgetBytes = (1 << 20) + bytes - 1;
    start(options);
    const PlacedDataset cube{over.scene.dataset, over.scene.source, {}};
    EXPECT_EQ(renderer_->open({cube}, surfaces).error().code, ErrorCode::Limit);
    EXPECT_TRUE(renderer_->open({cube}, {}));
    options.budgetBytes = (1 << 20) + bytes;
    start(options);
    ASSERT_TRUE(renderer_->open({cube}, surfaces));
    const FrameStats stats = RendererFixture::draw(over.request);
    EXPECT_LE(stats.poolBytes + stats.surfaceBytes, options.budgetBytes);
}

TEST_F(MesoSurfaces, SceneWithoutMesostructurePaysNothing) {
    const OverACube over;
    show(over.scene);
    const FrameStats never = RendererFixture::draw(over.request);
    const FrameStats none = draw({}, over.request);
    EXPECT_EQ(none.pipelines, never.pipelines);
    EXPECT_EQ(none.surfaceBytes, 0u);
    EXPECT_EQ(none.msSurfaces, 0);
}

TEST_F(MesoSurfaces, OnePipelineAMethod) {
    const Asset asset = plateau();
    const MesoSurface boxes = mesoSurface(asset, "boxes", "quad", 0.5),
                      pyramid = mesoSurface(asset, "pyramid", "quad", 0.5);
    const uint32_t one = draw({boxes}, fromAbove()).pipelines;
    EXPECT_EQ(draw({boxes, boxes}, fromAbove()).pipelines, one);
    EXPECT_EQ(draw({boxes, pyramid}, fromAbove()).pipelines, one + 1);
    EXPECT_EQ(draw({pyramid}, fromAbove()).pipelines, one + 1);
}

/// The picture's light at a pixel, from 0 to 1, as shade and texture encode it.
double lightAt(const Picture& picture, size_t pixel, int channel = 1) {
    return std::pow(picture.rgba[4 * pixel + size_t(channel)] / 255.0, 2.2);
}

TEST_F(MesoSurfaces, TexturesLieOverTheTile) {
    // Columns are red, rows green: texel (i, j) of the tile's lower row first.
    std::vector<glm::vec4> texels;
    for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i) texels.emplace_back(float(i) / 3, float(j) / 3, 0.5f, 1);
    MesoSurface surface = mesoSurface(plateau(), "boxes", "quad", 0.5);
    surface.colour = glm::vec3(1);
    draw({surface}, fromAbove());
    const Picture white = *renderer_->readPicture();
    surface.colours = std::make_shared<const MesoTexture>(makeMesoTexture({4, 4}, texels));
    EXPECT_EQ(surface.colours->levels, 3u);
    EXPECT_EQ(surface.colours->texels.size(), 16u + 4 + 1);
    // 128 pixels over two tiles: a texel is 16 pixels wide.
    FrameRequest request = fromAbove();
    request.camera.orthographicHeight = 1.5;
    const double half = 0.5 * 1.5 / kEdge;
    request.camera.eye = {-half, half, 5};
    draw({surface}, request);
    const Picture textured = *renderer_->readPicture();
    const double lit = white.rgba[4 * (kEdge / 2 * kEdge + kEdge / 2)];
    const auto encoded = [](double light) {
        return light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
    };
    for (int j = -2; j < 2; ++j)
        for (int i = -2; i < 2; ++i) {
            // World (i, j) / 4 is texel (i, j) modulo 4, and the middle of a pixel.
            const auto x = uint32_t(kEdge / 2 + 16 * i), y = uint32_t(int(kEdge / 2) - 16 * j);
            const size_t pixel = size_t{y} * kEdge + x;
            const double red = (i + 4) % 4 / 3.0, green = (j + 4) % 4 / 3.0;
            EXPECT_NEAR(textured.rgba[4 * pixel], lit * encoded(red), 3) << i << ", " << j;
            EXPECT_NEAR(textured.rgba[4 * pixel + 1], lit * encoded(green), 3) << i << ", " << j;
            EXPECT_NEAR(textured.rgba[4 * pixel + 2], lit * encoded(0.5), 2);
        }
}

TEST_F(MesoSurfaces, TexturesAreAveragedAsLight) {
    std::vector<glm::vec4> texels;
    for (int i = 0; i < 64 * 64; ++i) texels.emplace_back(float((i + i / 64) % 2));
    MesoSurface surface = mesoSurface(plateau(), "boxes", "quad", 0.05, 32);
    surface.colour = glm::vec3(1);
    draw({surface}, fromAbove());
    const Picture white = *renderer_->readPicture();
    surface.colours = std::make_shared<const MesoTexture>(makeMesoTexture({64, 64}, texels));
    draw({surface}, fromAbove());
    const Picture textured = *renderer_->readPicture();
    const auto depths = *renderer_->readDepth();
    size_t seen = 0;
    for (size_t i = 0; i < depths.size(); ++i) {
        if (!std::isfinite(depths[i])) continue;
        ++seen;
        // Half the light is 188 of 255; half of what is stored would be 128.
        EXPECT_NEAR(textured.rgba[4 * i], white.rgba[4 * i] * 188 / 255.0, 2) << i;
    }
    EXPECT_GT(seen, kEdge * kEdge / 3);
}

TEST_F(MesoSurfaces, NormalTexturesBendWhatIsThere) {
    const float bend = 0.4f;
    const auto texture = [](glm::vec3 n) {
        return std::make_shared<const MesoTexture>(makeMesoTexture({2, 2}, std::vector<glm::vec4>(4, glm::vec4(n, 0))));
    };
    const auto normalsOf = [&](std::string_view base, const std::shared_ptr<const MesoTexture>& normals) {
        MesoSurface surface = mesoSurface(plateau(), "pyramid", base, 0.1, 3);
        surface.normals = normals;
        draw({surface}, fromAbove());
        return *renderer_->readNormals();
    };
    const auto alongX = normalsOf("quad", texture({std::sin(bend), 0, std::cos(bend)})),
               alongY = normalsOf("quad", texture({0, std::sin(bend), std::cos(bend)}));
    for (const auto& n : alongX)
        if (n != glm::vec3(0)) {
            ASSERT_LT(glm::length(n - glm::vec3(std::sin(bend), 0, std::cos(bend))), 0.01f);
        }
    for (const auto& n : alongY)
        if (n != glm::vec3(0)) {
            ASSERT_LT(glm::length(n - glm::vec3(0, std::sin(bend), std::cos(bend))), 0.01f);
        }
    const auto plain = normalsOf("sphere", nullptr), flat = normalsOf("sphere", texture({0, 0, 1})),
               bent = normalsOf("sphere", texture({std::sin(bend), 0, std::cos(bend)}));
    size_t seen = 0;
    for (size_t i = 0; i < plain.size(); ++i) {
        if (plain[i].z < 0.7f) continue;
        ++seen;
        ASSERT_GT(glm::dot(plain[i], flat[i]), 0.9999f);
        ASSERT_NEAR(glm::dot(plain[i], bent[i]), std::cos(bend), 0.03f);
    }
    EXPECT_GT(seen, kEdge * kEdge / 8);
}

/// About z, by an angle whose sine and cosine are no short numbers.
glm::dvec3 turned(glm::dvec3 p) { return {0.8253356 * p.x - 0.5646425 * p.y, 0.5646425 * p.x + 0.8253356 * p.y, p.z}; }

/// A strip along turned x, 2 units long, of 2048 by 8 squares, all of them small and most far from its middle.
BaseSurface denseStrip() {
    constexpr uint32_t kColumns = 2048, kRows = 8;
    BaseSurface strip;
    for (uint32_t j = 0; j <= kRows; ++j)
        for (uint32_t i = 0; i <= kColumns; ++i)
            strip.positions.push_back(
                turned({(double(i) - kColumns / 2.0) / 1024, (double(j) - kRows / 2.0) / 1024, 0}));
    const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
        strip.triangles.push_back({a, b, c});
        const auto map = [&](uint32_t k) { return glm::dvec2(k % (kColumns + 1), k / (kColumns + 1)) / 16.0; };
        strip.uvs.push_back({map(a), map(b), map(c)});
    };
    for (uint32_t j = 0; j < kRows; ++j)
        for (uint32_t i = 0; i < kColumns; ++i) {
            const uint32_t at = j * (kColumns + 1) + i;
            add(at, at + 1, at + kColumns + 2), add(at, at + kColumns + 2, at + kColumns + 1);
        }
    return strip;
}

TEST_F(MesoSurfaces, DenseBasesHaveNoGapsAlongTheirWalls) {
    MesoSurface surface = mesoSurface(plateau(), "boxes", "quad", 0.5);
    surface.shell = *buildShell(denseStrip(), 0.0007, plateau().extent);
    surface.withBase = false;
    FrameRequest request = fromAbove();
    // Pixels are two squares wide, and their rays run in the walls between squares, slantwise.
    request.width = 1000, request.height = 3;
    request.camera.orthographicHeight = 6.0 / 1024;
    for (const double slant : {0.0, 0.3, 0.7, -1.1}) {
        SCOPED_TRACE(slant);
        const glm::dvec3 forward = turned(glm::normalize(glm::dvec3(0, slant, -1)));
        request.camera.forward = forward, request.camera.eye = -2.0 * forward, request.camera.up = turned({0, 1, 0});
        draw({surface}, request);
        size_t missed = 0;
        const auto depths = *renderer_->readDepth();
        for (const float depth : depths) missed += !std::isfinite(depth);
        EXPECT_EQ(missed, 0u);
    }
}

/// Squares of 8 x 8 pixels become one: means of light, of one channel.
std::vector<double> smaller(const Picture& picture) {
    std::vector<double> means(size_t{kEdge} * kEdge);
    for (uint32_t y = 0; y < 8 * kEdge; ++y)
        for (uint32_t x = 0; x < 8 * kEdge; ++x)
            means[y / 8 * kEdge + x / 8] += lightAt(picture, size_t{y} * 8 * kEdge + x) / 64;
    return means;
}

TEST_F(MesoSurfaces, FromFarTheMeanLightIsSeenWithoutMarching) {
    for (const char* name : {"hemispheres", "fbm", "beads"})
        for (const double elevation : {80.0, 20.0})
            for (const bool shadows : {false, true}) {
                SCOPED_TRACE(testing::Message() << name << ", " << elevation << (shadows ? ", shadows" : ""));
                Asset asset;
                asset.name = name;
                if (std::string_view(name) == "beads")
                    asset.solid = name, asset.extent = meso::test::solid(name)->extent();
                else
                    asset = heightAsset(name, *makeHeightField(name, 64, 1));
                // A tile is narrower than a pixel by no simple part, and the slab less high than half of one.
                const double edge = 0.83 * 3.0 / kEdge, tall = std::min(1.0, 0.4 / asset.extent.z);
                MesoSurface surface = mesoSurface(asset, "boxes", "quad", tall * edge * asset.extent.z, 2 / edge);
                const auto shape = shapeOf(asset);
                surface.far = std::make_shared<const Appearance>(appearanceOf(**shape, tall));
                FrameRequest request = fromAbove();
                const double rise = elevation * M_PI / 180;
                request.camera.forward = {0, std::cos(rise), -std::sin(rise)},
                request.camera.eye = -5.0 * request.camera.forward;
                request.shading.lightFollowsCamera = false, request.shading.lightDirection = {0.5f, -0.4f, 0.6f},
                request.shading.shadows = shadows;
                request.errorPixels = 0;
                request.width = request.height = 8 * kEdge;
                EXPECT_EQ(draw({surface}, request).farHits, 0u);
                const std::vector<double> truth = smaller(*renderer_->readPicture());
                request.width = request.height = kEdge;
                draw({surface}, request);
                const Picture marched = *renderer_->readPicture();
                request.errorPixels = 0.5;
                const FrameStats stats = draw({surface}, request);
                const Picture far = *renderer_->readPicture();
                const auto depths = *renderer_->readDepth();
                const auto iterations = *renderer_->readIterations();
                double ofMarched = 0, ofFar = 0;
                size_t seen = 0;
                for (uint32_t y = 1; y + 1 < kEdge; ++y)
                    for (uint32_t x = 1; x + 1 < kEdge; ++x) {
                        // Borders show cuts, and are a matter of where pixels lie.
                        const size_t i = size_t{y} * kEdge + x;
                        bool isInside = true;
                        for (const int step : {-1, 1})
                            isInside = isInside && std::isfinite(depths[i + size_t(step)]) &&
                                       std::isfinite(depths[i + size_t(step * int(kEdge))]);
                        if (!isInside) continue;
                        ++seen;
                        ofMarched += std::abs(lightAt(marched, i) - truth[i]),
                            ofFar += std::abs(lightAt(far, i) - truth[i]);
                    }
                EXPECT_GT(seen, 800u);
                EXPECT_GE(stats.farHits, seen);
                EXPECT_EQ(std::accumulate(iterations.begin(), iterations.end(), uint64_t{0}), 0u);
                EXPECT_LT(ofFar, 0.5 * ofMarched);
            }
}

TEST_F(MesoSurfaces, NearbyAllIsMarched) {
    MesoSurface surface = mesoSurface(heightAsset("fbm", *makeHeightField("fbm", 64, 1)), "boxes", "torus", 0.1);
    FrameRequest request = fromAbove();
    request.shading.shadows = true;
    draw({surface}, request);
    const Picture before = *renderer_->readPicture();
    const auto depths = *renderer_->readDepth();
    surface.far = std::make_shared<const Appearance>(appearanceOf(*meso::test::heights(*plateau().heights), 1, 16));
    EXPECT_EQ(draw({surface}, request).farHits, 0u);
    EXPECT_EQ(*renderer_->readPicture(), before);
    EXPECT_EQ(*renderer_->readDepth(), depths);
}

TEST_F(MesoSurfaces, WhatRaysComeThroughIsMarchedFromFar) {
    Asset asset;
    asset.name = asset.solid = "ball";
    asset.extent = meso::test::solid("ball")->extent();
    MesoSurface surface = mesoSurface(asset, "boxes", "quad", 0.01, 64);
    surface.far = std::make_shared<const Appearance>(appearanceOf(*meso::test::solid("ball"), 0.5, 64));
    surface.withBase = false;
    EXPECT_EQ(draw({surface}, fromAbove()).farHits, 0u);
    surface.withBase = true;
    EXPECT_GT(draw({surface}, fromAbove()).farHits, kEdge * kEdge / 3);
}

}  // namespace
}  // namespace vcp
