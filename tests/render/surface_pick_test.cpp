// Points on surfaces with mesostructure, against closed forms.
#include "render/surface_pick.h"

#include <random>

#include <glm/geometric.hpp>

#include "octree/reference_caster.h"
#include "tests/support/meso_surfaces.h"

namespace vcp {
namespace {

using test::heightAsset;
using test::mesoSurface;
using test::plateau;

/// Rays from above that end on the square -0.7 to 0.7 of a base's 2 units.
Ray rayFromAbove(std::mt19937& random, double distance) {
    std::uniform_real_distribution<double> aside(-0.7, 0.7);
    const glm::dvec3 at(aside(random), aside(random), 0),
        from = at + distance * glm::normalize(glm::dvec3(aside(random), aside(random), 1.5));
    return {from, glm::normalize(at - from)};
}

TEST(SurfacePick, APlateauIsWhereItIs) {
    const MesoSurface surface = mesoSurface(plateau(), "pyramid", "quad", 0.5);
    std::mt19937 random(5);
    for (const double distance : {0.7, 3.0, 400.0}) {
        int hits = 0;
        for (int i = 0; i < 300; ++i) {
            const Ray ray = rayFromAbove(random, distance);
            const auto point = pickOnSurfaces(std::span(&surface, 1), ray.origin, ray.direction);
            if (!point) continue;
            ++hits;
            ASSERT_TRUE(point->error);
            EXPECT_LE(std::abs(point->position.z - 0.3), *point->error) << distance;
            EXPECT_LT(*point->error, 5e-5 + 1.2e-5 * distance);
            EXPECT_GT(point->normal.z, 0.999f);
            EXPECT_LT(glm::distance(point->position, ray.origin + point->depth * ray.direction), 1e-12 * distance);
        }
        EXPECT_GT(hits, 250);
    }
}

TEST(SurfacePick, TheNearestOfSurfacesAndWhatPlanesKeep) {
    const std::vector<MesoSurface> surfaces = {mesoSurface(plateau(), "boxes", "quad", 0.5),
                                               mesoSurface(plateau(), "boxes", "quad", 0.5, 2, {0, 0, 2})};
    const glm::dvec3 from(0.13, 0.21, 6), down(0, 0, -1);
    const auto upper = pickOnSurfaces(surfaces, from, down);
    ASSERT_TRUE(upper);
    EXPECT_NEAR(upper->position.z, 2.3, 1e-5);
    const SectionPlane keepsBelow{{0, 0, -3}, -3};
    const auto lower = pickOnSurfaces(surfaces, from, down, std::span(&keepsBelow, 1));
    ASSERT_TRUE(lower);
    EXPECT_NEAR(lower->position.z, 0.3, 1e-5);
    EXPECT_NEAR(lower->depth, 5.7, 1e-5);
    const std::vector<glm::dvec3> moved = {{0.5, 0, 0}, {0, 0, -1}};
    EXPECT_NEAR(pickOnSurfaces(surfaces, from, down, {}, moved)->position.z, 1.3, 1e-5);
    const std::vector<glm::dvec3> aside = {{0, 0, 0.5}, {0, 5, 0}};
    EXPECT_NEAR(pickOnSurfaces(surfaces, from, down, {}, aside)->position.z, 0.8, 1e-5);
    EXPECT_FALSE(pickOnSurfaces(surfaces, from, -down));
    EXPECT_FALSE(pickOnSurfaces({}, from, down));
}

TEST(SurfacePick, WhereNothingIsKnownThePointSaysSo) {
    const auto fbm = heightAsset("fbm", *meso::makeHeightField("fbm", 32, 1));
    const MesoSurface surface = mesoSurface(fbm, "relief-binary", "quad", 0.2);
    const auto point = pickOnSurfaces(std::span(&surface, 1), {0.1, 0.2, 3}, {0, 0, -1});
    ASSERT_TRUE(point);
    EXPECT_FALSE(point->error);
}

}  // namespace
}  // namespace vcp
