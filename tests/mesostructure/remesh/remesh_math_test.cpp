// Grid space, edges, sweep axes and columns (mesostructure/shared/remesh_math.h).
#include "mesostructure/remesh/remesh_math.h"

#include <array>
#include <bit>
#include <random>

#include <gtest/gtest.h>

namespace vcp::meso {
namespace {

using Single = RemeshMath<float>;
using Double = RemeshMath<double>;

glm::ivec3 gridPoint(std::mt19937& random, int range) {
    std::uniform_int_distribution<int> cell(-range, range);
    return {cell(random), cell(random), cell(random)};
}

TEST(RemeshMath, CellsAreCubesAtEveryDepth) {
    // 300 pixels at 90 degrees, as figure 7 of the paper.
    const double focal = 150;
    const Double::RemeshGrid grid{focal, 1, 1 / std::log1p(1 / focal), 0};
    double screenLeast = 1e300, screenMost = 0;
    for (double z = 1; z < 100; z *= 1.5) {
        // One cell ahead of z is z / focal further on: as deep as a cell is wide there.
        const double deeper = z * (1 + 1 / focal);
        const double cells = grid.depthScale * (std::log(deeper) - std::log(z));
        EXPECT_NEAR(cells, 1, 1e-9) << z;
        // Screen space, scaled to be right at depth 10, is not.
        const double screen = 10 * 10 * focal * (1 / z - 1 / deeper) / 10;
        screenLeast = std::min(screenLeast, screen), screenMost = std::max(screenMost, screen);
    }
    EXPECT_NEAR(screenMost, 10, 0.2);
    EXPECT_LT(screenLeast, 0.15);
}

TEST(RemeshMath, CornersBeforeTheNearestDepthHaveAGridPoint) {
    const Single::RemeshGrid grid{100, 0.01f, 1 / std::log1p(0.01f), 0};
    EXPECT_EQ(Single::remeshGridPoint(grid, {0, 0, -5}), glm::ivec3(0));
    EXPECT_EQ(Single::remeshGridPoint(grid, {1, 0, -5}).x, 10000);
    EXPECT_EQ(Single::remeshGridPoint(grid, {1e30f, -1e30f, -5}),
              glm::ivec3(Single::kRemeshFarthest, -Single::kRemeshFarthest, 0));
}

TEST(RemeshMath, MainDirectionsPreferXOverYOverZ) {
    EXPECT_EQ(Double::remeshEdge({0, 0, 0}, {3, -3, 3}).axis, 0);
    EXPECT_EQ(Double::remeshEdge({0, 0, 0}, {2, -3, 3}).axis, 1);
    EXPECT_EQ(Double::remeshEdge({0, 0, 0}, {2, -3, 4}).axis, 2);
    EXPECT_EQ(Double::remeshEdge({0, 0, 0}, {2, -3, 4}).cells, 4);
    EXPECT_EQ(Double::remeshEdge({5, 5, 5}, {5, 5, 5}).cells, 1) << "an edge of a point is one part";
}

/// Theorem 1, and what the choice of the side axis promises of the footprint: a tangent of at most the root of 5.
TEST(RemeshMath, EveryTriangleHasAPrimaryEdgeAndIsSweptAlongIt) {
    uint64_t threeAxes = 0;
    double steepest = 0;
    for (uint32_t seed = 0; seed < 300'000; ++seed) {
        std::mt19937 random(seed);
        const int range = seed % 3 == 0 ? 2 : seed % 3 == 1 ? 9 : 200;
        const std::array<glm::ivec3, 3> g{gridPoint(random, range), gridPoint(random, range), gridPoint(random, range)};
        const bool isPoint = g[0] == g[1] && g[1] == g[2];
        bool hasPrimary = false;
        std::array<int, 3> axes{};
        for (int k = 0; k < 3; ++k) {
            axes[k] = Double::remeshEdge(g[k], g[(k + 1) % 3]).axis;
            hasPrimary |= Double::remeshIsPrimary(g[k], g[(k + 1) % 3], g[(k + 2) % 3]);
        }
        ASSERT_TRUE(hasPrimary) << seed;
        const auto plan = Double::remeshPlan(g[0], g[1], g[2]);
        ASSERT_EQ(plan.isWhole != 0, isPoint) << seed;
        if (isPoint) continue;
        threeAxes += axes[0] != axes[1] && axes[1] != axes[2] && axes[2] != axes[0];
        const glm::ivec3 p = g[plan.first], q = g[plan.second], r = g[plan.apex];
        ASSERT_LT(p[plan.sweep], q[plan.sweep]) << seed;
        ASSERT_TRUE(p[plan.sweep] <= r[plan.sweep] && r[plan.sweep] <= q[plan.sweep]) << seed;
        ASSERT_EQ(plan.isMirrored != 0, (plan.first + 1) % 3 != plan.second) << seed;
        ASSERT_EQ(Double::remeshEdge(p, q).axis, plan.sweep) << seed;
        const glm::dvec3 a(q - p), b(r - p), n(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
        const int third = 3 - plan.sweep - plan.side;
        if (n[third] != 0) steepest = std::max(steepest, std::hypot(n[plan.sweep], n[plan.side]) / std::abs(n[third]));
    }
    EXPECT_GT(threeAxes, 1000u);
    EXPECT_LE(steepest, std::sqrt(5.0));
    EXPECT_GT(steepest, 1.5) << "the paper's root of 2 is no bound";
}

TEST(RemeshMath, PointsOfAnEdgeAreTheSameFromBothEnds) {
    uint64_t differs = 0;
    for (uint32_t seed = 0; seed < 10'000; ++seed) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<float> number(-10, 10);
        const float a = number(random), b = number(random);
        const int n = 2 + int(random() % 500), k = 1 + int(random() % (uint32_t(n) - 1));
        const float one = Single::remeshBetween(a, b, k, n), other = Single::remeshBetween(b, a, n - k, n);
        ASSERT_EQ(std::bit_cast<uint32_t>(one), std::bit_cast<uint32_t>(other)) << seed;
        const volatile float step = (b - a) / float(n), back = (a - b) / float(n);
        differs += a + float(k) * step != b + float(n - k) * back;
    }
    EXPECT_GT(differs, 4000u) << "steps from either end differ: the symmetric form is needed";
}

TEST(RemeshMath, NextColumnsHaveNextPartsOfAnEdge) {
    for (int span = 1; span < 40; ++span)
        for (int cells = span; cells < 90; ++cells) {
            EXPECT_EQ(Double::remeshNearestPart(7, 7 + span, cells, 7), 0);
            EXPECT_EQ(Double::remeshNearestPart(7, 7 + span, cells, 7 + span), cells);
            for (int column = 7; column < 7 + span; ++column) {
                const int part = Double::remeshNearestPart(7, 7 + span, cells, column);
                ASSERT_LT(part, Double::remeshNearestPart(7, 7 + span, cells, column + 1));
                ASSERT_LE(std::abs(double(part) * span / cells - (column - 7)), 0.5 + 1e-12);
            }
        }
}

TEST(RemeshMath, ColumnsKeepHalfACellFromBothEdges) {
    const auto column = Double::remeshColumn({0, 0}, {10, 5}, {0, 0}, {4, 12}, 3);
    EXPECT_DOUBLE_EQ(column.bottom, 1.5);
    EXPECT_DOUBLE_EQ(column.top, 9);
    EXPECT_EQ(column.from, 2);
    EXPECT_EQ(column.count, 7);
    EXPECT_EQ(Double::remeshColumn({0, 0}, {10, 0}, {0, 0}, {10, 1}, 5).count, 0);
}

}  // namespace
}  // namespace vcp::meso
