// The marchers against the double-precision truths.
#include "mesostructure/march.h"

#include <random>

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "tests/support/meso_rays.h"

namespace vcp::meso {
namespace {

struct Judged {
    int hits = 0, missed = 0, falseHits = 0, unresolved = 0, far = 0;
    double worst = 0;
    uint64_t fetches = 0;
};

/// `far`: hits off by more than `tolerance`, tile units.
template <class Truth>
Judged judge(const Marcher& marcher, glm::dvec3 extent, const Truth& truth, double tolerance, int rays,
             double lowest = 5) {
    std::mt19937 random(17);
    Judged judged;
    for (int i = 0; i < rays; ++i) {
        const MarchRay ray = test::rayFromTop(random, extent, lowest);
        const MarchResult found = marcher.march(ray);
        const TruthHit expected = truth(ray);
        judged.fetches += found.fetches;
        judged.unresolved += found.state == MarchState::Unresolved;
        judged.missed += expected.hit && found.state == MarchState::Miss;
        judged.falseHits += !expected.hit && found.state == MarchState::Hit;
        if (!expected.hit || found.state != MarchState::Hit) continue;
        ++judged.hits;
        const double error = std::abs(found.t - expected.t);
        judged.worst = std::max(judged.worst, error);
        judged.far += error > tolerance;
    }
    return judged;
}

TEST(March, ExactCellsOfHeightFieldsMissNothing) {
    for (const auto name : heightFieldNames()) {
        const HeightMap map = *makeHeightField(name, 64, 3);
        const auto shape = test::heights(map);
        const auto truth = [&](const MarchRay& ray) { return shape->trace(ray.origin, ray.direction, ray.tMax); };
        const Occupancy occupancy = test::occupied(*shape, {32, 32, 8});
        const OctantBoxes boxes = buildOctantBoxes(occupancy);
        const DistanceMap distances = test::distances(occupancy, {.cones = {4, 1}});
        uint64_t all = 0, skipped = 0;
        for (const Skipping& skipping :
             {Skipping{.occupancy = &occupancy}, Skipping{.distances = &distances}, Skipping{.boxes = &boxes}}) {
            const Judged judged =
                judge(*test::walk(skipping, {.heights = &map}), shape->extent(), truth, 2e-3, 1500, 2);
            EXPECT_EQ(judged.missed + judged.falseHits + judged.unresolved, 0) << name;
            EXPECT_GT(judged.hits, 1400) << name;
            (skipping.occupancy ? all : skipped) = judged.fetches;
        }
        EXPECT_LT(skipped, all) << name;
        const Judged judged = judge(*pyramidMarcher(map), shape->extent(), truth, 2e-3, 1500, 2);
        EXPECT_EQ(judged.missed + judged.falseHits + judged.unresolved, 0) << name;
    }
}

TEST(March, SampledFieldsMissNothingOfThemselves) {
    for (const auto name : solidNames()) {
        const auto shape = test::solid(std::string(name));
        const glm::ivec3 cells(16, 16, int(16 * shape->extent().z));
        const SampledField field = *sampleField(*shape, cells * 2);
        Occupancy occupancy = test::occupied(*shape, cells);
        occupyField(field, occupancy);
        const auto truth = [&](const MarchRay& ray) { return traceField(field, ray); };
        const OctantBoxes boxes = buildOctantBoxes(occupancy);
        OctantBoxes marked = boxes;
        markSmallCells(field, marked);
        const DistanceMap distances = test::distances(occupancy, {.cones = {8, 1}, .cap = 0.2});
        const CompressedMap compressed = *compressMap(distances, std::vector{4});
        uint64_t unmarked = 0, fewest = 0;
        for (const Skipping& skipping : {Skipping{.occupancy = &occupancy}, Skipping{.compressed = &compressed},
                                         Skipping{.boxes = &boxes}, Skipping{.boxes = &marked}}) {
            const Judged judged = judge(*test::walk(skipping, {.field = &field}), shape->extent(), truth, 2e-3, 800);
            EXPECT_EQ(judged.missed, 0) << name;
            EXPECT_EQ(judged.falseHits + judged.unresolved, 0) << name;
            unmarked = fewest, fewest = judged.fetches;
        }
        EXPECT_LT(fewest, unmarked) << name;
    }
}

/// Trilinear distances would miss rays at the silhouettes of what is convex; samples that are right on average over a
/// cell do not.
TEST(March, SampledSolidsAreAsLargeAsTheirShapes) {
    const auto shape = test::solid("ball");
    const glm::ivec3 cells(32, 32, int(std::ceil(32 * shape->extent().z)));
    const SampledField field = *sampleField(*shape, cells);
    Occupancy occupancy = test::occupied(*shape, cells);
    occupyField(field, occupancy);
    const auto marcher = test::walk({.occupancy = &occupancy}, {.field = &field});
    double behind = 0;
    int hits = 0, missed = 0, falseHits = 0;
    std::mt19937 random(5);
    for (int i = 0; i < 60000; ++i) {
        const MarchRay ray = test::rayFromTop(random, shape->extent());
        const MarchResult found = marcher->march(ray);
        const TruthHit truth = shape->trace(ray.origin, ray.direction, ray.tMax);
        const bool isHit = found.state == MarchState::Hit;
        missed += truth.hit && !isHit, falseHits += isHit && !truth.hit;
        if (truth.hit && isHit) behind += found.t - truth.t, ++hits;
    }
    EXPECT_GT(hits, 1000);
    // In cells; it is 0.02 without the correction.
    EXPECT_LT(std::abs(behind / hits) * 32, 0.005);
    EXPECT_LE(missed, 2 * falseHits + 4);
}

/// Returns the angle between unit vectors, in degrees.
double degreesBetween(glm::dvec3 a, glm::dvec3 b) {
    return glm::degrees(2 * std::asin(std::min(0.5 * glm::distance(a, b), 1.0)));
}

/// A trilinear function's gradient jumps by 2 to 4 degrees from cell to cell: a ball has facets.
TEST(March, NormalsOfSampledSolidsDoNotJumpBetweenCells) {
    for (const std::string name : {"ball", "beads"}) {
        const auto shape = test::solid(name);
        const glm::ivec3 cells(64, 64, int(std::ceil(64 * shape->extent().z)));
        const SampledField field = *sampleField(*shape, cells);
        Occupancy occupancy = test::occupied(*shape, cells);
        occupyField(field, occupancy);
        const auto marcher = test::walk({.occupancy = &occupancy}, {.field = &field});
        std::mt19937 random(11);
        int pairs = 0, wrong = 0;
        double jump = 0;  // beyond that of the shape, degrees
        for (int i = 0; i < 60000; ++i) {
            MarchRay ray = test::rayFromTop(random, shape->extent(), 30);
            const MarchResult a = marcher->march(ray);
            const TruthHit trueA = shape->trace(ray.origin, ray.direction, ray.tMax);
            ray.origin.x += 0.02 / 64;
            const MarchResult b = marcher->march(ray);
            const TruthHit trueB = shape->trace(ray.origin, ray.direction, ray.tMax);
            if (a.state != MarchState::Hit || b.state != MarchState::Hit || !trueA.hit || !trueB.hit) continue;
            const double turn = degreesBetween(trueA.normal, trueB.normal);
            if (turn > 1) continue;
            ++pairs;
            wrong += degreesBetween(glm::dvec3(a.normal), trueA.normal) > 1;
            jump = std::max(jump, degreesBetween(glm::dvec3(a.normal), glm::dvec3(b.normal)) - turn);
        }
        EXPECT_GT(pairs, 500) << name;
        // Beads have an edge where they stand on the floor: normals are blended over it.
        EXPECT_LT(wrong, (name == "ball" ? 0.02 : 0.08) * pairs) << name;
        if (name == "ball") {
            EXPECT_LT(jump, 0.5);
        }
    }
}

TEST(March, PatchesFollowTheShape) {
    const auto shape = test::solid("beads");
    const Occupancy occupancy = test::occupied(*shape, {16, 16, 4});
    const DistanceMap distances = test::distances(occupancy, {.cones = {4, 1}});
    int far[2] = {}, wrong[2] = {};
    for (const CrossingRule rule : {CrossingRule::Direct, CrossingRule::Fitted}) {
        const PatchSet patches = *buildPatches(*shape, occupancy, rule);
        const auto marcher = test::walk({.distances = &distances}, {.patches = &patches});
        std::mt19937 random(17);
        for (int i = 0; i < 2000; ++i) {
            const MarchRay ray = test::rayFromTop(random, shape->extent(), 20);
            const MarchResult found = marcher->march(ray);
            const TruthHit truth = shape->trace(ray.origin, ray.direction, ray.tMax);
            wrong[size_t(rule)] += (found.state == MarchState::Hit) != truth.hit;
            far[size_t(rule)] += std::abs(found.t - truth.t) > 0.5 / 16;
        }
    }
    // The floor is closed, so nothing is missed; fits across two sheets are far off, crossings are not.
    EXPECT_EQ(wrong[0], 0);
    EXPECT_LT(far[0], 400);
    EXPECT_LT(2 * far[0], far[1]);
}

TEST(March, CompressionChangesNoHit) {
    const auto shape = test::solid("chain");
    const Occupancy occupancy = test::occupied(*shape, {32, 32, 8});
    const DistanceMap distances = test::distances(occupancy, {.cones = {4, 2}});
    const PatchSet patches = *buildPatches(*shape, occupancy, CrossingRule::Direct);
    const auto plain = test::walk({.distances = &distances}, {.patches = &patches});
    for (const std::vector<int>& factors : {std::vector<int>{2}, {4}, {4, 2}, {2, 2, 2}}) {
        const CompressedMap compressed = *compressMap(distances, factors);
        const auto packed = test::walk({.compressed = &compressed}, {.patches = &patches});
        std::mt19937 random(1);
        int hits = 0;
        uint64_t plainSteps = 0, packedSteps = 0, plainFetches = 0, packedFetches = 0;
        for (int i = 0; i < 3000; ++i) {
            const MarchRay ray = test::rayFromTop(random, shape->extent());
            const MarchResult a = plain->march(ray), b = packed->march(ray);
            plainSteps += a.iterations, packedSteps += b.iterations;
            plainFetches += a.fetches, packedFetches += b.fetches;
            ASSERT_EQ(a.state, b.state) << i;
            ASSERT_EQ(a.t, b.t) << i;
            ASSERT_EQ(a.normal, b.normal) << i;
            hits += a.state == MarchState::Hit;
        }
        EXPECT_GT(hits, 500);
        // Blocks without surface are left whole, and the way to a brick is read once, so compression costs little.
        EXPECT_LT(double(packedSteps), 1.15 * double(plainSteps));
        EXPECT_LT(double(packedFetches), (1.05 + 0.2 * double(factors.size())) * double(plainFetches));
    }
}

TEST(March, AwkwardRays) {
    const HeightMap map = *makeHeightField("blocks", 32, 1);
    const auto shape = test::heights(map);
    const Occupancy occupancy = test::occupied(*shape, {16, 16, 4});
    const OctantBoxes boxes = buildOctantBoxes(occupancy);
    const DistanceMap distances = test::distances(occupancy, {.cones = {4, 2}});
    const double top = map.range;
    const double grazing = std::sqrt(1 - 1e-12);
    const MarchRay rays[] = {
        {{0.5, 0.5, top}, {0, 0, -1}},         // AxisAlignedOnGridPlanes
        {{0.5, 0.25, top}, {-1, 0, 0}},        // along the top
        {{0.0, 0.0, top * 0.999}, {1, 0, 0}},  // Horizontal
        {{0.5, 0.5, top}, {std::sqrt(0.5), 0, -std::sqrt(0.5)}},
        {{1e5 + 0.3, -1e5 + 0.7, top}, {0, -std::sqrt(0.5), -std::sqrt(0.5)}},  // OriginFarAway
        {{0.1, 0.1, top}, {grazing, 0, -1e-6}},                                 // GrazingRays
        {{0.3, 0.3, top}, {0, 0, 1}},                                           // away
        {{0.9, 0.9, 0.0}, {0, 0, -1}},                                          // below
    };
    for (const Skipping& skipping :
         {Skipping{.occupancy = &occupancy}, Skipping{.distances = &distances}, Skipping{.boxes = &boxes}}) {
        const auto marcher = test::walk(skipping, {.heights = &map});
        for (size_t i = 0; i < std::size(rays); ++i) {
            MarchRay ray = rays[i];
            ray.tMax = 20;
            const MarchResult found = marcher->march(ray);
            const TruthHit expected = shape->trace(ray.origin, ray.direction, ray.tMax);
            EXPECT_EQ(found.state == MarchState::Hit, expected.hit) << "ray " << i;
            EXPECT_NE(found.state, MarchState::Unresolved) << "ray " << i;
            EXPECT_NEAR(found.t, expected.t, 1e-3) << "ray " << i;
        }
    }
}

/// 7 edges of cells add up to less than the slab here: what lies at the top must not be lost to that.
TEST(March, RaysFromTheTopHitWhatTouchesIt) {
    HeightMap map{.size = {14, 14}, .range = 0.03, .texels = std::vector<uint16_t>(196, 65535)};
    const auto shape = test::heights(map);
    const Occupancy occupancy = test::occupied(*shape, {7, 7, 7});
    ASSERT_LT(map.range / occupancy.grid.cell.z, 7);
    const OctantBoxes boxes = buildOctantBoxes(occupancy);
    const DistanceMap distances = test::distances(occupancy, {.cones = {4, 1}});
    for (const Skipping& skipping :
         {Skipping{.occupancy = &occupancy}, Skipping{.distances = &distances}, Skipping{.boxes = &boxes}})
        for (const Surface& surface : {Surface{}, Surface{.heights = &map}})
            for (const glm::dvec3 direction : {glm::dvec3(0, 0, -1), glm::dvec3(0.6, 0, -0.8)}) {
                const MarchRay ray{{0.51, 0.52, map.range}, direction};
                ASSERT_TRUE(shape->trace(ray.origin, ray.direction, 1).hit);
                const MarchResult found = test::walk(skipping, surface)->march(ray);
                EXPECT_EQ(found.state, MarchState::Hit);
                EXPECT_NEAR(found.t, 0, 1e-6);
            }
}

TEST(March, CapsAreUnresolved) {
    const HeightMap map = *makeHeightField("needle", 16, 1);
    const auto shape = test::heights(map);
    const auto few = sphereMarcher(*buildSphereMap(*shape, {.cells = {16, 16, 4}, .steps = 2}));
    EXPECT_EQ(few->march({{0.1, 0.1, map.range}, glm::normalize(glm::dvec3(1, 0.1, -0.05))}).state,
              MarchState::Unresolved);
    // Between the needles for ever: more cells than iterations.
    const Occupancy occupancy = test::occupied(*shape, {16, 16, 4});
    const auto cells = test::walk({.occupancy = &occupancy}, {.heights = &map});
    EXPECT_EQ(cells->march({{0.01, 0.03, map.range * 0.5}, {1, 0, 0}}).state, MarchState::Unresolved);
}

TEST(March, ReliefRefinementsFindTheBracketsRoot) {
    const HeightMap map = *makeHeightField("hemispheres", 128, 1);
    const auto shape = test::heights(map);
    double mean[5] = {};
    for (const Refinement refinement : {Refinement::None, Refinement::Binary, Refinement::Secant,
                                        Refinement::SecantAsPrinted, Refinement::Illinois}) {
        const auto marcher =
            reliefMarcher(map, {.steps = 64,
                                .refinement = refinement,
                                .refinements = 20,
                                .tolerance = refinement == Refinement::SecantAsPrinted ? 0.01f : 1e-5f});
        std::mt19937 random(4);
        int counted = 0;
        for (int i = 0; i < 1000; ++i) {
            const MarchRay ray = test::rayFromTop(random, shape->extent(), 30);
            const TruthHit truth = shape->trace(ray.origin, ray.direction, 100);
            const MarchResult found = marcher->march(ray);
            ASSERT_EQ(found.state, MarchState::Hit);
            // Where the first bracket is the right one.
            if (std::abs(found.t - truth.t) > map.range / 64 / -ray.direction.z) continue;
            mean[size_t(refinement)] += std::abs(found.t - truth.t) * 128;
            ++counted;
        }
        EXPECT_GT(counted, 800);
        mean[size_t(refinement)] /= counted;
    }
    EXPECT_LT(mean[size_t(Refinement::Binary)], 0.01);
    EXPECT_LT(mean[size_t(Refinement::Secant)], 0.01);
    EXPECT_LT(mean[size_t(Refinement::Illinois)], 0.01);
    EXPECT_GT(mean[size_t(Refinement::None)], 0.05);
    EXPECT_GT(mean[size_t(Refinement::SecantAsPrinted)], mean[size_t(Refinement::Secant)]);
}

TEST(March, TheToleranceEndsTheRefinementEarly) {
    const HeightMap map = *makeHeightField("fbm", 128, 1);
    const auto shape = test::heights(map);
    double error[3] = {};
    uint64_t fetches[3] = {};
    constexpr float kTolerances[3] = {0.01f, 0.001f, 0};
    for (int k = 0; k < 3; ++k) {
        const auto marcher =
            reliefMarcher(map, {.steps = 64, .refinement = Refinement::Binary, .tolerance = kTolerances[k]});
        std::mt19937 random(4);
        for (int i = 0; i < 1000; ++i) {
            const MarchRay ray = test::rayFromTop(random, shape->extent(), 45);
            const TruthHit truth = shape->trace(ray.origin, ray.direction, 100);
            const MarchResult found = marcher->march(ray);
            fetches[k] += found.fetches;
            error[k] += std::min(std::abs(found.t - truth.t) * 128, 1.0);
        }
    }
    EXPECT_LT(error[1], 0.6 * error[0]);
    EXPECT_LT(error[2], error[1]);
    EXPECT_GT(fetches[1], fetches[0]);
    EXPECT_GT(fetches[2], fetches[1]);
}

TEST(March, RefusesWhatDoesNotFit) {
    const HeightMap map = *makeHeightField("fbm", 30, 1);
    const auto shape = test::heights(map);
    const Occupancy occupancy = test::occupied(*shape, {16, 16, 4});
    EXPECT_EQ(gridMarcher({.occupancy = &occupancy}, {.heights = &map}).error().code, ErrorCode::Usage);
    EXPECT_EQ(gridMarcher({}, {.heights = &map}).error().code, ErrorCode::Usage);
}

}  // namespace
}  // namespace vcp::meso
