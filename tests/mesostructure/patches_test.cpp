// Patches and quadrics against points of which the answer is known.
#include "mesostructure/patches.h"

#include <algorithm>
#include <random>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "tests/support/meso_rays.h"

namespace vcp::meso {
namespace {

double valueAt(const Patch& patch, glm::dvec3 p) {
    const float* q = patch.quadric;
    return q[0] * p.x * p.x + q[1] * p.y * p.y + q[2] * p.z * p.z + q[3] * p.x * p.y + q[4] * p.y * p.z +
           q[5] * p.z * p.x + q[6] * p.x + q[7] * p.y + q[8] * p.z + q[9];
}

TEST(Patches, TheQuadricHoldsTheBilinearPatchAndItsParameters) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(0, 1);
    int bilinear = 0;
    for (int i = 0; i < 500; ++i) {
        // On the four vertical edges of the cell: a patch of a height field.
        const glm::dvec3 p[4] = {
            {0, 0, unit(random)}, {1, 0, unit(random)}, {1, 1, unit(random)}, {0, 1, unit(random)}};
        std::vector<Patch> patches;
        appendPatches(p, patches);
        ASSERT_GE(patches.size(), 1u);
        if (patches.size() != 1) continue;
        ++bilinear;
        for (int k = 0; k < 10; ++k) {
            const double u = unit(random), v = unit(random);
            const glm::dvec3 x = (1 - u) * (1 - v) * p[0] + u * (1 - v) * p[1] + u * v * p[2] + (1 - u) * v * p[3];
            ASSERT_NEAR(valueAt(patches[0], x), 0, 1e-5) << i;
            ASSERT_NEAR(patches[0].u[0] * x.x + patches[0].u[1] * x.y + patches[0].u[2] * x.z + patches[0].u[3], u,
                        1e-4)
                << i;
            // A ray straight down finds it.
            const float s = crossPatch(patches[0], {float(x.x), float(x.y), 1.5f}, {0, 0, -1}, 2);
            ASSERT_NEAR(s, 1.5 - x.z, 1e-4) << i;
        }
    }
    EXPECT_GT(bilinear, 450);
}

TEST(Patches, FlatAndEmptyLoops) {
    std::vector<Patch> patches;
    const glm::dvec3 flat[4] = {{0, 0, 0.5}, {1, 0, 0.5}, {1, 1, 0.5}, {0, 1, 0.5}};
    appendPatches(flat, patches);
    ASSERT_EQ(patches.size(), 2u);
    EXPECT_EQ(patches[0].isTriangle, 1u);
    EXPECT_NEAR(crossPatch(patches[0], {0.75f, 0.25f, 1}, {0, 0, -1}, 1), 0.5, 1e-6);
    EXPECT_LT(crossPatch(patches[0], {0.25f, 0.75f, 1}, {0, 0, -1}, 1), 0);
    EXPECT_LT(crossPatch(patches[0], {0.75f, 0.25f, 1}, {0, 0, -1}, 0.25f), 0) << "behind the cell's wall";
    patches.clear();
    const glm::dvec3 point[3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
    appendPatches(point, patches);
    EXPECT_TRUE(patches.empty());
    const glm::dvec3 six[6] = {{0, 0.5, 0}, {0.5, 0, 0}, {1, 0, 0.5}, {1, 0.5, 1}, {0.5, 1, 1}, {0, 1, 0.5}};
    appendPatches(six, patches);
    EXPECT_GE(patches.size(), 2u);
    EXPECT_LE(patches.size(), 4u);
}

TEST(Patches, FitFindsSphereCylinderAndPlane) {
    std::mt19937 random(8);
    std::uniform_real_distribution<double> unit(0, 1);
    const auto worst = [&](auto point, int count) {
        std::vector<glm::dvec3> points;
        for (int i = 0; i < count; ++i) points.push_back(point());
        const auto q = fitQuadric(points);
        double most = 0, size = 0;
        for (const double c : q) size = std::max(size, std::abs(c));
        for (const glm::dvec3 p : points)
            most = std::max(
                most, std::abs(q[0] * p.x * p.x + q[1] * p.y * p.y + q[2] * p.z * p.z + q[3] * p.x * p.y +
                               q[4] * p.y * p.z + q[5] * p.z * p.x + q[6] * p.x + q[7] * p.y + q[8] * p.z + q[9]));
        EXPECT_GT(size, 0.1) << "not the zero quadric";
        return most / size;
    };
    EXPECT_LT(worst(
                  [&] {
                      return glm::dvec3(0.5, 0.5, -1) +
                             1.5 * glm::normalize(glm::dvec3(unit(random) - 0.5, unit(random) - 0.5, 1));
                  },
                  60),
              1e-4);
    EXPECT_LT(worst(
                  [&] {
                      const double a = unit(random);
                      return glm::dvec3(2 * std::cos(a) - 1, unit(random), 2 * std::sin(a) - 1);
                  },
                  60),
              1e-4);
    EXPECT_LT(worst(
                  [&] {
                      const double x = unit(random), y = unit(random);
                      return glm::dvec3(x, y, 0.3 + 0.2 * x - 0.1 * y);
                  },
                  60),
              1e-4);
}

/// A line through solids that do not touch the slab's bottom and top enters as often as it leaves: an odd number of
/// crossings is a crack.
TEST(Patches, EncloseTheirSolids) {
    for (const char* name : {"ball", "chain", "bars"}) {
        const auto shape = test::solid(name);
        const Occupancy occupancy = test::occupied(*shape, {24, 24, 6});
        const PatchSet set = *buildPatches(*shape, occupancy, CrossingRule::Direct);
        EXPECT_EQ(set.ranks.size(), (occupancy.cells.size() + 31) / 32);
        std::mt19937 random(2);
        int odd = 0, met = 0;
        for (int i = 0; i < 1500; ++i) {
            // Up, within a tile, in cells.
            const MarchRay ray = test::rayFromTop(random, {1, 1, 0.25}, 60, 89);
            const glm::vec3 o(ray.origin / set.grid.cell), d(ray.direction / set.grid.cell);
            int crossings = 0;
            for (int z = 0; z < 6; ++z)
                for (int y = -12; y < 36; ++y)
                    for (int x = -12; x < 36; ++x) {
                        const auto patches = set.of(set.grid.index({x, y, z}));
                        if (patches.empty()) continue;
                        const glm::vec3 a = (glm::vec3(x, y, z) - o) / d, b = (glm::vec3(x + 1, y + 1, z + 1) - o) / d,
                                        first = glm::min(a, b), last = glm::max(a, b);
                        const float from = std::max({first.x, first.y, first.z}),
                                    to = std::min({last.x, last.y, last.z});
                        if (from > to) continue;
                        for (const Patch& patch : patches)
                            crossings += crossPatch(patch, o + from * d - glm::vec3(x, y, z), d, to - from) >= 0;
                    }
            odd += crossings % 2;
            met += crossings > 0;
        }
        EXPECT_GT(met, 10) << name;
        // A patch that is crossed twice, or a line through an edge of two.
        EXPECT_LE(odd, std::max(1, met / 100)) << name << " of " << met;
    }
}

}  // namespace
}  // namespace vcp::meso
