// View-dependent maps over bases that bend, against straight rays in the world over arcs.
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "mesostructure/gdm/bent_ray.h"
#include "mesostructure/method.h"
#include "tests/support/meso_rays.h"

namespace vcp::meso {
namespace {

using glm::dvec2, glm::dvec3;

/// A ray over an arc of the base, in the plane of both, in tile units: the arc's middle is `radius` below the start's
/// foot; a negative radius is above it.
struct WorldRay {
    double radius, height;
    dvec2 direction;  ///< not unit: as fast as the tile's ray is at its start

    WorldRay(double c, double z, double run, double rise)
        : radius(1 / c), height(z), direction((1 + c * z) * run, rise) {}
    /// Returns the place along the arc and above it.
    [[nodiscard]] dvec2 at(double t) const {
        const dvec2 p = dvec2(0, radius + height) + t * direction;
        const double side = radius > 0 ? 1 : -1;
        return {radius * std::atan2(side * p.x, side * p.y), side * glm::length(p) - radius};
    }
};

TEST(BentPath, IsAStraightRayOverAnArc) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(0, 1);
    double farthest = 0;
    for (int i = 0; i < 20000; ++i) {
        const double c = 3 * (2 * unit(random) - 1), z = 0.16 * unit(random), angle = M_PI * unit(random),
                     t = 0.8 * unit(random) - 0.2;
        const WorldRay world(c, z, std::sin(angle), std::cos(angle));
        const bent::BentPath path{c, z, std::sin(angle), std::cos(angle)};
        const dvec2 expected = world.at(t), found(bent::bentAlong(path, t), bent::bentHeight(path, t));
        ASSERT_LT(glm::distance(expected, found), 1e-6) << i << ": c " << c << ", z " << z << ", t " << t;
        farthest = std::max(farthest, std::abs(expected.x));
        const double h = 1e-5;
        const dvec2 slope = (world.at(t + h) - world.at(t - h)) / (2 * h), heading = bent::bentHeading(path, t);
        ASSERT_LT(glm::distance(slope, heading), 1e-4 * (1 + glm::length(slope))) << i;
        double reached = 0;
        if (bent::bentReaches(path, found.y, reached)) {
            ASSERT_NEAR(world.at(reached).y, found.y, 1e-9) << i;
            ASSERT_LE(std::abs(reached), std::abs(t) + 1e-6) << i << ": the nearest of two times";
        }
        // The bend of a ray along the slab.
        const WorldRay level(c, z, 1, 0);
        const double d = 1e-4;
        const dvec2 before = level.at(-d), after = level.at(d);
        const double bend = ((after.y - z) / after.x - (z - before.y) / -before.x) / after.x;
        ASSERT_NEAR(bent::curvatureOfBend(bend, z), c, 1e-3 * (1 + std::abs(c))) << i;
    }
    EXPECT_GT(farthest, 0.5);
    // Without curvature it is the straight ray, to the bit.
    const bent::BentPath flat{0, 0.25, 0.6, -0.8};
    EXPECT_EQ(bent::bentHeight(flat, 0.25), 0.25 - 0.8 * 0.25);
    EXPECT_EQ(bent::bentAlong(flat, 0.25), 0.6 * 0.25);
}

/// Smooth hills, twice as wide along x as along y, which interpolation follows well.
Asset hills() {
    Asset asset;
    asset.name = "hills";
    std::vector<uint16_t> heights;
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x)
            heights.push_back(uint16_t(
                std::lround(32767 * (1 + 0.5 * std::cos(2 * M_PI * x / 64) + 0.45 * std::cos(4 * M_PI * y / 64)))));
    asset.heights = HeightMap{{64, 64}, 0.25, std::move(heights)};
    asset.extent = asset.heights->extent();
    return asset;
}

struct BentTruth {
    bool hit = false;
    double t = 0;
};

/// Follows the straight ray over the arc by small steps of the field.
BentTruth traceOverArc(const Shape& shape, double c, dvec3 from, dvec3 direction) {
    const double run = std::hypot(direction.x, direction.y), top = shape.extent().z;
    const WorldRay world(c, from.z, run, direction.z);
    const auto place = [&](double t) {
        const dvec2 at = world.at(t);
        return dvec3(from.x + at.x * direction.x / run, from.y + at.x * direction.y / run, at.y);
    };
    constexpr double kStep = 1.0 / 2048;
    for (double t = kStep;; t += kStep) {
        const dvec3 p = place(t);
        if (p.z > top) return {};
        if (p.z > 0 && shape.field(p) > 0) continue;
        double low = t - kStep, high = t;
        for (int i = 0; i < 40; ++i) {
            const double middle = 0.5 * (low + high);
            const dvec3 q = place(middle);
            (q.z <= 0 || shape.field(q) <= 0 ? high : low) = middle;
        }
        return {true, high};
    }
}

TEST(BentTable, SaysWhatARayOverAnArcMeets) {
    const Asset asset = hills();
    const auto shape = *shapeOf(asset);
    const GdmOptions options{.points = {5, 6, 4}, .directions = {7, 8}, .ofTop = true, .curvatures = {5, 0.5}};
    const auto table = traceTable(asset, *shape, options);
    ASSERT_TRUE(table) << table.error().line();
    EXPECT_EQ(table->columns(), 5u * 7u * 8u);
    int misses = 0, wrong = 0;
    for (const int layer : {0, 1, 3, 4})
        for (int y = 0; y < 6; ++y)
            for (int x = 0; x < 5; ++x)
                for (int theta = 0; theta < 7; ++theta)
                    for (int phi = 0; phi < 8; ++phi) {
                        const size_t row = table->row(x, y, phi), column = table->column(theta, phi, layer);
                        const BentTruth truth =
                            traceOverArc(*shape, table->curvatures.at(layer) / asset.extent.z, table->point(x, y, 0),
                                         table->directions.direction(theta, phi));
                        misses += !truth.hit;
                        if (table->isHit(row, column) != truth.hit)
                            ++wrong;
                        else if (truth.hit)
                            wrong += std::abs(double(table->distance(row, column)) - truth.t) > 1.0 / 128;
                    }
    EXPECT_GT(misses, 50) << "rays leave by the top where the base bends away";
    EXPECT_LE(wrong, 4 * 5 * 6 * 7 * 8 / 100) << "rays that graze a hill, and chords";
    // Over a flat base it is the table without curvatures.
    GdmOptions flat = options;
    flat.curvatures = {};
    const auto straight = *traceTable(asset, *shape, flat);
    for (size_t row = 0; row < straight.rows(); ++row)
        for (size_t column = 0; column < straight.columns(); ++column) {
            const size_t middle = 2 * straight.columns() + column;
            ASSERT_NEAR(straight.distance(row, column), table->distance(row, middle), 2 * table->unit);
            ASSERT_EQ(straight.isHit(row, column), table->isHit(row, middle));
        }
}

TEST(BentTable, NeedsMemoryAndSaneCurvatures) {
    const Asset asset = hills();
    const auto shape = *shapeOf(asset);
    const auto codeOf = [&](Curvatures curvatures, bool ofTop = true) {
        return traceTable(asset, *shape,
                          {.points = {4, 4, 4}, .directions = {2, 4}, .ofTop = ofTop, .curvatures = curvatures})
            .error()
            .code;
    };
    for (const int samples : {-1, 0, 2, 4, 19, 1000001}) EXPECT_EQ(codeOf({samples, 0.5}), ErrorCode::Usage) << samples;
    for (const double most : {0.0, -0.5, 0.51, 1e300, std::numeric_limits<double>::quiet_NaN()})
        EXPECT_EQ(codeOf({3, most}), ErrorCode::Usage) << most;
    EXPECT_EQ(codeOf({3, 0.5}, false), ErrorCode::Usage) << "a map of a volume has none";
    const auto large =
        traceTable(asset, *shape,
                   {.points = {64, 64, 4}, .ofTop = true, .curvatures = {17, 0.5}, .memoryBytes = uint64_t{32} << 20});
    ASSERT_FALSE(large);
    EXPECT_EQ(large.error().code, ErrorCode::Limit);
    EXPECT_NE(large.error().line().find("17 curvatures"), std::string::npos) << large.error().line();
}

/// A ray that enters the slab over an arc: its bend is that at the top (mesostructure/gdm/bent_path.h).
MarchRay rayOverArc(std::mt19937& random, dvec3 extent, double c, double low, double high) {
    MarchRay ray = test::rayFromTop(random, extent, low, high);
    ray.bend = c * (1 + c * ray.origin.z);
    return ray;
}

/// Returns how many of 1500 rays a map judges wrongly: hits of rays that miss, the converse, and hits that are off by
/// more than a point's distance.
int wrongOf(const Marcher& marcher, const Shape& shape, double c, double low, double high) {
    std::mt19937 random(17);
    int wrong = 0;
    for (int i = 0; i < 1500; ++i) {
        const MarchRay ray = rayOverArc(random, shape.extent(), c, low, high);
        const BentTruth truth = traceOverArc(shape, c, ray.origin, ray.direction);
        const MarchResult found = marcher.march(ray);
        const bool isHit = found.state == MarchState::Hit;
        wrong += isHit != truth.hit || (isHit && std::abs(found.t - truth.t) > 1.0 / 24);
    }
    return wrong;
}

std::unique_ptr<Marcher> marcherOf(const Asset& asset, const Shape& shape, Curvatures curvatures, int rank = 0) {
    auto method = buildMethod(
        asset, shape,
        {.name = "vdm", .cells = 24, .rank = rank, .directions = {24, 16}, .curvatures = curvatures, .layers = 33});
    EXPECT_TRUE(method) << method.error().line();
    return *method->marcher();
}

TEST(BentMarch, CurvatureMakesHitsOverArcsRight) {
    const Asset asset = hills();
    const auto shape = *shapeOf(asset);
    const auto flat = marcherOf(asset, *shape, {}), bent = marcherOf(asset, *shape, {5, 0.5}),
               factored = marcherOf(asset, *shape, {5, 0.5}, 32);
    // Five times the distances of two bytes, and a bit for each.
    EXPECT_EQ(bent->bytes() - flat->bytes(), 24u * 24 * 24 * 16 * 4 * 2 + 24u * 24 * 24 * 16 * 5 / 8);
    // A sample of curvature, one between two, and a base that bends inwards.
    for (const double overRadius : {0.25, 0.375, -0.3})
        for (const auto& [low, high] : {std::pair(5.0, 35.0), {25.0, 60.0}}) {
            SCOPED_TRACE(fmt::format("{} slab heights over the radius, {} to {} degrees", overRadius, low, high));
            const double c = overRadius / asset.extent.z;
            const int without = wrongOf(*flat, *shape, c, low, high), with = wrongOf(*bent, *shape, c, low, high),
                      byFactors = wrongOf(*factored, *shape, c, low, high);
            EXPECT_LT(with, 3 * without / 4) << without;
            EXPECT_LT(byFactors, 3 * without / 4) << without;
        }
}

TEST(BentMarch, OverAFlatBaseItIsTheMapWithout) {
    const Asset asset = hills();
    const auto shape = *shapeOf(asset);
    const auto flat = marcherOf(asset, *shape, {}), bent = marcherOf(asset, *shape, {3, 0.5});
    std::mt19937 random(3);
    int hits = 0, others = 0;
    for (int i = 0; i < 3000; ++i) {
        MarchRay ray =
            i % 2 ? test::rayFromTop(random, shape->extent(), 3) : test::rayAnywhere(random, shape->extent());
        const MarchResult a = flat->march(ray), b = bent->march(ray);
        // One tells a hit by the density where the ray ends, the other by the nearest ray.
        others += a.state != b.state;
        if (a.state != MarchState::Hit || b.state != MarchState::Hit) continue;
        ++hits;
        ASSERT_NEAR(a.t, b.t, 1e-4) << i;
        ASSERT_GT(glm::dot(a.normal, b.normal), 0.9999f) << i;
    }
    EXPECT_GT(hits, 1000);
    EXPECT_LT(others, 60);
}

/// A ray that begins within the slab is carried to the top along its own curve.
TEST(BentMarch, ARayFromWithinIsTheOneFromTheTop) {
    const Asset asset = hills();
    const auto shape = *shapeOf(asset);
    const auto marcher = marcherOf(asset, *shape, {5, 0.5});
    for (const double overRadius : {0.5, -0.4}) {
        const double c = overRadius / asset.extent.z;
        std::mt19937 random(9);
        int compared = 0, others = 0;
        for (int i = 0; i < 2000; ++i) {
            const MarchRay ray = rayOverArc(random, asset.extent, c, 10, 60);
            const MarchResult found = marcher->march(ray);
            if (found.state != MarchState::Hit || found.t < 0.05) continue;
            // The same ray from a place on its way.
            const double before = 0.7 * found.t, run = std::hypot(ray.direction.x, ray.direction.y);
            const bent::BentPath path{c, ray.origin.z, run, ray.direction.z};
            const dvec2 heading = bent::bentHeading(path, before), across = dvec2(ray.direction) / run;
            MarchRay within = ray;
            within.origin =
                dvec3(dvec2(ray.origin) + bent::bentAlong(path, before) * across, bent::bentHeight(path, before));
            within.direction = glm::normalize(dvec3(heading.x * across, heading.y));
            within.bend = c * (1 + c * within.origin.z);
            // It goes down, or has turned and is asked from where it leaves.
            if (heading.y > 0) continue;
            const MarchResult again = marcher->march(within);
            ++compared;
            others +=
                again.state != MarchState::Hit || std::abs(before + again.t / glm::length(heading) - found.t) > 1e-3;
        }
        EXPECT_GT(compared, 500) << overRadius;
        EXPECT_LE(others, compared / 100) << overRadius;
    }
}

/// Upwards, the place where the ray leaves the slab is asked, back along the curve.
TEST(BentMarch, ShadowsOverArcs) {
    const Asset asset = hills();
    const auto shape = *shapeOf(asset);
    const auto flat = marcherOf(asset, *shape, {}), bent = marcherOf(asset, *shape, {5, 0.5});
    const double c = 0.5 / asset.extent.z;
    std::mt19937 random(23);
    int dark = 0, wrongFlat = 0, wrongBent = 0;
    for (int i = 0; i < 3000; ++i) {
        MarchRay ray = test::rayFromTop(random, shape->extent(), 3, 25);
        const TruthHit below = shape->trace(ray.origin, {0, 0, -1}, 10);
        ray.origin = ray.origin - (below.t - 0.03) * dvec3(0, 0, 1);
        ray.direction = -ray.direction;
        ray.bend = c * (1 + c * ray.origin.z);
        if (shape->field(ray.origin) <= 0) continue;
        const bool isDark = traceOverArc(*shape, c, ray.origin, ray.direction).hit;
        dark += isDark;
        wrongFlat += (flat->march(ray).state == MarchState::Hit) != isDark;
        wrongBent += (bent->march(ray).state == MarchState::Hit) != isDark;
    }
    EXPECT_GT(dark, 100);
    EXPECT_LT(wrongBent, 0.7 * wrongFlat) << wrongBent << " " << wrongFlat;
}

}  // namespace
}  // namespace vcp::meso
