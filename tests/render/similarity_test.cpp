// Several datasets in one picture: the nearest seen, each as it would be alone but for the light.
#include "render/similarity.h"

#include <array>
#include <cmath>

#include <gtest/gtest.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "tests/support/renderer_fixture.h"

namespace vcp {
namespace {

using test::requestOf;

class SeveralDatasets : public test::RendererFixture {
protected:
    struct Shown {
        Picture picture;
        std::vector<float> depth;
        std::vector<glm::vec3> normals;
        FrameStats stats;
    };
    Shown shown(std::vector<PlacedDataset> datasets, const FrameRequest& request) {
        const auto opened = renderer_->open(std::move(datasets));
        EXPECT_TRUE(opened) << opened.error().line();
        const FrameStats stats = draw(request);
        return {renderer_->readPicture().value(), renderer_->readDepth().value(), renderer_->readNormals().value(),
                stats};
    }
};

Similarity besideAndSmaller(const test::Scene& scene) {
    const glm::dvec3 size = scene.boxMax - scene.boxMin;
    const glm::dquat turn = glm::angleAxis(0.7, glm::normalize(glm::dvec3(1, 2, -0.5)));
    const glm::dvec3 middle = 0.5 * (scene.boxMin + scene.boxMax);
    return {turn, 0.6, middle + glm::dvec3(0.3, 0.1, 0.35) * size.x - 0.6 * (turn * middle)};
}

TEST_F(SeveralDatasets, TheNearestIsSeen) {
    start();
    const test::Scene scene = test::sphereScene();
    const Similarity placed = besideAndSmaller(scene);
    const PlacedDataset first{scene.dataset, scene.source, {}}, second{scene.dataset, scene.source, placed};
    FrameRequest request = requestOf(fitCamera(scene.boxMin, scene.boxMax, {-0.3, -0.4, -1}, {0, 1, 0}, 0.8, 4.0 / 3));
    for (const ShadingMode mode : {ShadingMode::Lit, ShadingMode::Normals}) {
        request.shading.mode = mode;
        request.shading.shadows = mode == ShadingMode::Lit;
        const Shown a = shown({first}, request), b = shown({second}, request), both = shown({first, second}, request),
                    other = shown({second, first}, request);
        size_t fromFirst = 0, fromSecond = 0, hits = 0, shaded = 0;
        for (size_t i = 0; i < a.depth.size(); ++i) {
            const bool isFirst = a.depth[i] <= b.depth[i];
            const Shown& nearest = isFirst ? a : b;
            ASSERT_EQ(both.depth[i], nearest.depth[i]) << i;
            ASSERT_EQ(both.normals[i], nearest.normals[i]) << i;
            // With shadows, each shades the other too.
            for (size_t c = 4 * i; c < 4 * i + 4; ++c) {
                ASSERT_LE(both.picture.rgba[c], nearest.picture.rgba[c]) << i;
                shaded += both.picture.rgba[c] < nearest.picture.rgba[c] ? 1 : 0;
            }
            if (!std::isfinite(nearest.depth[i])) continue;
            ++hits;
            (isFirst ? fromFirst : fromSecond) += 1;
        }
        EXPECT_GT(fromFirst, 500u);
        EXPECT_GT(fromSecond, 500u);
        EXPECT_EQ(both.stats.hitPixels, hits);
        EXPECT_EQ(shaded > 0, request.shading.shadows);
        EXPECT_EQ(both.picture, other.picture);
        EXPECT_EQ(both.depth, other.depth);
    }
    for (uint32_t y = 5; y < request.height; y += 10)
        for (uint32_t x = 5; x < request.width; x += 10) {
            const auto hit = renderer_->pick(x, y).value();
            const float depth = renderer_->readDepth().value()[y * request.width + x];
            ASSERT_EQ(hit.has_value(), std::isfinite(depth));
            if (hit) {
                EXPECT_NEAR(hit->depth, depth, 1e-6 * depth);
            }
        }
}

// A sphere that is turned, scaled and moved is that sphere: every hit is on it, in the world.
TEST_F(SeveralDatasets, APlacedSphereIsWhereItIsPlaced) {
    start();
    const test::Scene scene = test::sphereScene();
    Similarity placed = besideAndSmaller(scene);
    placed.scale = 250;
    placed.translation = {1e5, -2e5, 3e4};
    const glm::dvec3 corners[2] = {placed.toWorld(scene.boxMin), placed.toWorld(scene.boxMax)};
    const FrameRequest request = requestOf(fitCamera(glm::min(corners[0], corners[1]), glm::max(corners[0], corners[1]),
                                                     {1, 0.2, -1}, {0, 1, 0}, 0.8, 4.0 / 3));
    const FrameRequest local = requestIn(placed, request);
    shown({{scene.dataset, scene.source, placed}}, request);
    std::vector<std::optional<PixelHit>> hits;
    for (uint32_t i = 0; i < request.width * request.height; i += 37)
        hits.push_back(renderer_->pick(i % request.width, i / request.width).value());
    shown({{scene.dataset, scene.source, {}}}, local);
    size_t found = 0;
    for (uint32_t i = 0, k = 0; i < request.width * request.height; i += 37, ++k) {
        const auto hit = renderer_->pick(i % request.width, i / request.width).value();
        ASSERT_EQ(hit.has_value(), hits[k].has_value());
        if (!hit) continue;
        ++found;
        EXPECT_LT(glm::distance(placed.toWorld(hit->position), hits[k]->position), 1e-5 * hits[k]->depth);
        EXPECT_LT(glm::distance(placed.rotation * glm::dvec3(hit->normal), glm::dvec3(hits[k]->normal)), 1e-5);
    }
    EXPECT_GT(found, 50u);
}

TEST_F(SeveralDatasets, ShareTheBudgetAndSurviveALostDevice) {
    RendererOptions options;
    options.budgetBytes = 4 << 20;
    options.faults.lostAtSubmission = 20;
    start(options);
    const test::Scene scene = test::sphereScene();
    const PlacedDataset first{scene.dataset, scene.source, {}},
        second{scene.dataset, scene.source, besideAndSmaller(scene)};
    FrameRequest request = requestOf(fitCamera(scene.boxMin, scene.boxMax, {-0.3, -0.4, -1}, {0, 1, 0}, 0.8, 4.0 / 3));
    const Shown before = shown({first, second}, request);
    uint32_t losses = 0;
    for (int i = 0; i < 20; ++i) {
        const auto update = renderer_->settle(request);
        ASSERT_TRUE(update);
        EXPECT_LE(update->residentBytes, options.budgetBytes);
        losses = update->deviceLosses;
        ASSERT_TRUE(renderer_->render(request));
    }
    EXPECT_EQ(losses, 1u);
    EXPECT_EQ(renderer_->readPicture().value(), before.picture);
    ASSERT_TRUE(renderer_->setBudgets(32 << 20, 64 << 20));
    draw(request);
    // One again.
    const Shown one = shown({first}, request);
    EXPECT_GT(one.stats.hitPixels, 500u);
    EXPECT_LT(one.stats.hitPixels, before.stats.hitPixels);
}

TEST_F(SeveralDatasets, TakeNoMoreThanTheBudgetTogether) {
    RendererOptions options;
    options.budgetBytes = 1 << 20;
    start(options);
    const test::Scene scene = test::sphereScene(4);
    const PlacedDataset first{scene.dataset, scene.source, {}},
        second{scene.dataset, scene.source, besideAndSmaller(scene)};
    ASSERT_TRUE(renderer_->open({first, second}));
    FrameRequest request = requestOf(fitCamera(scene.boxMin, scene.boxMax, {-0.3, -0.4, -1}, {0, 1, 0}, 0.8, 4.0 / 3));
    request.errorPixels = 0.001;
    for (const uint64_t budget : {1 << 20, 64 << 20, 1 << 20}) {
        ASSERT_TRUE(renderer_->setBudgets(budget, 64 << 20));
        const auto update = renderer_->settle(request);
        ASSERT_TRUE(update) << update.error().line();
        const auto stats = renderer_->render(request);
        ASSERT_TRUE(stats);
        EXPECT_LE(update->residentBytes, budget);
        EXPECT_LE(stats->poolBytes, budget);
        EXPECT_EQ(update->relaxed, budget == 1 << 20);
    }
    const auto refused = renderer_->open({first, second});
    EXPECT_TRUE(refused) << refused.error().line();
    ASSERT_TRUE(renderer_->setBudgets(1 << 20, 4 << 10));
    EXPECT_EQ(renderer_->open({first, second}).error().code, ErrorCode::Limit)
        << "no memory to read the coarsest pages";
}

TEST(SimilarityOfAMatrix, OnlySimilarities) {
    const auto of = [](std::array<double, 16> rows) { return similarityFromMatrix(rows); };
    const auto moved = of({0, -2, 0, 10, 2, 0, 0, 20, 0, 0, 2, 30, 0, 0, 0, 1});
    ASSERT_TRUE(moved) << moved.error().line();
    EXPECT_DOUBLE_EQ(moved->scale, 2);
    EXPECT_LT(glm::distance(moved->toWorld({1, 0, 0}), glm::dvec3(10, 22, 30)), 1e-12);
    EXPECT_LT(glm::distance(moved->fromWorld({10, 22, 30}), glm::dvec3(1, 0, 0)), 1e-12);
    const std::pair<std::array<double, 16>, const char*> wrong[] = {
        {{2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, "stretches"},
        {{1, 0.1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, "shears"},
        {{-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, "mirrors"},
        {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1}, "flattens"},
        {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0.1, 1}, "last row"},
        {{1, 0, 0, NAN, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, "finite"},
    };
    for (const auto& [rows, word] : wrong) {
        const auto refused = of(rows);
        ASSERT_FALSE(refused) << word;
        EXPECT_NE(refused.error().message.find(word), std::string::npos) << refused.error().message;
    }
}

}  // namespace
}  // namespace vcp
