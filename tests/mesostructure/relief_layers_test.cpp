// Layers of solids against the field, and what relief mapping makes of them.
#include "mesostructure/relief_layers.h"

#include <algorithm>
#include <random>

#include "mesostructure/method.h"
#include "tests/support/meso_rays.h"

namespace vcp::meso {
namespace {

/// Whether a texel's bounds say that a height is within the solid.
bool isInside(const ReliefLayers& layers, int texel, double height) {
    int above = 0;
    for (int k = 0; k < layers.layers; ++k)
        above += layers.bounds[size_t(texel * layers.layers + k)] > 65535 * height / layers.extent.z;
    return above % 2 == 1;
}

TEST(ReliefLayers, TellTheSolidFromWhatIsAroundIt) {
    for (const char* name : {"beads", "chain", "weave", "kitten"}) {
        const auto shape = test::solid(name);
        const auto layers = traceLayers(*shape, {24, 24}, 16);
        ASSERT_TRUE(layers) << layers.error().line();
        EXPECT_EQ(layers->cutColumns, 0u) << name;
        std::mt19937 random(2);
        std::uniform_real_distribution<double> unit(0, 1);
        int wrong = 0, inside = 0;
        for (int i = 0; i < 4000; ++i) {
            const int texel = int(random() % (24 * 24));
            const glm::dvec3 p(texel % 24 / 24.0, texel / 24 / 24.0, unit(random) * shape->extent().z);
            const bool truth = shape->field(p) <= 0;
            inside += truth;
            // A bound is rounded to 1/65535 of the slab.
            wrong += truth != isInside(*layers, texel, p.z) && std::abs(shape->field(p)) > 1e-5;
        }
        EXPECT_EQ(wrong, 0) << name;
        EXPECT_GT(inside, 100) << name;
    }
}

TEST(ReliefLayers, TheUpperOnesAreKept) {
    const auto shape = test::solid("weave");
    const ReliefLayers two = *traceLayers(*shape, {32, 32}, 2), four = *traceLayers(*shape, {32, 32}, 4);
    EXPECT_GT(two.cutColumns, 0u);
    EXPECT_LE(four.cutColumns, two.cutColumns);
    for (size_t i = 0; i < two.bounds.size(); ++i) EXPECT_EQ(two.bounds[i], four.bounds[i / 2 * 4 + i % 2]) << i;
    for (const int layers : {-2, 0, 1, 3, 18})
        EXPECT_EQ(traceLayers(*shape, {8, 8}, layers).error().code, ErrorCode::Usage);
    EXPECT_EQ(traceLayers(*shape, {0, 8}, 4).error().code, ErrorCode::Usage);
    EXPECT_EQ(traceLayers(*shape, {8, 1 << 20}, 4).error().code, ErrorCode::Usage);
}

/// The part of rays that miss what they should hit.
double missedBy(const Asset& asset, const Shape& shape, int layers, int steps) {
    const auto method =
        buildMethod(asset, shape, {.name = "relief-layers", .cells = 128, .steps = steps, .layers = layers});
    EXPECT_TRUE(method) << method.error().line();
    const auto marcher = *method->marcher();
    std::mt19937 random(5);
    int missed = 0, hit = 0;
    for (int i = 0; i < 3000; ++i) {
        const MarchRay ray = test::rayFromTop(random, shape.extent(), 5, 60);
        if (!shape.trace(ray.origin, ray.direction, ray.tMax).hit) continue;
        ++hit;
        missed += marcher->march(ray).state != MarchState::Hit;
    }
    EXPECT_GT(hit, 100) << asset.name;
    return double(missed) / hit;
}

TEST(ReliefLayers, RaysMeetWhatLiesUnderAnOverhang) {
    const auto assetOf = [](const char* name) {
        Asset asset;
        asset.name = asset.solid = name;
        asset.extent = test::solid(name)->extent();
        return asset;
    };
    const auto kitten = test::solid("kitten"), chain = test::solid("chain");
    EXPECT_LT(missedBy(assetOf("kitten"), *kitten, 4, 32), 0.002);
    EXPECT_GT(missedBy(assetOf("kitten"), *kitten, 2, 32), 0.03) << "the ground under the body is not there";
    EXPECT_LT(3 * missedBy(assetOf("chain"), *chain, 8, 128), missedBy(assetOf("chain"), *chain, 8, 16))
        << "few steps pass rings";
}

/// What leaves by the slab's bottom, where the missing bounds lie, is no hit.
TEST(ReliefLayers, RaysComeThroughWhereNothingIs) {
    Asset asset;
    asset.name = asset.solid = "ball";
    const auto shape = test::solid("ball");
    asset.extent = shape->extent();
    const auto method = buildMethod(asset, *shape, {.name = "relief-layers", .cells = 64});
    ASSERT_TRUE(method) << method.error().line();
    const auto marcher = *method->marcher();
    std::mt19937 random(5);
    int wrong = 0;
    for (int i = 0; i < 1000; ++i) {
        const MarchRay ray = test::rayFromTop(random, shape->extent());
        const bool isHit = marcher->march(ray).state == MarchState::Hit;
        wrong += isHit != shape->trace(ray.origin, ray.direction, ray.tMax).hit;
    }
    EXPECT_LT(wrong, 50);
}

TEST(ReliefLayers, OfAHeightFieldAreItsHeights) {
    Asset asset;
    asset.name = "fbm", asset.heights = *makeHeightField("fbm", 64, 2);
    const auto shape = test::heights(*asset.heights);
    asset.extent = shape->extent();
    const auto layered = *buildMethod(asset, *shape, {.name = "relief-layers", .cells = 64, .steps = 64})->marcher(),
               relief = *buildMethod(asset, *shape, {.name = "relief-binary", .steps = 64})->marcher();
    std::mt19937 random(9);
    int hits = 0;
    for (int i = 0; i < 1000; ++i) {
        const MarchRay ray = test::rayFromTop(random, shape->extent(), 20);
        const MarchResult a = layered->march(ray), b = relief->march(ray);
        if (a.state != MarchState::Hit || b.state != MarchState::Hit) continue;
        ++hits;
        // The slab's bottom is a bound as well, which may be the nearer one and end the refinement.
        EXPECT_NEAR(a.t, b.t, 0.05) << i;
    }
    EXPECT_GT(hits, 950);
}

TEST(ReliefLayers, GroundOnTheSlabsBottomIsMet) {
    Asset asset;
    asset.name = "needle", asset.heights = *makeHeightField("needle", 16, 1);
    const auto shape = test::heights(*asset.heights);
    asset.extent = shape->extent();
    const auto marcher = *buildMethod(asset, *shape, {.name = "relief-layers", .cells = 16})->marcher();
    std::mt19937 random(9);
    for (int i = 0; i < 200; ++i)
        EXPECT_EQ(marcher->march(test::rayFromTop(random, shape->extent(), 20)).state, MarchState::Hit) << i;
}

}  // namespace
}  // namespace vcp::meso
