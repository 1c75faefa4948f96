// Light of mesostructure from far, against means over many rays.
#include <cmath>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "mesostructure/appearance.h"
#include "tests/support/meso_rays.h"

namespace vcp::meso {
namespace {

HeightMap flat(uint16_t value) { return {{8, 8}, 0.25, std::vector<uint16_t>(64, value)}; }

/// Walls along y, of 45 degrees on both sides: a triangle wave.
HeightMap roof() {
    std::vector<uint16_t> heights;
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x) heights.push_back(uint16_t(65535 * (x < 4 ? x : 8 - x) / 4));
    return {{8, 8}, 0.5, std::move(heights)};
}

TEST(Appearance, OfAPlaneIsAPlanes) {
    const HeightMap map = flat(39321);
    const Appearance plane = appearanceOf(**heightShape(map), 1);
    EXPECT_NEAR(plane.height, 0.15, 1e-9);
    EXPECT_TRUE(plane.isOpaque);
    ASSERT_EQ(plane.texels.size(), size_t{Appearance::kTexels} * Appearance::kViews * Appearance::kViews);
    for (uint32_t i = 0; i < Appearance::kViews; ++i)
        for (const bool withShadows : {false, true}) {
            // Three bands of a clamped cosine are off by 1/16 at its top and 3/32 at its foot.
            EXPECT_NEAR(lightOf(plane, {i, 3}, {0, 0, 1}, withShadows), 1, 0.07);
            EXPECT_NEAR(lightOf(plane, {i, 3}, glm::normalize(glm::dvec3(1, 0, 1)), withShadows), std::sqrt(0.5), 0.07);
            EXPECT_NEAR(lightOf(plane, {i, 3}, {0, 0, -1}, withShadows), 0, 0.1);
        }
}

TEST(Appearance, ShowsTheSideThatIsSeen) {
    const HeightMap map = roof();
    const Appearance roof = appearanceOf(**heightShape(map), 1);
    EXPECT_NEAR(roof.height, 0.25, 0.01);
    const glm::dvec3 left = glm::normalize(glm::dvec3(-1, 0, 1)), right = glm::normalize(glm::dvec3(1, 0, 1));
    // Views of the first and the last corner look along x, from below 45 degrees: they see one side alone.
    EXPECT_NEAR(lightOf(roof, {0, 0}, left, false), 1, 0.08);
    EXPECT_NEAR(lightOf(roof, {0, 0}, right, false), 0, 0.12);
    EXPECT_NEAR(lightOf(roof, {7, 7}, right, false), 1, 0.08);
    // Twice as high it is steeper: 63 degrees.
    const Appearance steep = appearanceOf(**heightShape(map), 2);
    EXPECT_NEAR(lightOf(steep, {7, 7}, {1, 0, 0}, false), 2 / std::sqrt(5.0), 0.08);
    // Light from the left, nearly level, leaves the right sides dark and reaches only the tops of the left ones.
    const glm::dvec3 low = glm::normalize(glm::dvec3(-1, 0, 0.1));
    EXPECT_EQ(lightOf(roof, {3, 4}, {-1, 0, 0}, true), 0);
    EXPECT_LT(lightOf(roof, {3, 4}, low, true), 0.5 * lightOf(roof, {3, 4}, low, false));
}

TEST(Appearance, SeesWhatIsNotThere) {
    EXPECT_FALSE(appearanceOf(*test::solid("ball"), 1, 64).isOpaque);
    const HeightMap map = flat(0);
    EXPECT_NEAR(appearanceOf(**heightShape(map), 1, 64).height, 0, 1e-9);
}

}  // namespace
}  // namespace vcp::meso
