// How far a triangle is from its height map: against dense samples of both, and where the answer is known.
#include "mesostructure/remesh/height_deviation.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <glm/common.hpp>

namespace vcp::meso {
namespace {

using glm::dvec2;
using Corners = std::array<HeightCorner, 3>;

HeightLevels levelsOf(glm::ivec2 size, std::vector<uint16_t> texels) {
    return *HeightLevels::build({size, 1, std::move(texels)}, {.mostLevels = 1});
}

HeightLevels noise(glm::ivec2 size, uint32_t seed) {
    std::mt19937 random(seed);
    std::vector<uint16_t> texels;
    for (int i = 0; i < size.x * size.y; ++i) texels.push_back(uint16_t(random()));
    return levelsOf(size, std::move(texels));
}

/// The most of many places of the triangle, of its edges and of the map's lines.
double sampled(const HeightLevels& levels, const Corners& c, int parts) {
    double most = 0;
    for (int i = 0; i <= parts; ++i)
        for (int j = 0; i + j <= parts; ++j) {
            const double a = double(i) / parts, b = double(j) / parts, rest = 1 - a - b;
            const dvec2 at = rest * c[0].at + a * c[1].at + b * c[2].at;
            const double linear = rest * c[0].height + a * c[1].height + b * c[2].height;
            most = std::max(most, std::abs(levels.height(0, at) - linear));
        }
    return most;
}

TEST(HeightDeviation, IsTheMostOfDenseSamples) {
    double closest = 1e300;
    for (uint32_t seed = 0; seed < 600; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937 random(seed);
        const glm::ivec2 size = seed % 2 == 0 ? glm::ivec2(8, 8) : glm::ivec2(13, 6);
        const HeightLevels levels = noise(size, seed);
        const double edge = seed % 3 == 0 ? 0.03 : seed % 3 == 1 ? 0.2 : 1.5;
        std::uniform_real_distribution<double> place(-2, 2), off(-edge, edge), height(0, 1);
        const dvec2 middle(place(random), place(random));
        Corners corners;
        for (HeightCorner& corner : corners) {
            corner.at = middle + dvec2(off(random), off(random));
            corner.height = seed % 5 == 0 ? height(random) : levels.height(0, corner.at);
        }
        if (seed % 7 == 0) corners[1].at.x = std::round(corners[1].at.x * size.x) / size.x;
        if (seed % 11 == 0) corners[2].at = 0.5 * (corners[0].at + corners[1].at);  // on a line
        if (seed % 13 == 0) corners[2] = corners[0];
        const double exact = heightDeviation(levels, corners), dense = sampled(levels, corners, 400);
        ASSERT_GE(exact, dense - 1e-9);
        // Between two samples both change by at most 2 for each texel.
        ASSERT_LE(exact, dense + 8 * edge * std::max(size.x, size.y) / 400);
        closest = std::min(closest, exact - dense);
    }
    EXPECT_LT(closest, 1e-6);
}

TEST(HeightDeviation, OfOneTwistedTexelIsAQuarterOfTheTwist) {
    // Heights 0, 0, 0, 1 over the tile's first quarter: along the diagonal from 0 to 1 the map is u^2.
    const HeightLevels levels = levelsOf({2, 2}, {0, 0, 0, 65535});
    EXPECT_NEAR(heightDeviation(levels, {{{{0, 0}, 0}, {{0.5, 0}, 0}, {{0.5, 0.5}, 1}}}), 0.25, 1e-12);
    EXPECT_NEAR(heightDeviation(levels, {{{{0, 0}, 0}, {{0.5, 0}, 0}, {{0, 0.5}, 0}}}), 0.25, 1e-12);
    // Half the cells have a quarter of it.
    EXPECT_NEAR(heightDeviation(levels, {{{{0, 0}, 0}, {{0.25, 0}, 0}, {{0.25, 0.25}, 0.25}}}), 0.0625, 1e-12);
    // A triangle between the map's lines whose map is a plane is exact.
    EXPECT_NEAR(heightDeviation(levels, {{{{0, 0}, 0}, {{0.5, 0}, 0}, {{0.5, 0}, 0}}}), 0, 1e-12);
}

TEST(HeightDeviation, SeesATexelWithinAGreatTriangle) {
    std::vector<uint16_t> texels(64 * 64, 0);
    texels[64 * 21 + 13] = 65535;
    const HeightLevels levels = levelsOf({64, 64}, std::move(texels));
    const Corners flat{{{{0.01, 0.02}, 0}, {{0.93, 0.1}, 0}, {{0.2, 0.97}, 0}}};
    EXPECT_NEAR(heightDeviation(levels, flat), 1, 1e-12);
    // The same beyond the tile, and with rows of which none has a corner of the triangle.
    const Corners away{{{{3.01, -4.98}, 0}, {{3.93, -4.9}, 0}, {{3.2, -4.03}, 0}}};
    EXPECT_NEAR(heightDeviation(levels, away), 1, 1e-9);
    EXPECT_EQ(heightDeviation(levels, {{{{0.5, 0.5}, 0}, {{0.9, 0.5}, 0}, {{0.7, 0.9}, 0}}}), 0);
}

/// Cells that lie whole in a triangle are measured by their corners: here over hundreds of them, across the map's ends.
TEST(HeightDeviation, OfManyWholeCellsIsTheMostOfDenseSamples) {
    for (uint32_t seed = 0; seed < 40; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937 random(seed);
        const glm::ivec2 size = seed % 2 == 0 ? glm::ivec2(16, 16) : glm::ivec2(13, 6);
        const HeightLevels levels = noise(size, seed);
        const dvec2 texels = levels.texels();
        std::uniform_real_distribution<double> place(-40, 40), height(0, 1);
        Corners corners;
        for (HeightCorner& corner : corners) {
            dvec2 at(place(random), place(random));
            // Corners on texels, and sides along the map's lines.
            if (seed % 3 != 0) at = glm::round(at);
            corner = {at / texels, height(random)};
        }
        if (seed % 3 == 1) corners[1].at.y = corners[0].at.y, corners[2].at.x = corners[0].at.x;
        const double exact = heightDeviation(levels, corners);
        double most = 0;
        const dvec2 a = corners[0].at, b = corners[1].at - a, c = corners[2].at - a;
        const double area = b.x * c.y - b.y * c.x;
        if (area == 0) continue;
        // Eight samples along a texel: the texels themselves are among them, and of what is cut the triangle's corners.
        for (int j = -41 * 8; j <= 41 * 8; ++j)
            for (int i = -41 * 8; i <= 41 * 8; ++i) {
                const dvec2 at = dvec2(i, j) / 8.0 / texels, d = at - a;
                const double v = (d.x * c.y - d.y * c.x) / area, w = (b.x * d.y - b.y * d.x) / area;
                if (v < 0 || w < 0 || v + w > 1) continue;
                const double linear = (1 - v - w) * corners[0].height + v * corners[1].height + w * corners[2].height;
                most = std::max(most, std::abs(levels.height(0, at) - linear));
            }
        EXPECT_GE(exact, most - 1e-9);
        // The map changes by up to 2 over a texel, and no place is farther from a sample than a quarter of one.
        EXPECT_LE(exact, most + 0.5);
    }
}

TEST(HeightDeviation, EndsWhereItIsEnough) {
    const HeightLevels levels = noise({64, 64}, 5);
    const Corners corners{{{{0, 0}, 0.5}, {{1, 0}, 0.5}, {{0, 1}, 0.5}}};
    DeviationSearch ends{.enough = 0.1};
    const double all = heightDeviation(levels, corners), some = heightDeviation(levels, corners, ends);
    EXPECT_GT(some, 0.1);
    EXPECT_LT(some, all);
    DeviationSearch goesOn{.enough = all}, isKnown{.known = 0.9};
    EXPECT_EQ(heightDeviation(levels, corners, goesOn), all);
    EXPECT_EQ(heightDeviation(levels, corners, isKnown), 0.9);
}

}  // namespace
}  // namespace vcp::meso
