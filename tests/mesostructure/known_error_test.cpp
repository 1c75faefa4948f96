// What is known of the error of methods, against the double-precision truths.
#include "mesostructure/known_error.h"

#include <set>

#include "tests/support/meso_surfaces.h"

namespace vcp::meso {
namespace {

/// Single precision in tiles as large as one unit, seen from their slab's top.
constexpr double kRounding = 3e-6;

struct Found {
    int hits = 0;
    double worst = 0;  ///< distance from the surface, tile units
};

/// `distance`: of a point from the surface.
template <class Distance>
Found hitsOf(const Method& method, glm::dvec3 extent, const Distance& distance) {
    const auto marcher = method.marcher();
    EXPECT_TRUE(marcher);
    std::mt19937 random(23);
    Found found;
    for (int i = 0; i < 1500; ++i) {
        const MarchRay ray = test::rayFromTop(random, extent);
        const MarchResult result = (*marcher)->march(ray);
        if (result.state != MarchState::Hit) continue;
        ++found.hits;
        found.worst = std::max(found.worst, distance(ray.origin + result.t * ray.direction));
    }
    return found;
}

/// Bilinear between the texels.
double heightAt(const HeightMap& map, double x, double y) {
    const glm::dvec2 at = glm::dvec2(x / map.extent().x, y / map.extent().y) * glm::dvec2(map.size),
                     low = glm::floor(at), part = at - low;
    const auto texel = [&](int i, int j) { return map.height(int(low.x) + i, int(low.y) + j); };
    return (1 - part.y) * ((1 - part.x) * texel(0, 0) + part.x * texel(1, 0)) +
           part.y * ((1 - part.x) * texel(0, 1) + part.x * texel(1, 1));
}

TEST(KnownError, TheAssetsOwnHeightsAreHitExactly) {
    const Asset asset = vcp::test::heightAsset("fbm", *makeHeightField("fbm", 64, 3));
    const auto shape = shapeOf(asset);
    std::set<std::string_view> exact;
    for (const std::string_view name : methodNames()) {
        SCOPED_TRACE(name);
        const auto method = buildMethod(asset, **shape, {.name = std::string(name), .cells = 16});
        ASSERT_TRUE(method) << method.error().line();
        if (knownError(*method->arrays()) != 0.0) continue;
        exact.insert(name);
        const Found found = hitsOf(*method, asset.extent, [&](glm::dvec3 at) {
            return std::abs(at.z - heightAt(*asset.heights, at.x, at.y));
        });
        EXPECT_GT(found.hits, 1000);
        EXPECT_LE(found.worst, kRounding);
    }
    EXPECT_EQ(exact, (std::set<std::string_view>{"pyramid", "boxes", "cells", "ddm-cells", "gdm-safe"}));
}

TEST(KnownError, HitsInCellsOfSolidsAreNoFartherThanAcrossACell) {
    const Asset asset = vcp::test::solidAsset("beads");
    const auto shape = shapeOf(asset);
    int bounded = 0;
    for (const std::string_view name : methodNames()) {
        SCOPED_TRACE(name);
        if (!methodFits(name, asset)) continue;
        const auto method = buildMethod(asset, **shape, {.name = std::string(name), .cells = 16});
        ASSERT_TRUE(method) << method.error().line();
        const auto known = knownError(*method->arrays());
        if (!known) continue;
        ++bounded;
        EXPECT_NEAR(*known, std::sqrt(3.0) / 16, 1e-6);
        const Found found = hitsOf(*method, asset.extent, [&](glm::dvec3 at) { return (*shape)->distance(at, 1); });
        EXPECT_GT(found.hits, 500);
        EXPECT_LE(found.worst, *known);
        if (name == "ddm") {
            EXPECT_GT(found.worst, *known / 4) << "a wall of a cell is hit";
        }
    }
    EXPECT_GT(bounded, 3);
}

TEST(KnownError, NothingIsKnownOfSteppingAndOfTables) {
    const Asset asset = vcp::test::heightAsset("fbm", *makeHeightField("fbm", 32, 3));
    const auto shape = shapeOf(asset);
    for (const char* name : {"relief-binary", "relief-linear", "sphere", "slices", "gdm", "vdm"}) {
        const auto method = buildMethod(asset, **shape, {.name = name, .cells = 8});
        ASSERT_TRUE(method) << method.error().line();
        EXPECT_FALSE(knownError(*method->arrays())) << name;
    }
}

}  // namespace
}  // namespace vcp::meso
