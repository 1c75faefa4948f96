// Samples of a pixel: where they lie, and pictures that are the mean of theirs.
#include "render/pixel_samples.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "render/host_renderer.h"
#include "render/picture_parts.h"
#include "tests/support/built_mesh.h"
#include "tests/support/reference_comparison.h"

namespace vcp {
namespace {

using test::requestOf;
using test::Scene;

TEST(PixelSamples, TheFirstIsTheMiddleAndAllLieInThePixel) {
    EXPECT_EQ(sampleOffset(0), glm::dvec2(0));
    for (uint32_t i = 1; i < kMostSamples; ++i) {
        EXPECT_LT(std::abs(sampleOffset(i).x), 0.5);
        EXPECT_LT(std::abs(sampleOffset(i).y), 0.5);
        EXPECT_NE(sampleOffset(i), glm::dvec2(0));
    }
}

TEST(PixelSamples, EachBoxOfAPartHoldsOne) {
    for (const int count : {4, 16, 64})
        for (int columns = 1; columns <= count; columns *= 2) {
            const int rows = count / columns;
            std::set<std::pair<int, int>> boxes;
            for (int i = 0; i < count; ++i) {
                const glm::dvec2 at = sampleOffset(uint32_t(i)) + 0.5;
                boxes.insert({int(at.x * columns), int(at.y * rows)});
            }
            EXPECT_EQ(boxes.size(), size_t(count)) << columns << " x " << rows;
        }
}

/// The part of a unit square about 0 that lies below an edge: dot(normal, p) < offset. To 1/256.
double coverage(glm::dvec2 normal, double offset) {
    constexpr int kLines = 256;
    double sum = 0;
    for (int i = 0; i < kLines; ++i) {
        // Along a line of one x, the edge is passed at one y.
        const double x = (i + 0.5) / kLines - 0.5, y = (offset - normal.x * x) / normal.y;
        sum += normal.y > 0 ? std::clamp(y + 0.5, 0.0, 1.0) : std::clamp(0.5 - y, 0.0, 1.0);
    }
    return sum / kLines;
}

TEST(PixelSamples, JudgeTheCoverageOfAnyEdge) {
    struct Bound {
        uint32_t samples;
        double worst, rms;
    };
    for (const Bound bound : {Bound{16, 0.125, 0.033}, Bound{64, 0.07, 0.013}}) {
        double worst = 0, squares = 0;
        int edges = 0;
        for (int turn = 0; turn < 90; ++turn) {
            const double angle = (turn + 0.5) * 2 * M_PI / 90;
            const glm::dvec2 normal(std::cos(angle), std::sin(angle));
            for (int step = 0; step < 100; ++step, ++edges) {
                const double offset = -0.71 + 1.42 * step / 99;
                double below = 0;
                for (uint32_t i = 0; i < bound.samples; ++i)
                    below += glm::dot(normal, sampleOffset(i)) < offset ? 1 : 0;
                const double error = below / bound.samples - coverage(normal, offset);
                worst = std::max(worst, std::abs(error));
                squares += error * error;
            }
        }
        EXPECT_LT(worst, bound.worst) << bound.samples;
        EXPECT_LT(std::sqrt(squares / edges), bound.rms) << bound.samples;
    }
}

TEST(PixelSamples, PicturesOfNumbersHaveOne) {
    FrameRequest request;
    for (const ShadingMode mode : {ShadingMode::Lit, ShadingMode::Clay, ShadingMode::Unlit}) {
        request.shading.mode = mode;
        EXPECT_EQ(samplesOf(request, 16), 16u);
        EXPECT_EQ(samplesOf(request, 0), 1u);
        EXPECT_EQ(samplesOf(request, 1000), kMostSamples);
    }
    for (const ShadingMode mode : {ShadingMode::Normals, ShadingMode::Steps, ShadingMode::Cells, ShadingMode::Fetches,
                                   ShadingMode::Level, ShadingMode::Error}) {
        request.shading.mode = mode;
        EXPECT_EQ(samplesOf(request, 16), 1u);
    }
}

TEST(PictureParts, AreAllRowsOnceAndOfOneSize) {
    for (const uint32_t height : {1u, 7u, 120u, 721u, 2048u})
        for (const uint32_t raysPerPixel : {1u, 10u, 73u})
            for (const uint32_t occlusionRays : {0u, 8u}) {
                FrameRequest request;
                request.width = 1280, request.height = height;
                request.shading.occlusionRays = occlusionRays;
                request.tile = PictureTile{16, 32, 4000, 4000};
                uint32_t row = 0;
                for (uint32_t number = 0;; ++number) {
                    const PicturePart part = picturePart(request, number, raysPerPixel);
                    const bool isWhole = part.rows == height;
                    EXPECT_EQ(part.row, row);
                    EXPECT_GE(part.rows, 1u);
                    EXPECT_EQ(part.request.width, request.width);
                    EXPECT_EQ(part.request.height, picturePart(request, 0, raysPerPixel).request.height);
                    EXPECT_EQ(wholePicture(part.request).y + part.skippedRows, 32 + row);
                    EXPECT_EQ(wholePicture(part.request).y % 4, 0u) << "squares of occlusion stay aligned";
                    EXPECT_LE(part.skippedRows + part.rows, part.request.height);
                    if (occlusionRays > 0 && !isWhole) {
                        EXPECT_TRUE(row == 0 || part.skippedRows >= 2);
                        EXPECT_TRUE(part.isLast || part.request.height >= part.skippedRows + part.rows + 2);
                    }
                    row += part.rows;
                    if (part.isLast) break;
                }
                EXPECT_EQ(row, height);
            }
}

/// The colours of several pictures' mean light, each channel 0 to 255, in double precision.
std::vector<double> meanOf(const std::vector<Picture>& pictures) {
    std::vector<double> mean(pictures.front().rgba.size());
    for (size_t i = 0; i < mean.size(); i += 4) {
        double light[3] = {}, alpha = 0;
        for (const Picture& picture : pictures) {
            const double a = picture.rgba[i + 3] / 255.0;
            for (size_t c = 0; c < 3; ++c) light[c] += a * std::pow(picture.rgba[i + c] / 255.0, 2.2);
            alpha += a;
        }
        for (size_t c = 0; c < 3; ++c) mean[i + c] = alpha > 0 ? 255 * std::pow(light[c] / alpha, 1 / 2.2) : 0;
        mean[i + 3] = 255 * alpha / double(pictures.size());
    }
    return mean;
}

class SamplesTest : public test::RendererFixture {
protected:
    void startBoth() {
        start();
        host_ = HostRenderer::create({}).value();
    }
    void open(const std::vector<PlacedDataset>& datasets) {
        for (PictureRenderer* renderer : both()) ASSERT_TRUE(renderer->open(datasets, {}));
    }
    static PlacedDataset placed(const test::BuiltMesh& built, const Similarity& placement = {}) {
        auto reader = openFile(built.file()).value();
        const auto dataset = std::make_shared<const Dataset>(readDataset(*reader).value());
        return {dataset, std::make_shared<FilePageSource>(reader, dataset), placement};
    }
    [[nodiscard]] std::vector<PictureRenderer*> both() const { return {host_.get(), renderer_.get()}; }
    static FrameStats sampled(PictureRenderer& renderer, const FrameRequest& request, uint32_t samples) {
        EXPECT_TRUE(renderer.settle(request));
        const auto stats = renderer.render(request);
        EXPECT_TRUE(stats) << stats.error().line();
        EXPECT_TRUE(renderer.refineTo(samples, request));
        return stats ? *stats : FrameStats{};
    }
    /// Compares a refined picture with the mean of its samples, drawn one by one.
    static void expectMean(PictureRenderer& renderer, const FrameRequest& request, uint32_t samples) {
        std::vector<Picture> each;
        std::vector<float> depth;
        std::vector<glm::vec3> normals;
        ASSERT_TRUE(renderer.settle(request));
        for (uint32_t i = 0; i < samples; ++i) {
            FrameRequest one = request;
            one.sample = i;
            ASSERT_TRUE(renderer.render(one));
            each.push_back(renderer.readPicture().value());
            if (i > 0) continue;
            depth = renderer.readDepth().value();
            normals = renderer.readNormals().value();
        }
        sampled(renderer, request, samples);
        const Picture refined = renderer.readPicture().value();
        const std::vector<double> mean = meanOf(each);
        uint64_t changed = 0;
        double worst = 0;
        for (size_t i = 0; i < mean.size(); ++i) {
            worst = std::max(worst, std::abs(refined.rgba[i] - mean[i]));
            changed += refined.rgba[i] != each.front().rgba[i] ? 1 : 0;
            const bool isSame = std::ranges::all_of(
                each, [&](const Picture& picture) { return picture.rgba[i] == each.front().rgba[i]; });
            const bool isOpaque =
                std::ranges::all_of(each, [&](const Picture& picture) { return picture.rgba[i | 3] == 255; });
            const bool mustBeSame = isSame && isOpaque;
            EXPECT_TRUE(!mustBeSame || refined.rgba[i] == each.front().rgba[i]);
        }
        EXPECT_LT(worst, 0.51);
        EXPECT_GT(changed, 300u) << "samples must differ";
        EXPECT_EQ(renderer.readDepth().value(), depth);
        EXPECT_EQ(renderer.readNormals().value(), normals);
    }
    std::unique_ptr<HostRenderer> host_;
};

test::BuiltMesh torus() { return {test::torusMesh({0.1, 0.2, 0.3}, 1, 0.4, 60, 30), 0.05}; }
const glm::dvec3 kLow(-1.4, -1.3, -1.2), kHigh(1.6, 1.7, 1.8);

TEST_F(SamplesTest, APictureIsTheMeanLightOfItsSamples) {
    startBoth();
    const test::BuiltMesh built = torus();
    ASSERT_TRUE(built.ok());
    open({placed(built), placed(built, {glm::angleAxis(0.7, glm::dvec3(1, 0, 0)), 0.6, {0.5, 0.2, 0.7}})});
    for (PictureRenderer* renderer : both())
        for (const size_t camera : {size_t{0}, size_t{5}}) {
            SCOPED_TRACE(renderer->device().name);
            FrameRequest request = requestOf(test::cameras(kLow, kHigh)[camera].camera);
            request.shading.shadows = camera > 0;
            expectMean(*renderer, request, 5);
            request.shading.transparent = true;
            expectMean(*renderer, request, 16);
        }
}

// Rays of a part begin as those of the whole do, to the rounding: an edge may pass between.
TEST_F(SamplesTest, PartsMeetWithoutASeam) {
    startBoth();
    const test::BuiltMesh built = torus();
    ASSERT_TRUE(built.ok());
    open({placed(built)});
    FrameRequest request = requestOf(test::cameras(kLow, kHigh)[0].camera, 320, 240);
    request.shading.occlusionRays = 15;
    ASSERT_FALSE(picturePart(request, 0, 16).isLast);
    ASSERT_TRUE(renderer_->settle(request) && renderer_->render(request));
    std::vector<Picture> each{renderer_->readPicture().value()};
    request.sample = 1;
    ASSERT_TRUE(renderer_->render(request));
    each.push_back(renderer_->readPicture().value());
    request.sample = 0;
    sampled(*renderer_, request, 2);
    const Picture refined = renderer_->readPicture().value();
    const std::vector<double> mean = meanOf(each);
    uint64_t apart = 0;
    for (size_t i = 0; i < mean.size(); ++i) apart += std::abs(refined.rgba[i] - mean[i]) > 0.51 ? 1 : 0;
    EXPECT_LT(apart, mean.size() / 2000);
}

TEST_F(SamplesTest, AlphaIsTheCoverageOfAStraightEdge) {
    startBoth();
    const double angle = 0.3;
    const glm::dvec2 along(std::cos(angle), std::sin(angle)), across(-along.y, along.x);
    IndexedMesh mesh;
    for (const glm::dvec2 corner : {-along - across, along - across, along + across, -along + across})
        mesh.positions.emplace_back(corner, 0.0);
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    const test::BuiltMesh built(mesh, 0.1);
    ASSERT_TRUE(built.ok());
    open({placed(built)});
    Camera camera;
    camera.eye = {0, 0, 3};
    camera.forward = {0, 0, -1};
    camera.up = {0, 1, 0};
    camera.projection = Projection::Orthographic;
    camera.orthographicHeight = 4;
    FrameRequest request = requestOf(camera, 120, 120);
    request.errorPixels = 1e-3;
    request.shading.transparent = true;
    const double pixel = 4.0 / 120;
    for (PictureRenderer* renderer : both())
        for (const uint32_t samples : {16u, 64u}) {
            SCOPED_TRACE(renderer->device().name);
            sampled(*renderer, request, samples);
            const Picture picture = renderer->readPicture().value();
            double worst = 0;
            int partly = 0;
            for (int y = 0; y < 120; ++y)
                for (int x = 0; x < 120; ++x) {
                    // In pixels from the upper edge, y downwards as in the picture; away from its corners.
                    const glm::dvec2 middle((x + 0.5 - 60) * pixel, (60 - y - 0.5) * pixel);
                    if (std::abs(glm::dot(middle, along)) > 0.9 || glm::dot(middle, across) < 0) continue;
                    const glm::dvec2 outwards(across.x, -across.y);
                    const double expected = coverage(outwards, (1 - glm::dot(middle, across)) / pixel);
                    const uint8_t* rgba = &picture.rgba[4 * size_t(120 * y + x)];
                    worst = std::max(worst, std::abs(rgba[3] / 255.0 - expected));
                    if (expected < 0.02 || expected > 0.98) continue;
                    ++partly;
                    if (rgba[3] == 0) continue;
                    const uint8_t* inside = &picture.rgba[4 * size_t(120 * 60 + 60)];
                    for (int c = 0; c < 3; ++c) EXPECT_EQ(rgba[c], inside[c]) << "no darker where alpha is soft";
                }
            EXPECT_GT(partly, 50);
            EXPECT_LT(worst, samples == 16 ? 1.0 / 8 : 1.0 / 16);
        }
}

TEST_F(SamplesTest, OneSampleMakesNothing) {
    startBoth();
    const test::BuiltMesh built = torus();
    ASSERT_TRUE(built.ok());
    open({placed(built)});
    const FrameRequest request = requestOf(test::cameras(kLow, kHigh)[0].camera);
    const FrameStats first = draw(request);
    const Picture picture = renderer_->readPicture().value();
    EXPECT_EQ(sampled(*renderer_, request, 1).pipelines, first.pipelines);
    EXPECT_EQ(renderer_->readPicture().value(), picture);
    const FrameStats refined = sampled(*renderer_, request, 4);
    EXPECT_EQ(refined.hitPixels, first.hitPixels);
    EXPECT_EQ(renderer_->render(request)->pipelines, first.pipelines + 1) << "one that accumulates";
    EXPECT_EQ(renderer_->readPicture().value(), picture) << "the next picture begins anew";
}

TEST_F(SamplesTest, WhatCannotBeRefined) {
    startBoth();
    const test::BuiltMesh built(test::torusMesh({0.1, 0.2, 0.3}, 1, 0.4, 240, 120), 0.01);
    ASSERT_TRUE(built.ok());
    FrameRequest request = requestOf(test::cameras(kLow, kHigh)[0].camera, 64, 48);
    for (PictureRenderer* renderer : both()) {
        SCOPED_TRACE(renderer->device().name);
        EXPECT_EQ(renderer->refine().value(), 0u) << "nothing was drawn";
        ASSERT_TRUE(renderer->open(std::vector{placed(built)}, {}));
        EXPECT_EQ(renderer->refine().value(), 0u) << "nothing was drawn";
        sampled(*renderer, request, kMostSamples);
        EXPECT_EQ(renderer->refine().error().code, ErrorCode::Usage) << "it has all";
        FrameRequest other = request;
        other.shading.mode = ShadingMode::Level;
        ASSERT_TRUE(renderer->render(other));
        EXPECT_EQ(renderer->refine().error().code, ErrorCode::Usage) << "numbers have no mean";
        other = request;
        other.sample = 1;
        ASSERT_TRUE(renderer->render(other));
        EXPECT_EQ(renderer->refine().error().code, ErrorCode::Usage) << "the first is not the middle";
        other.sample = kMostSamples;
        EXPECT_EQ(renderer->render(other).error().code, ErrorCode::Usage);
        ASSERT_TRUE(renderer->render(request));
        EXPECT_EQ(renderer->refine().value(), 2u);
        other = request;
        other.errorPixels = 60;
        ASSERT_TRUE(renderer->settle(other));
        EXPECT_EQ(renderer->refine().value(), 0u) << "other pages are drawn now";
        ASSERT_TRUE(renderer->settle(request) && renderer->render(request));
        EXPECT_EQ(renderer->refine().value(), 2u);
    }
}

TEST_F(SamplesTest, CancelledBetweenSamplesItGoesOn) {
    startBoth();
    const test::BuiltMesh built = torus();
    ASSERT_TRUE(built.ok());
    open({placed(built)});
    const FrameRequest request = requestOf(test::cameras(kLow, kHigh)[0].camera);
    for (PictureRenderer* renderer : both()) {
        SCOPED_TRACE(renderer->device().name);
        sampled(*renderer, request, 4);
        const Picture expected = renderer->readPicture().value();
        ASSERT_TRUE(renderer->render(request));
        ASSERT_EQ(renderer->refine().value(), 2u);
        EXPECT_EQ(renderer->refine([] { return true; }).error().code, ErrorCode::Cancelled);
        EXPECT_EQ(renderer->refine().value(), 3u);
        EXPECT_EQ(renderer->refine().value(), 4u);
        EXPECT_EQ(renderer->readPicture().value(), expected);
        uint32_t told = 4;
        const auto stopped = renderer->refineTo(
            64, request, [&] { return told > 5; }, [&](uint32_t samples) { told = samples; });
        EXPECT_EQ(stopped.error().code, ErrorCode::Cancelled);
        EXPECT_EQ(told, 6u);
    }
}

TEST_F(SamplesTest, ALostDeviceBeginsAnew) {
    const Scene scene = test::torusScene();
    const FrameRequest request = requestOf(test::cameras(scene)[0].camera, 64, 48);
    start();
    show(scene);
    sampled(*renderer_, request, 4);
    const Picture expected = renderer_->readPicture().value();
    for (const uint64_t lostAt : {2u, 3u, 4u}) {
        SCOPED_TRACE(lostAt);
        RendererOptions options;
        options.faults.separateMemory = lostAt % 2 == 0;  // then pages are submitted, too
        options.faults.lostAtSubmission = lostAt;
        start(options);
        show(scene);
        ASSERT_TRUE(renderer_->drawSettled(request) && renderer_->refineTo(4, request));
        EXPECT_EQ(renderer_->update(request)->deviceLosses, 1u);
        EXPECT_EQ(renderer_->readPicture().value(), expected);
    }
}

TEST_F(SamplesTest, WithoutMemoryForSamplesThePoolIsHalved) {
    const Scene scene = test::sphereScene(4);
    FrameRequest request = requestOf(test::cameras(scene)[0].camera, 400, 300);
    request.errorPixels = 0.001;
    for (const bool separate : {false, true}) {
        SCOPED_TRACE(separate);
        RendererOptions options;
        options.faults.memoryBytes = 9 << 20;
        options.faults.separateMemory = options.faults.separateCopies = separate;
        start(options);
        show(scene);
        const uint64_t pool = draw(request).poolBytes;
        ASSERT_TRUE(renderer_->refineTo(3, request));
        const Picture picture = renderer_->readPicture().value();
        const uint64_t smaller = renderer_->render(request)->poolBytes;
        EXPECT_LT(smaller, pool);
        EXPECT_GT(smaller, 0u);
        // A pool of that size from the beginning shows the same.
        RendererOptions plain;
        plain.budgetBytes = smaller;
        start(plain);
        show(scene);
        sampled(*renderer_, request, 3);
        EXPECT_EQ(renderer_->readPicture().value(), picture);
    }
}

TEST_F(SamplesTest, APartInFlightMayLoseAll) {
    const Scene sphere = test::sphereScene(), torus = test::torusScene();
    const FrameRequest request = requestOf(test::cameras(sphere)[0].camera);
    start();
    show(sphere);
    const auto drawPart = [&] {
        ASSERT_TRUE(renderer_->settle(request));
        ASSERT_TRUE(renderer_->renderAhead(request));
        EXPECT_EQ(renderer_->refineAhead().value(), 2u);
        EXPECT_TRUE(renderer_->isDrawing());
    };
    drawPart();
    ASSERT_TRUE(renderer_->setBudgets(uint64_t{2} << 20, uint64_t{8} << 20));
    EXPECT_EQ(renderer_->refineAhead().value(), 0u);
    drawPart();
    show(torus);
    EXPECT_EQ(renderer_->refineAhead().value(), 0u);
    drawPart();
    ASSERT_TRUE(renderer_->open({{torus.dataset, torus.source, {}}, {sphere.dataset, sphere.source, {}}}));
    EXPECT_EQ(renderer_->refineAhead().value(), 0u);
    drawPart();
    renderer_->close();
    EXPECT_EQ(renderer_->refineAhead().value(), 0u);
    drawPart();  // of the background
    {
        const auto other = renderer_->addView();
        ASSERT_TRUE(other);
        EXPECT_EQ((*other)->refineAhead().value(), 0u);
    }
    drawPart();
}

}  // namespace
}  // namespace vcp
