// Normals from images: on a square that is turned any way, with coordinates that are turned, mirrored and stretched,
// right, up and away are where they are in the image.
#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include "octree/surface/image_lookup.h"

namespace vcp {
namespace {

glm::dquat anyTurn(std::mt19937& random) {
    std::normal_distribution<double> normal;
    return glm::normalize(glm::dquat(normal(random), normal(random), normal(random), normal(random)));
}

glm::dvec3 stored(glm::dvec3 normal) { return 0.5 + 0.5 * normal; }

TEST(MappedNormal, LeansAsItsImageDoes) {
    for (uint32_t seed = 0; seed < 500; ++seed) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> bits(-20, 5);
        const auto size = [&](std::mt19937& from) { return std::exp2(bits(from)); };
        const glm::dquat turn = anyTurn(random);
        // The image's axes on the surface; mirrored ones, too. v grows downwards.
        const glm::dvec3 n = turn * glm::dvec3(0, 0, 1), right = turn * glm::dvec3(seed % 2 == 0 ? 1 : -1, 0, 0),
                         up = turn * glm::dvec3(0, 1, 0);
        const double width = size(random), height = size(random);
        const glm::dvec3 a = turn * glm::dvec3(0.3, 0.2, 0), b = turn * glm::dvec3(1.3, 0.4, 0),
                         c = turn * glm::dvec3(0.5, 1.6, 0);
        const auto placeOf = [&](glm::dvec3 p) {
            return glm::dvec2(glm::dot(p, right) * width, -glm::dot(p, up) * height);
        };
        const f64::TextureSlope slope = f64::textureSlope(a, b, c, placeOf(b) - placeOf(a), placeOf(c) - placeOf(a));
        const glm::dvec3 lean = glm::normalize(glm::dvec3(0.4, -0.3, 0.8));
        const f64::MappedNormal found = f64::mappedNormal(n, slope, stored(lean), 1);
        const glm::dvec3 expected = lean.x * right + lean.y * up + lean.z * n;
        EXPECT_LT(glm::length(found.normal - expected), 1e-9) << seed;
        EXPECT_NEAR(found.spread, 0, 1e-12);
        const f32::TextureSlope single{slope.u, slope.v};
        EXPECT_LT(glm::length(f32::mappedNormal(n, single, stored(lean), 1).normal - glm::vec3(expected)), 1e-5f);
        // From behind it leans the same way.
        const glm::dvec3 back = f64::mappedNormal(-n, slope, stored(lean), 1).normal;
        EXPECT_LT(glm::length(back - (lean.x * right + lean.y * up - lean.z * n)), 1e-9) << seed;
        // The scale multiplies right and up.
        const glm::dvec3 flat = f64::mappedNormal(n, slope, stored(lean), 0).normal;
        EXPECT_LT(glm::length(flat - n), 1e-9) << seed;
    }
}

TEST(MappedNormal, IsTheSurfacesOwnWithoutCoordinates) {
    const glm::dvec3 n(0, 0, 1), lean(0.6, 0, 0.8);
    const double huge = 1e200;
    for (const f64::TextureSlope& slope :
         {f64::TextureSlope{glm::dvec3(0), glm::dvec3(0)}, f64::TextureSlope{glm::dvec3(huge), glm::dvec3(0, huge, 0)},
          f64::TextureSlope{glm::dvec3(1, 0, 0), glm::dvec3(2, 0, 0)}})
        EXPECT_LT(glm::length(f64::mappedNormal(n, slope, stored(lean), 1).normal - n), 1e-9);
    const f64::TextureSlope usual{glm::dvec3(1, 0, 0), glm::dvec3(0, -1, 0)};
    const glm::dvec3 none = f64::mappedNormal(n, usual, glm::dvec3(0.5), 1).normal;
    EXPECT_LT(glm::length(none - n), 1e-9);
}

// A mean of normals that lean every way by so much says how rough they make a surface.
TEST(MappedNormal, MeansOfDifferentNormalsAreRough) {
    const f64::TextureSlope usual{glm::dvec3(1, 0, 0), glm::dvec3(0, -1, 0)};
    double before = -1;
    for (const double angle : {0.0, 0.2, 0.4, 0.8}) {
        const glm::dvec3 mean(0, 0, std::cos(angle));
        const f64::MappedNormal found = f64::mappedNormal({0, 0, 1}, usual, stored(mean), 1);
        EXPECT_LT(glm::length(found.normal - glm::dvec3(0, 0, 1)), 1e-9);
        EXPECT_GT(found.spread, before);
        // Leaning by an angle every way, one axis has half its square; GGX's alpha^2 has twice one axis' variance.
        EXPECT_NEAR(found.spread, angle * angle, 0.05 + 0.3 * angle * angle);
        before = found.spread;
    }
    EXPECT_NEAR(f64::roughnessWithin(0.5, 0), 0.5, 1e-12);
    EXPECT_NEAR(f64::roughnessWithin(0.2, 1), 1, 1e-12);
}

}  // namespace
}  // namespace vcp
