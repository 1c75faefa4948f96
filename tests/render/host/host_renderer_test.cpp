// Pictures by the host against pictures by the shaders, pixel by pixel.
#include <array>
#include <atomic>
#include <fstream>

#include "render/false_colours.h"
#include "tests/support/host_comparison.h"

namespace vcp {
namespace {

using test::CastByRendererTest;
using test::channelsApart;
using test::Difference;
using test::drawnBy;
using test::expectFew;
using test::kHigh;
using test::kLow;
using test::NamedCamera;
using test::Planes;
using test::requestOf;
using test::Scene;
using test::torusAndBox;

class HostRendererTest : public test::HostRendererTest {
protected:
    /// Compares pictures of two bodies from everywhere. `light`: sets how they are lit.
    template <class Light>
    Difference differenceOfAll(Light light, uint32_t samples = 1) {
        const test::BuiltMesh built = torusAndBox();
        EXPECT_TRUE(built.ok());
        open(built);
        Difference all;
        for (const NamedCamera& named : test::cameras(kLow, kHigh)) {
            SCOPED_TRACE(named.name);
            FrameRequest request = requestOf(named.camera);
            light(request.shading);
            all += difference(request, built.cache().dataset().header.cell, samples);
        }
        return all;
    }
};

/// Expects the colours of the numbers where rays visited something.
void expectColoursOf(const Picture& picture, const std::vector<uint32_t>& work, double end) {
    for (size_t i = 0; i < work.size(); ++i) {
        if (work[i] == 0) continue;
        const glm::vec3 colour = 255.0f * falseColour(work[i] / end);
        for (int c = 0; c < 3; ++c) ASSERT_NEAR(double(picture.rgba[4 * i + size_t(c)]), double(colour[c]), 0.51) << i;
    }
}

constexpr ShadingMode kModes[] = {ShadingMode::Lit,     ShadingMode::Clay,  ShadingMode::Unlit,
                                  ShadingMode::Normals, ShadingMode::Level, ShadingMode::Error};

TEST_F(CastByRendererTest, PicturesAreTheHosts) {
    const test::BuiltMesh built = torusAndBox();
    ASSERT_TRUE(built.ok());
    const Similarity beside{glm::angleAxis(0.7, glm::normalize(glm::dvec3(1, 2, -0.5))), 0.6, {0.5, 0.2, 0.7}};
    openAll({placed(built.file()), placed(built.file(), beside)});
    for (const NamedCamera& named : test::cameras(kLow, kHigh)) {
        FrameRequest request = requestOf(named.camera);
        request.shading.shadows = true;
        request.shading.occlusionRays = 1;
        for (const uint32_t samples : {1u, 3u}) {
            SCOPED_TRACE(named.name);
            const Planes host = drawnBy(*host_, request, samples), cast = drawnBy(*casting_, request, samples);
            EXPECT_EQ(cast.picture, host.picture);
            EXPECT_EQ(cast.depth, host.depth);
            EXPECT_EQ(cast.normals, host.normals);
        }
        const FrameStats stats = casting_->render(request).value();
        EXPECT_TRUE(stats.onHost);
        EXPECT_EQ(stats.pipelines, 0u) << "no shader is compiled";
        EXPECT_EQ(stats.submissions, 0u);
    }
}

TEST_F(CastByRendererTest, PartsMakeTheSamePicture) {
    const test::BuiltMesh built = torusAndBox();
    ASSERT_TRUE(built.ok());
    openAll({placed(built.file())});
    // So many rays a pixel that a sample has several parts.
    FrameRequest request = requestOf(test::cameras(kLow, kHigh)[0].camera, 320, 240);
    request.shading.occlusionRays = 16;
    ASSERT_TRUE(casting_->settle(request));
    ASSERT_TRUE(casting_->render(request));
    uint32_t parts = 1;
    while (casting_->refineAhead().value() < 2) ++parts;
    EXPECT_GT(parts, 3u);
    const Planes host = drawnBy(*host_, request, 2);
    const Picture cast = casting_->readPicture().value();
    uint64_t differing = 0;
    for (size_t i = 0; i < host.depth.size(); ++i) differing += channelsApart(host.picture, cast, i) > 2 ? 1 : 0;
    EXPECT_LE(differing, host.depth.size() / 10000);
}

TEST_F(CastByRendererTest, PicksWhatTheDevicePicks) {
    const test::BuiltMesh built = torusAndBox();
    ASSERT_TRUE(built.ok());
    const Similarity beside{glm::dquat(1, 0, 0, 0), 0.5, {3, 0, 0}};
    openAll({placed(built.file()), placed(built.file(), beside)});
    const FrameRequest request = requestOf(test::cameras(kLow, {4, 2, 2})[0].camera, 160, 120);
    for (PictureRenderer* each :
         {static_cast<PictureRenderer*>(renderer_.get()), static_cast<PictureRenderer*>(casting_.get())})
        ASSERT_TRUE(each->drawSettled(request));
    const test::PickDifference picks = test::comparePicks(*casting_, *renderer_, request);
    EXPECT_LE(picks.differing, 1u);
    EXPECT_GT(picks.ofDataset[0], 20u);
    EXPECT_GT(picks.ofDataset[1], 5u);
    EXPECT_FALSE(casting_->pick(request.width, 0).value());
}

TEST_F(CastByRendererTest, WhatTheHostDoesNotDrawTheDeviceDraws) {
    const Scene seams = test::sphereScene(2);
    const std::vector<PlacedDataset> datasets{{seams.dataset, seams.source, {}}};
    ASSERT_TRUE(renderer_->open(datasets));
    ASSERT_TRUE(casting_->open(datasets));
    const FrameRequest request = requestOf(test::cameras(seams)[0].camera);
    EXPECT_EQ(drawnBy(*casting_, request).picture, drawnBy(*renderer_, request).picture);
    EXPECT_FALSE(casting_->render(request)->onHost);
    // And back again, dataset by dataset.
    const test::BuiltMesh built = torusAndBox();
    openAll({placed(built.file())});
    const FrameRequest other = requestOf(test::cameras(kLow, kHigh)[0].camera);
    EXPECT_EQ(drawnBy(*casting_, other).picture, drawnBy(*host_, other).picture);
    EXPECT_TRUE(casting_->render(other)->onHost);
}

TEST_F(CastByRendererTest, CountsTheWorkOfTheHostsRays) {
    const test::BuiltMesh built = torusAndBox();
    openAll({placed(built.file())});
    FrameRequest request = requestOf(test::cameras(kLow, kHigh)[0].camera);
    drawnBy(*host_, request), drawnBy(*casting_, request);
    EXPECT_EQ(host_->readWork().error().code, ErrorCode::Usage);
    EXPECT_EQ(casting_->readWork().error().code, ErrorCode::Usage);
    request.shading.mode = ShadingMode::Fetches;
    EXPECT_EQ(drawnBy(*casting_, request).picture, drawnBy(*host_, request).picture);
    EXPECT_EQ(casting_->readWork().value(), host_->readWork().value());
}

// A ray of the shaders meets what its group of the host's meets, or less.
TEST_F(HostRendererTest, WorkIsThatOfGroupsOfRays) {
    const test::BuiltMesh built = torusAndBox();
    ASSERT_TRUE(built.ok());
    open(built);
    for (const NamedCamera& named : test::cameras(kLow, kHigh)) {
        SCOPED_TRACE(named.name);
        FrameRequest request = requestOf(named.camera);
        const Planes lit = drawnBy(*host_, request);
        std::vector<uint32_t> work[3], ofShaders;
        for (int i = 0; i < 3; ++i) {
            request.shading.mode = std::array{ShadingMode::Steps, ShadingMode::Cells, ShadingMode::Fetches}[size_t(i)];
            const Planes counted = drawnBy(*host_, request);
            work[i] = host_->readWork().value();
            EXPECT_EQ(counted.depth, lit.depth);
            EXPECT_EQ(counted.normals, lit.normals);
            expectColoursOf(counted.picture, work[i], falseColourEnd(request.shading.mode));
        }
        request.shading.mode = ShadingMode::Cells;
        drawnBy(*renderer_, request);
        ofShaders = renderer_->readWork().value();
        uint64_t fewer = 0, sum = 0, sumOfShaders = 0, hits = 0;
        for (size_t i = 0; i < lit.depth.size(); ++i) {
            const auto [steps, cells, fetches] = std::array{work[0][i], work[1][i], work[2][i]};
            EXPECT_GE(fetches, steps + cells);
            if (!std::isfinite(lit.depth[i])) continue;
            EXPECT_GT(steps, 3u);
            EXPECT_GT(cells, 0u);
            fewer += cells < ofShaders[i] ? 1 : 0;
            sum += cells, sumOfShaders += ofShaders[i], ++hits;
        }
        EXPECT_LE(double(fewer), 1e-3 * double(hits)) << "rays that pass the edges of leaves";
        EXPECT_LT(double(sum), 8.0 * double(sumOfShaders));
    }
}

TEST_F(CastByRendererTest, CancellingEndsAFrame) {
    const test::BuiltMesh built = torusAndBox();
    ASSERT_TRUE(built.ok());
    openAll({placed(built.file())});
    const FrameRequest request = requestOf(test::cameras(kLow, kHigh)[0].camera);
    ASSERT_TRUE(casting_->drawSettled(request));
    const auto stopped = casting_->render(request, [] { return true; });
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::Cancelled);
    EXPECT_FALSE(casting_->readPicture()) << "there is no half of a picture";
    EXPECT_TRUE(casting_->render(request));
}

TEST_F(HostRendererTest, EveryKindOfLeafFromEveryCamera) {
    for (const Scene& scene : test::scenesOfEveryLeaf()) {
        SCOPED_TRACE(scene.name);
        open(scene);
        Difference all;
        for (const NamedCamera& named : test::cameras(scene)) {
            FrameRequest request = requestOf(named.camera);
            all += difference(request, scene.dataset->header.cell);
        }
        expectFew(all);
    }
}

TEST_F(HostRendererTest, ABuiltMeshInEveryModeAndSeveralLevels) {
    const test::BuiltMesh built = torusAndBox();
    ASSERT_TRUE(built.ok());
    open(built);
    const auto cameras = test::cameras(kLow, kHigh);
    for (const double errorPixels : {0.2, 4.0, 30.0}) {
        Difference all;
        for (size_t i = 0; i < cameras.size(); ++i) {
            FrameRequest request = requestOf(cameras[i].camera);
            request.errorPixels = errorPixels;
            request.shading.mode = kModes[i % std::size(kModes)];
            all += difference(request, built.cache().dataset().header.cell);
        }
        expectFew(all);
    }
}

// Lines come from the place of a hit in its leaf, so a hit on another leaf may have another line.
TEST_F(HostRendererTest, WireframesOfEveryKindOfLeaf) {
    const test::BuiltMesh built = torusAndBox();
    ASSERT_TRUE(built.ok());
    open(built);
    for (const double errorPixels : {0.2, 4.0, 30.0}) {
        Difference all;
        uint64_t inked = 0;
        for (const NamedCamera& named : test::cameras(kLow, kHigh)) {
            SCOPED_TRACE(named.name);
            FrameRequest request = requestOf(named.camera);
            request.errorPixels = errorPixels;
            request.shading.mode = ShadingMode::Clay;
            const Planes clay = drawnBy(*host_, request);
            request.shading.mode = ShadingMode::Wireframe;
            all += difference(request, built.cache().dataset().header.cell);
            const Planes wired = drawnBy(*host_, request);
            for (size_t i = 0; i < clay.depth.size(); ++i)
                inked += channelsApart(clay.picture, wired.picture, i) > 16 ? 1 : 0;
        }
        expectFew(all);
        EXPECT_GT(inked, 1000u);
    }
    Difference leaves;
    for (const Scene& scene : test::scenesOfEveryLeaf()) {
        open(scene);
        for (const NamedCamera& named : test::cameras(scene)) {
            FrameRequest request = requestOf(named.camera);
            request.shading.mode = ShadingMode::Wireframe;
            leaves += difference(request, scene.dataset->header.cell);
        }
    }
    expectFew(leaves);
}

TEST_F(HostRendererTest, ShadowsAndOcclusion) {
    const test::BuiltMesh built = torusAndBox();
    ASSERT_TRUE(built.ok());
    open(built);
    Difference all;
    uint64_t darker = 0;
    for (const NamedCamera& named : test::cameras(kLow, kHigh)) {
        SCOPED_TRACE(named.name);
        FrameRequest request = requestOf(named.camera);
        const Planes plain = drawnBy(*host_, request);
        request.shading.shadows = true;
        all += difference(request, built.cache().dataset().header.cell);
        request.shading.occlusionRays = 4;
        all += difference(request, built.cache().dataset().header.cell);
        const Planes shaded = drawnBy(*host_, request);
        for (size_t i = 0; i < plain.depth.size(); ++i) {
            EXPECT_LE(shaded.picture.rgba[4 * i], plain.picture.rgba[4 * i]);
            darker += shaded.picture.rgba[4 * i] + 8 < plain.picture.rgba[4 * i] ? 1 : 0;
        }
    }
    expectFew(all);
    EXPECT_GT(darker, 5000u);
}

TEST_F(HostRendererTest, LightFromEverywhere) {
    expectFew(differenceOfAll([](Shading& shading) {
        shading.environment = environmentNamed("studio");
        shading.environment->turn = 70;
        shading.occlusionRays = 2;
    }));
}

TEST_F(HostRendererTest, SixteenSamples) {
    expectFew(differenceOfAll(
                  [](Shading& shading) {
                      shading.shadows = true;
                      shading.occlusionRays = 1;
                      shading.transparent = true;
                  },
                  16),
              16);
}

// Nothing stands between a convex body and its light: not the body itself either.
TEST_F(HostRendererTest, AConvexBodyCastsNoShadowOnItself) {
    for (const Scene& scene :
         {test::sphereScene(1), test::sphereScene(1, glm::dvec3(4e6, -3e6, 1e6), 0.01), test::cubeScene(0)}) {
        open(scene);
        for (const glm::vec3 light : {glm::vec3(-0.35, 0.55, 0.75), glm::vec3(-1, 0.05, 0.1)}) {
            FrameRequest request = requestOf(test::cameras(scene).front().camera);
            request.shading.lightDirection = light;
            const Planes plain = drawnBy(*host_, request);
            request.shading.shadows = true;
            request.shading.occlusionRays = 4;
            EXPECT_EQ(drawnBy(*host_, request).picture, plain.picture) << scene.name;
        }
    }
}

/// A ball whose colours change from vertex to vertex.
void writePaintedBall(const std::filesystem::path& file) {
    constexpr int kRows = 60, kColumns = 120;
    std::ofstream out(file);
    out << "ply\nformat ascii 1.0\nelement vertex " << (kRows + 1) * kColumns
        << "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\n"
           "property uchar blue\nelement face "
        << 2 * kRows * kColumns << "\nproperty list uchar int vertex_indices\nend_header\n";
    for (int row = 0; row <= kRows; ++row)
        for (int column = 0; column < kColumns; ++column) {
            const double up = M_PI * row / kRows, around = 2 * M_PI * column / kColumns;
            out << std::sin(up) * std::cos(around) << ' ' << std::cos(up) << ' ' << std::sin(up) * std::sin(around)
                << ' ' << 40 + 3 * row << ' ' << 60 + column << ' ' << (row * 37 + column * 11) % 200 + 30 << '\n';
        }
    for (int row = 0; row < kRows; ++row)
        for (int column = 0; column < kColumns; ++column) {
            const int right = (column + 1) % kColumns, here = row * kColumns, below = here + kColumns;
            out << "3 " << here + column << ' ' << here + right << ' ' << below + column << '\n';
            out << "3 " << here + right << ' ' << below + right << ' ' << below + column << '\n';
        }
}

TEST_F(HostRendererTest, ColoursOfEveryKindOfLeaf) {
    const TestFolder folder("vcp_host_renderer_test");
    writePaintedBall(folder / "ball.ply");
    for (const double error : {0.0, 0.002}) {
        BuildOptions options;
        options.inputs = {folder / "ball.ply"};
        options.output = folder / "ball.vcp";
        options.overwrite = true;
        options.cell = error > 0 ? 0.1 : 0.03;
        options.error = error;  // above 0: soft leaves, here of one level
        const auto report = buildOctree(options);
        ASSERT_TRUE(report) << report.error().line();
        open({placed(folder / "ball.vcp")});
        Difference all;
        for (const ShadingMode mode : {ShadingMode::Lit, ShadingMode::Unlit})
            for (const NamedCamera& named : test::cameras(glm::dvec3(-1), glm::dvec3(1)))
                for (const double errorPixels : {1e-3, 5.0}) {
                    FrameRequest request = requestOf(named.camera);
                    request.errorPixels = errorPixels;
                    request.shading.mode = mode;
                    request.shading.occlusionRays = mode == ShadingMode::Lit ? 2 : 0;
                    all += difference(request, options.cell);
                }
        expectFew(all);
    }
}

TEST_F(HostRendererTest, SeveralDatasetsTurnedAndScaled) {
    const test::BuiltMesh built = torusAndBox();
    ASSERT_TRUE(built.ok());
    const Similarity beside{glm::angleAxis(0.7, glm::normalize(glm::dvec3(1, 2, -0.5))), 0.6, {0.5, 0.2, 0.7}};
    open({placed(built.file()), placed(built.file(), beside)});
    Difference all;
    for (const ShadingMode mode : {ShadingMode::Lit, ShadingMode::Normals})
        for (const NamedCamera& named : test::cameras(kLow, kHigh)) {
            FrameRequest request = requestOf(named.camera);
            request.shading.mode = mode;
            request.shading.shadows = true;
            all += difference(request, built.cache().dataset().header.cell);
        }
    expectFew(all);
}

TEST_F(HostRendererTest, ATileShowsThatPartOfTheWhole) {
    const test::BuiltMesh built = torusAndBox();
    ASSERT_TRUE(built.ok());
    open(built);
    for (const NamedCamera& named : {test::cameras(kLow, kHigh)[0], test::cameras(kLow, kHigh)[5]}) {
        FrameRequest request = requestOf(named.camera, 160, 120);
        const Planes whole = drawnBy(*host_, request);
        const PictureTile tile{40, 24, request.width, request.height};
        request.width = 72, request.height = 56;
        request.tile = tile;
        const Planes part = drawnBy(*host_, request);
        uint64_t hits = 0, differing = 0;
        for (uint32_t y = 0; y < request.height; ++y)
            for (uint32_t x = 0; x < request.width; ++x) {
                const size_t in = size_t{y} * request.width + x, at = size_t{y + tile.y} * 160 + x + tile.x;
                hits += std::isfinite(part.depth[in]) ? 1 : 0;
                for (size_t c = 0; c < 4; ++c)
                    differing += std::abs(part.picture.rgba[4 * in + c] - whole.picture.rgba[4 * at + c]) > 2 ? 1 : 0;
            }
        EXPECT_GT(hits, 1000u);
        EXPECT_LE(differing, 8u);
    }
}

TEST_F(HostRendererTest, TheSameRequestGivesTheSameBytes) {
    const test::BuiltMesh built = torusAndBox();
    ASSERT_TRUE(built.ok());
    open(built);
    FrameRequest request = requestOf(test::cameras(kLow, kHigh)[0].camera);
    request.shading.occlusionRays = 2;
    const Planes once = drawnBy(*host_, request), again = drawnBy(*host_, request);
    EXPECT_EQ(once.picture, again.picture);
    EXPECT_EQ(once.depth, again.depth);
}

TEST_F(HostRendererTest, WithoutADatasetThereIsTheBackground) {
    FrameRequest request = requestOf(Camera{});
    EXPECT_EQ(drawnBy(*host_, request).picture, drawnBy(*renderer_, request).picture);
    request.shading.transparent = true;
    EXPECT_EQ(drawnBy(*host_, request).picture, drawnBy(*renderer_, request).picture);
}

TEST_F(HostRendererTest, ABudgetTooSmallIsKept) {
    const test::BuiltMesh built(test::torusMesh({0.1, 0.2, 0.3}, 1, 0.4, 240, 120), 0.01);
    ASSERT_TRUE(built.ok());
    RendererOptions options;
    options.budgetBytes = 1 << 20;
    host_ = HostRenderer::create(options).value();
    ASSERT_TRUE(host_->open({placed(built.file())}, {}));
    FrameRequest request = requestOf(test::cameras(kLow, kHigh)[0].camera, 640, 480);
    request.errorPixels = 1e-3;
    const Planes drawn = drawnBy(*host_, request);
    EXPECT_TRUE(drawn.update.settled);
    EXPECT_TRUE(drawn.update.relaxed);
    EXPECT_LE(drawn.update.residentBytes, options.budgetBytes);
    EXPECT_GT(std::ranges::count_if(drawn.depth, [](float d) { return std::isfinite(d); }), 1000);
    options.budgetBytes = 1000;
    EXPECT_EQ(HostRenderer::create(options).error().code, ErrorCode::Usage);
}

TEST_F(HostRendererTest, RefusesWhatItDoesNotDraw) {
    const Scene scene = test::sphereScene(1), seams = test::sphereScene(2);
    EXPECT_EQ(host_->open({{seams.dataset, seams.source, {}}}, {}).error().code, ErrorCode::Unsupported);
    open(scene);
    const std::vector<MesoSurface> surfaces(1);  // without arrays, as those that are remeshed
    EXPECT_EQ(host_->setSurfaces(surfaces).error().code, ErrorCode::Unsupported);
    EXPECT_FALSE(host_->open({{scene.dataset, scene.source, {}}}, surfaces));
    auto paper = std::make_shared<Dataset>(*scene.dataset);
    paper->header.method = Method::Paper;
    EXPECT_EQ(host_->open({{paper, scene.source, {}}}, {}).error().code, ErrorCode::Unsupported);
    RendererOptions options;
    options.validation = true;
    EXPECT_FALSE(HostRenderer::create(options));
    options = {};
    options.device = "Host";
    EXPECT_EQ(createPictureRenderer(options).value()->device().name, kHostName);
    EXPECT_EQ(Renderer::create(options).error().code, ErrorCode::Unsupported);
}

TEST_F(HostRendererTest, StopsBetweenTiles) {
    open(test::cubeScene(0));
    const FrameRequest request = requestOf(test::cameras(test::cubeScene(0))[0].camera, 640, 480);
    ASSERT_TRUE(host_->settle(request));
    std::atomic<int> asked = 0;
    const auto drawn = host_->render(request, [&] { return ++asked > 3; });
    ASSERT_FALSE(drawn);
    EXPECT_EQ(drawn.error().code, ErrorCode::Cancelled);
    EXPECT_LT(asked, 40 * 60);
    EXPECT_FALSE(host_->readPicture()) << "there is no picture";
    EXPECT_TRUE(host_->render(request));
}

}  // namespace
}  // namespace vcp
