// The marchers on the GPU, ray by ray against the reference on the CPU.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "render/meso_renderer.h"
#include "tests/mesostructure/meso_rays.h"

namespace vcp {
namespace {

using namespace meso;

class MesoMarch : public testing::Test {
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

    /// Single precision on both sides, in another order here and there: a ray may round to another cell, and then counts by a few.
    void expectSame(const Asset& asset, const Shape& shape, const MethodOptions& options, std::span<const MarchRay> rays) {
        SCOPED_TRACE(asset.name + " " + options.name);
        const auto method = buildMethod(asset, shape, options);
        ASSERT_TRUE(method) << method.error().line();
        const auto marcher = method->marcher();
        ASSERT_TRUE(marcher) << marcher.error().line();
        const auto marched = renderer_->march(*method, rays, 0);
        ASSERT_TRUE(marched) << marched.error().line();
        ASSERT_EQ(marched->results.size(), rays.size());
        size_t states = 0, places = 0, counts = 0, hits = 0, normals = 0;
        double fetches = 0, expectedFetches = 0;
        for (size_t i = 0; i < rays.size(); ++i) {
            const MarchResult expected = (*marcher)->march(rays[i]), &found = marched->results[i];
            states += expected.state != found.state;
            const auto apart = [](uint32_t a, uint32_t b) { return std::abs(double(a) - double(b)) > 2; };
            counts += apart(expected.fetches, found.fetches) || apart(expected.iterations, found.iterations) || apart(expected.surfaceTests, found.surfaceTests);
            fetches += found.fetches, expectedFetches += expected.fetches;
            if (expected.state != MarchState::Hit || found.state != MarchState::Hit) continue;
            ++hits;
            places += std::abs(found.t - expected.t) > 1e-4;
            normals += glm::dot(found.normal, expected.normal) < 0.999f * glm::dot(expected.normal, expected.normal);
        }
        const auto few = rays.size() / 50;
        EXPECT_GT(hits, rays.size() / 3);
        EXPECT_LE(states, rays.size() / 200);
        EXPECT_LE(places, few);
        EXPECT_LE(normals, few);
        // The maze is flat above and below: what a pyramid may skip there hangs on the last bit.
        EXPECT_LE(counts, rays.size() / 20);
        EXPECT_NEAR(fetches, expectedFetches, 0.01 * expectedFetches);
    }

    static std::vector<MarchRay> raysInto(glm::dvec3 extent) {
        std::mt19937 random(3);
        std::vector<MarchRay> rays;
        for (int i = 0; i < 700; ++i) rays.push_back(test::rayFromTop(random, extent));
        for (int i = 0; i < 300; ++i) rays.push_back(test::rayAnywhere(random, extent));
        return rays;
    }

    std::unique_ptr<MesoRenderer> renderer_;
};

TEST_F(MesoMarch, HeightFieldsAsTheReference) {
    for (const char* name : {"fbm", "maze"}) {
        Asset asset;
        asset.name = name;
        asset.heights = *makeHeightField(name, 32, 3);
        const auto shape = test::heights(*asset.heights);
        const auto rays = raysInto(shape->extent());
        for (const auto method : methodNames()) expectSame(asset, *shape, {.name = std::string(method), .cells = 16, .steps = 16}, rays);
    }
}

TEST_F(MesoMarch, SolidsAsTheReference) {
    Asset asset;
    asset.name = asset.solid = "beads";
    const auto shape = test::solid("beads");
    asset.extent = shape->extent();
    const auto rays = raysInto(shape->extent());
    for (const auto method : methodNames())
        if (methodFits(method, asset)) expectSame(asset, *shape, {.name = std::string(method), .cells = 16}, rays);
    // Other cones, and odd grids.
    for (const Cones cones : {Cones{2, 1}, Cones{8, 1}, Cones{4, 2}, Cones{3, 3}}) expectSame(asset, *shape, {.name = "ddm", .cells = 13, .cones = cones}, rays);
}

TEST_F(MesoMarch, CapsAreUnresolved) {
    Asset asset;
    asset.heights = *makeHeightField("needle", 16, 1);
    const auto shape = test::heights(*asset.heights);
    const std::vector<MarchRay> along = {{{0.01, 0.03, 0.5 * shape->extent().z}, {1, 0, 0}}};
    const auto method = buildMethod(asset, *shape, {.name = "cells", .cells = 16});
    ASSERT_TRUE(method);
    const auto marched = renderer_->march(*method, along, 0);
    ASSERT_TRUE(marched) << marched.error().line();
    EXPECT_EQ(marched->results[0].state, MarchState::Unresolved);
    EXPECT_EQ((*method->marcher())->march(along[0]).state, MarchState::Unresolved);
}

}  // namespace
}  // namespace vcp
