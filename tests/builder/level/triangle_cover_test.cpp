// The bound against distances of points all over the triangle, and that it is not much more than needed.
#include "builder/level/triangle_cover.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <vector>

#include <gtest/gtest.h>

namespace vcp {
namespace {

double nearest(glm::dvec3 p, const std::vector<TrianglePrism>& others) {
    double least = std::numeric_limits<double>::infinity();
    for (const TrianglePrism& o : others)
        least = std::min(least, std::sqrt(closestOnTriangle(p, o.corners).squared) + o.extra);
    return least;
}

double farthest(const Triangle3& t, const std::vector<TrianglePrism>& others) {
    constexpr int steps = 24;
    double most = 0;
    for (int a = 0; a <= steps; ++a)
        for (int b = 0; a + b <= steps; ++b)
            most = std::max(
                most,
                nearest((double(a) * t[0] + double(b) * t[1] + double(steps - a - b) * t[2]) / double(steps), others));
    return most;
}

double boundOf(const Triangle3& t, const std::vector<TrianglePrism>& others, double enough,
               std::span<double> worst = {}) {
    std::vector<const TrianglePrism*> pointers;
    for (const TrianglePrism& o : others) pointers.push_back(&o);
    return TriangleCover(enough).bound(t, pointers, worst);
}

TEST(TriangleCover, NeverLessThanTheFarthestPoint) {
    for (uint64_t seed = 0; seed < 400; ++seed) {
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> unit(0, 1);
        const auto point = [&](double flat) {
            return glm::dvec3(unit(random), unit(random), flat * unit(random)) * 2.0;
        };
        const double flat = seed % 4 == 0 ? 1 : seed % 4 == 1 ? 0.2 : 0.01;
        std::vector<TrianglePrism> others;
        for (int i = 0; i < 1 + int(seed % 20); ++i) {
            Triangle3 t{point(flat), point(flat), point(flat)};
            if (seed % 5 == 0) t[2] = 0.5 * (t[0] + t[1]) + 1e-4 * point(1);  // needles
            others.emplace_back(t, seed % 3 == 0 ? 0.1 * unit(random) : 0.0);
        }
        const Triangle3 t{point(flat), point(flat), point(flat)};
        for (const double enough : {0.0, 0.05, 0.5}) {
            std::vector<double> worst(others.size(), 0);
            const double bound = boundOf(t, others, enough, worst);
            ASSERT_GE(bound, farthest(t, others)) << seed;
            // What each was used for adds up to the whole.
            ASSERT_EQ(bound, *std::max_element(worst.begin(), worst.end())) << seed;
        }
    }
}

TEST(TriangleCover, CloseToTheTruthOnTiles) {
    // A bumpy floor of right triangles and a triangle over several of them.
    for (uint64_t seed = 0; seed < 50; ++seed) {
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> unit(0, 1);
        glm::dvec3 grid[5][5];
        for (int y = 0; y < 5; ++y)
            for (int x = 0; x < 5; ++x) grid[y][x] = {x, y, 0.3 * unit(random)};
        std::vector<TrianglePrism> others;
        for (int y = 0; y < 4; ++y)
            for (int x = 0; x < 4; ++x) {
                others.emplace_back(Triangle3{grid[y][x], grid[y][x + 1], grid[y + 1][x]});
                others.emplace_back(Triangle3{grid[y][x + 1], grid[y + 1][x + 1], grid[y + 1][x]});
            }
        const Triangle3 t{glm::dvec3(0.3, 0.4, 0.4), glm::dvec3(3.6, 1.2, 0.3), glm::dvec3(1.7, 3.5, 0.5)};
        const double bound = boundOf(t, others, 0), truth = farthest(t, others);
        EXPECT_GE(bound, truth);
        EXPECT_LE(bound, 1.25 * truth + 0.02) << seed;
    }
}

TEST(TriangleCover, FlatTilesAreExact) {
    const std::vector<TrianglePrism> others{
        TrianglePrism({glm::dvec3(0, 0, 0), glm::dvec3(4, 0, 0), glm::dvec3(0, 4, 0)}),
        TrianglePrism({glm::dvec3(4, 0, 0), glm::dvec3(4, 4, 0), glm::dvec3(0, 4, 0)})};
    EXPECT_LT(boundOf({glm::dvec3(0.5, 0.5, 0), glm::dvec3(3.5, 1, 0), glm::dvec3(2, 3.5, 0)}, others, 0), 1e-5);
    EXPECT_NEAR(boundOf({glm::dvec3(0.5, 0.5, 0.25), glm::dvec3(3.5, 1, 0.25), glm::dvec3(2, 3.5, 0.25)}, others, 0),
                0.25, 1e-2);
}

TEST(TriangleCover, NothingIsInfinitelyFar) {
    EXPECT_TRUE(std::isinf(boundOf({glm::dvec3(0), glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0)}, {}, 0.1)));
}

}  // namespace
}  // namespace vcp
