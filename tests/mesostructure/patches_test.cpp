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
        std::vector<PatchCorners> corners;
        appendPatches(p, patches, corners);
        ASSERT_EQ(corners.size(), patches.size());
        ASSERT_GE(patches.size(), 1u);
        if (patches.size() != 1) continue;
        ++bilinear;
        EXPECT_EQ(corners[0], (PatchCorners{0, 1, 2, 3}));
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
    std::vector<PatchCorners> corners;
    const glm::dvec3 flat[4] = {{0, 0, 0.5}, {1, 0, 0.5}, {1, 1, 0.5}, {0, 1, 0.5}};
    appendPatches(flat, patches, corners);
    ASSERT_EQ(patches.size(), 2u);
    EXPECT_EQ(corners[1], (PatchCorners{0, 2, -1, 3}));
    EXPECT_EQ(patches[0].isTriangle, 1u);
    EXPECT_NEAR(crossPatch(patches[0], {0.75f, 0.25f, 1}, {0, 0, -1}, 1), 0.5, 1e-6);
    EXPECT_LT(crossPatch(patches[0], {0.25f, 0.75f, 1}, {0, 0, -1}, 1), 0);
    EXPECT_LT(crossPatch(patches[0], {0.75f, 0.25f, 1}, {0, 0, -1}, 0.25f), 0) << "behind the cell's wall";
    patches.clear();
    const glm::dvec3 point[3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
    appendPatches(point, patches, corners);
    EXPECT_TRUE(patches.empty());
    const glm::dvec3 six[6] = {{0, 0.5, 0}, {0.5, 0, 0}, {1, 0, 0.5}, {1, 0.5, 1}, {0.5, 1, 1}, {0, 1, 0.5}};
    appendPatches(six, patches, corners);
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

TEST(Patches, NormalsArePackedToAThousandthOfADegreeOrSo) {
    std::mt19937 random(4);
    std::normal_distribution<double> bell;
    for (int i = 0; i < 2000; ++i) {
        glm::dvec3 n = glm::normalize(glm::dvec3(bell(random), bell(random), bell(random)));
        if (i < 27) n = glm::dvec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
        if (n == glm::dvec3(0)) continue;
        const glm::dvec3 back = f32::unfoldNormal(packNormal(n));
        EXPECT_GT(glm::dot(glm::normalize(n), glm::normalize(back)), 1 - 1e-8) << i;
    }
    // Every code is a direction.
    for (uint32_t code : {0u, 0x80008000u, 0x80000000u, 0x7fff7fffu, 0x7fff8000u, 0x00008000u, 0xffffffffu})
        EXPECT_GT(glm::length(f32::unfoldNormal(code)), 0.5f) << code;
}

double degreesBetween(glm::vec3 a, glm::vec3 b) {
    return std::acos(std::clamp(double(glm::dot(a, b)), -1.0, 1.0)) * 180 / M_PI;
}

double quantile(std::vector<double> values, double part) {
    EXPECT_FALSE(values.empty());
    std::ranges::sort(values);
    return values[size_t(part * double(values.size() - 1))];
}

/// Degrees that 95 % of the normals are off the shape's at most, and that 95 % jump across the walls of cells.
struct NormalErrors {
    double off, jump;
};

NormalErrors normalErrorsOf(const Shape& shape, const Occupancy& occupancy, const PatchSet& patches) {
    const auto marcher = test::walk({.occupancy = &occupancy}, {.patches = &patches});
    std::mt19937 random(11);
    std::uniform_real_distribution<double> unit(0, 1);
    std::vector<double> off, jumps;
    for (int i = 0; i < 2000; ++i) {
        const MarchRay ray = test::rayFromTop(random, shape.extent(), 45);
        const MarchResult found = marcher->march(ray);
        const TruthHit truth = shape.trace(ray.origin, ray.direction, ray.tMax);
        if (found.state == MarchState::Hit && truth.hit && std::abs(found.t - truth.t) < 0.01)
            off.push_back(degreesBetween(found.normal, glm::vec3(truth.normal)));
        // Two rays on either side of a wall.
        const double wall = double(random() % unsigned(patches.grid.cells.x)) * patches.grid.cell.x, y = unit(random);
        const glm::dvec3 d = glm::normalize(glm::dvec3(0, unit(random) - 0.5, -1));
        const MarchResult left = marcher->march({{wall - 1e-5 + 1, y, shape.extent().z}, d}),
                          right = marcher->march({{wall + 1e-5, y, shape.extent().z}, d});
        if (left.state == MarchState::Hit && right.state == MarchState::Hit && std::abs(left.t - right.t) < 1e-3)
            jumps.push_back(degreesBetween(left.normal, right.normal));
    }
    return {quantile(off, 0.95), quantile(jumps, 0.95)};
}

TEST(Patches, NormalsDoNotJumpFromCellToCell) {
    const auto shape = test::solid("ball");
    const Occupancy occupancy = test::occupied(*shape, {32, 32, 8});
    for (const CrossingRule rule : {CrossingRule::Direct, CrossingRule::Fitted}) {
        PatchSet set = *buildPatches(*shape, occupancy, rule);
        ASSERT_EQ(set.normals.size(), set.patches.size());
        const NormalErrors blended = normalErrorsOf(*shape, occupancy, set);
        set.normals.clear();
        const NormalErrors own = normalErrorsOf(*shape, occupancy, set);
        EXPECT_LT(blended.jump, 0.05) << int(rule);
        EXPECT_GT(own.jump, 1) << int(rule);
        EXPECT_LT(blended.off, 0.5 * own.off) << int(rule);
    }
}

/// Bars have edges of 90 degrees: next to them, sides keep their own normals.
TEST(Patches, SharpEdgesStaySharp) {
    const auto shape = test::solid("bars");
    const Occupancy occupancy = test::occupied(*shape, {24, 24, 6});
    PatchSet set = *buildPatches(*shape, occupancy, CrossingRule::Direct);
    const double blended = normalErrorsOf(*shape, occupancy, set).off;
    set.normals.clear();
    EXPECT_LE(blended, 1.01 * normalErrorsOf(*shape, occupancy, set).off + 0.1);
}

TEST(Patches, WithoutNormalsTheGradientIsDrawn) {
    const auto shape = test::solid("beads");
    const Occupancy occupancy = test::occupied(*shape, {16, 16, 4});
    PatchSet set = *buildPatches(*shape, occupancy, CrossingRule::Direct);
    set.normals.clear();
    const auto marcher = test::walk({.occupancy = &occupancy}, {.patches = &set});
    std::mt19937 random(3);
    int hits = 0;
    for (int i = 0; i < 500; ++i) {
        const MarchRay ray = test::rayFromTop(random, shape->extent(), 60);
        const MarchResult found = marcher->march(ray);
        if (found.state != MarchState::Hit) continue;
        const glm::dvec3 at = (ray.origin + double(found.t) * ray.direction) / set.grid.cell, cell = glm::floor(at);
        const glm::dvec3 inside = glm::abs(at - cell - 0.5);
        if (std::max({inside.x, inside.y, inside.z}) > 0.499) continue;  // rounding may take it to the next cell
        double nearest = 180;
        for (const Patch& patch : set.of(set.grid.index(glm::ivec3(cell)))) {
            const glm::vec3 gradient = patchGradient(patch, glm::vec3(at - cell)) / glm::vec3(set.grid.cell);
            const double angle = degreesBetween(glm::normalize(gradient), found.normal);
            nearest = std::min({nearest, angle, 180 - angle});
        }
        EXPECT_LT(nearest, 0.1) << i;
        ++hits;
    }
    EXPECT_GT(hits, 100);
}

}  // namespace
}  // namespace vcp::meso
