// Light from everywhere, against integrals over all directions.
#include "render/environment_light.h"

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include "mesostructure/harmonics.h"
#include "render/host/hit_light.h"

namespace vcp {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr glm::uvec2 kSize(128, 64);

/// The direction of a texel's middle: the picture's middle is at +y, its right at +x, its top at +z.
glm::dvec3 directionOf(uint32_t x, uint32_t y) {
    const double across = 2 * kPi * ((x + 0.5) / kSize.x - 0.5), down = kPi * (y + 0.5) / kSize.y;
    return {std::sin(down) * std::sin(across), std::sin(down) * std::cos(across), std::cos(down)};
}

template <class Radiance>
std::vector<glm::vec3> pictureOf(Radiance radiance) {
    std::vector<glm::vec3> picture;
    for (uint32_t y = 0; y < kSize.y; ++y)
        for (uint32_t x = 0; x < kSize.x; ++x) picture.emplace_back(radiance(directionOf(x, y)));
    return picture;
}

/// What a white surface gives back, by definition: the sum over the picture of radiance times cosine, over pi.
glm::dvec3 integralAt(const std::vector<glm::vec3>& picture, glm::dvec3 n) {
    glm::dvec3 sum(0);
    for (uint32_t y = 0; y < kSize.y; ++y) {
        const double texel = 2 * kPi / kSize.x * (std::cos(kPi * y / kSize.y) - std::cos(kPi * (y + 1.0) / kSize.y));
        for (uint32_t x = 0; x < kSize.x; ++x)
            sum += texel / kPi * std::max(glm::dot(n, directionOf(x, y)), 0.0) *
                   glm::dvec3(picture[size_t{y} * kSize.x + x]);
    }
    return sum;
}

std::vector<glm::dvec3> someNormals(int count) {
    std::mt19937 random(7);
    std::normal_distribution<double> any;
    std::vector<glm::dvec3> normals{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
    while (normals.size() < size_t(count))
        normals.push_back(glm::normalize(glm::dvec3(any(random), any(random), any(random))));
    return normals;
}

/// The light in axes of its own, as shaders find it.
glm::dvec3 lightAt(EnvironmentLight light, glm::dvec3 n) {
    light.up = {0, 0, 1};
    const auto rows = environmentRows(light);
    return f32::environmentLight(glm::vec3(n), rows.data());
}

/// Returns by how much the exposure was changed: the light at some normal over the integral there.
double exposureOf(const EnvironmentLight& light, const std::vector<glm::vec3>& picture) {
    double had = 0, has = 0;
    for (const glm::dvec3 n : someNormals(200)) has += lightAt(light, n).g, had += integralAt(picture, n).g;
    return has / had;
}

TEST(EnvironmentLight, OfThreeBandsIsExact) {
    const auto picture = pictureOf([](glm::dvec3 d) {
        return glm::dvec3(1 + 0.4 * d.x - 0.3 * d.y, 1.5 + d.z + 0.3 * d.x * d.y, 1 + d.z * d.z + 0.5 * d.y * d.z);
    });
    const auto light = environmentLight(picture, kSize);
    ASSERT_TRUE(light);
    const double exposure = exposureOf(*light, picture);
    for (const glm::dvec3 n : someNormals(100)) {
        const glm::dvec3 error = lightAt(*light, n) - exposure * integralAt(picture, n);
        EXPECT_LT(glm::length(error), 2e-3) << n.x << " " << n.y << " " << n.z;
    }
}

TEST(EnvironmentLight, OfLampsIsNearTheIntegral) {
    std::mt19937 random(3);
    std::normal_distribution<double> any;
    for (int scene = 0; scene < 5; ++scene) {
        std::vector<std::pair<glm::dvec3, glm::dvec3>> lamps;
        for (int i = 0; i < 6; ++i)
            lamps.emplace_back(glm::normalize(glm::dvec3(any(random), any(random), any(random))),
                               glm::abs(glm::dvec3(any(random), any(random), any(random))));
        const auto picture = pictureOf([&](glm::dvec3 d) {
            glm::dvec3 light(0.3);
            for (const auto& [towards, colour] : lamps) light += std::exp(8 * (glm::dot(d, towards) - 1)) * colour;
            return light;
        });
        const auto light = environmentLight(picture, kSize);
        ASSERT_TRUE(light);
        const double exposure = exposureOf(*light, picture);
        double worst = 0, sum = 0, mean = 0;
        const auto normals = someNormals(300);
        for (const glm::dvec3 n : normals) {
            const glm::dvec3 truth = exposure * integralAt(picture, n);
            const double error = glm::length(lightAt(*light, n) - truth);
            worst = std::max(worst, error), sum += error * error, mean += glm::length(truth);
        }
        // Ramamoorthi and Hanrahan: about 1 % on average, 9 % at worst, of far harder light.
        EXPECT_LT(std::sqrt(sum / double(normals.size())), 0.02 * mean / double(normals.size()));
        EXPECT_LT(worst, 0.08 * mean / double(normals.size()));
    }
}

TEST(EnvironmentLight, TurnsWithItsAxesAndTheDatasets) {
    const auto light = environmentNamed("clear");
    ASSERT_TRUE(light);
    // Where y is up, the picture's middle is at -z and its right at +x: the view from the front sees it behind.
    const auto fromWorld = [](glm::dvec3 v) { return glm::dvec3(v.x, -v.z, v.y); };
    const glm::dquat dataset = glm::normalize(glm::dquat(0.3, -0.5, 0.7, 0.2));
    EnvironmentLight turned = *light;
    turned.turn = 30;
    turned.strength = 2;
    const auto rows = environmentRows(*light), ofTurned = environmentRows(turned, dataset);
    const glm::dquat left = glm::angleAxis(kPi / 6, glm::dvec3(0, 1, 0));
    for (const glm::dvec3 n : someNormals(50)) {
        const glm::vec3 world = f32::environmentLight(glm::vec3(n), rows.data());
        EXPECT_LT(glm::length(glm::dvec3(world) - lightAt(*light, fromWorld(n))), 1e-5);
        // What faced n faces it after both have turned to the left.
        const glm::dvec3 local = glm::conjugate(dataset) * (left * n);
        const glm::vec3 there = f32::environmentLight(glm::vec3(local), ofTurned.data());
        EXPECT_LT(glm::length(there - 2.0f * world), 1e-5f);
    }
    turned.up = {0, -1, 0}, turned.turn = 0, turned.strength = 1;
    const auto downward = environmentRows(turned);
    EXPECT_LT(
        glm::length(f32::environmentLight({0, -1, 0}, downward.data()) - f32::environmentLight({0, 1, 0}, rows.data())),
        1e-5f);
}

TEST(EnvironmentLight, HarmonicsAreIntegralsOfTheRadiance) {
    // By definition, over a picture of lamps; the unit is that of the forms.
    const auto picture = pictureOf([](glm::dvec3 d) {
        return glm::dvec3(0.1) + 9.0 * std::max(0.0, d.x - 0.8) + glm::dvec3(0, 2, 5) * std::max(0.0, d.y * d.z - 0.3);
    });
    const auto light = environmentLight(picture, kSize);
    ASSERT_TRUE(light);
    const double exposure = exposureOf(*light, picture);
    for (int k = 0; k < 16; ++k) {
        glm::dvec3 sum(0);
        for (uint32_t y = 0; y < kSize.y; ++y) {
            const double texel =
                2 * kPi / kSize.x * (std::cos(kPi * y / kSize.y) - std::cos(kPi * (y + 1.0) / kSize.y));
            for (uint32_t x = 0; x < kSize.x; ++x)
                sum += texel * meso::f64::harmonicsOf(directionOf(x, y)).c[k] *
                       glm::dvec3(picture[size_t{y} * kSize.x + x]);
        }
        // The exposure is known by the integrals of a clamped cosine, which three bands hold to some percent.
        EXPECT_LT(glm::length(glm::dvec3(light->harmonics[size_t(k)]) - exposure * sum),
                  0.02 * glm::length(glm::dvec3(light->harmonics[0])))
            << k;
    }
    // An open surface gets from them what the quadratic form says.
    for (const glm::dvec3 n : someNormals(50)) {
        const meso::f64::Harmonics open = meso::f64::clampedCosine(n);
        glm::dvec3 arrives(0);
        for (size_t k = 0; k < 16; ++k) arrives += open.c[k] * glm::dvec3(light->harmonics[k]);
        EXPECT_LT(glm::length(glm::max(arrives, glm::dvec3(0)) - lightAt(*light, n)), 1e-5);
    }
}

TEST(EnvironmentLight, HarmonicsTurnAsTheFormsDo) {
    EnvironmentLight light = *environmentNamed("studio");
    light.up = {0.48, -0.6, 0.64}, light.turn = 70, light.strength = 1.5f;
    const auto rows = environmentRows(light);
    const auto harmonics = environmentHarmonics(light);
    for (const glm::dvec3 n : someNormals(50)) {
        const meso::f64::Harmonics open = meso::f64::clampedCosine(n);
        glm::dvec3 arrives(0);
        for (size_t k = 0; k < 16; ++k) arrives += open.c[k] * glm::dvec3(harmonics[k]);
        EXPECT_LT(glm::length(glm::max(arrives, glm::dvec3(0)) -
                              glm::dvec3(f32::environmentLight(glm::vec3(n), rows.data()))),
                  1e-5);
    }
}

TEST(EnvironmentLight, WhatIsSeenHasTheUnitOfTheLight) {
    // The mean radiance is the zeroth coefficient over the root of 4 pi.
    for (const char* name : kEnvironmentNames) {
        const auto radiance = environmentRadiance(name);
        glm::dvec3 mean(0);
        constexpr int kCount = 20000;
        for (int i = 0; i < kCount; ++i) {
            const double z = 1 - (2 * i + 1.0) / kCount, angle = i * kPi * (3 - std::sqrt(5.0)),
                         r = std::sqrt(1 - z * z);
            mean += radiance({r * std::cos(angle), r * std::sin(angle), z}) / double(kCount);
        }
        const glm::dvec3 known = glm::dvec3(environmentNamed(name)->harmonics[0]) / std::sqrt(4 * kPi);
        EXPECT_LT(glm::length(mean - known), 0.01 * glm::length(known)) << name;
    }
}

TEST(EnvironmentLight, TheBrightestSurfaceGetsOne) {
    const glm::dvec3 luminance(0.2126, 0.7152, 0.0722);
    for (const char* name : kEnvironmentNames) {
        const auto light = environmentNamed(name);
        ASSERT_TRUE(light) << name;
        double most = 0, least = 10;
        for (const glm::dvec3 n : someNormals(2000)) {
            const double at = glm::dot(lightAt(*light, n), luminance);
            most = std::max(most, at), least = std::min(least, at);
        }
        EXPECT_NEAR(most, 1, 0.01) << name;
        EXPECT_GT(least, 0.02) << name;
    }
    EXPECT_FALSE(environmentNamed("moon"));
}

TEST(EnvironmentLight, DoesNotDependOnTheExposure) {
    const auto picture = [](float exposure) {
        return pictureOf([&](glm::dvec3 d) { return double(exposure) * glm::dvec3(1 + d.z, 1, 1 - 0.5 * d.x); });
    };
    const auto dim = environmentLight(picture(1e-20f), kSize), bright = environmentLight(picture(1e20f), kSize);
    ASSERT_TRUE(dim && bright);
    for (const glm::dvec3 n : someNormals(20)) EXPECT_LT(glm::length(lightAt(*dim, n) - lightAt(*bright, n)), 1e-5);
    EXPECT_FALSE(environmentLight(picture(0), kSize));
    EXPECT_TRUE(environmentLight(std::vector{glm::vec3(1)}, {1, 1}));
}

}  // namespace
}  // namespace vcp
