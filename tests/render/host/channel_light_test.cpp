// Light on surfaces with channels: highlights against GGX by its formulas in double precision; what is reflected is
// never more than what falls in, as near to all as white surfaces should be, and the same both ways.
#include "render/host/channel_light.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

namespace vcp {
namespace {

constexpr double kPi = 3.14159265358979323846;

f32::LitSurface surfaceOf(glm::vec3 albedo, double roughness, double metalness) {
    return {albedo, float(roughness), float(metalness), glm::vec3(0)};
}

/// pi times the reflectance of highlights alone, by whole formulas (glTF 2.0, Appendix B).
glm::dvec3 highlight(const f32::LitSurface& s, glm::dvec3 n, glm::dvec3 l, glm::dvec3 v) {
    const glm::dvec3 h = glm::normalize(l + v);
    const double alpha2 = std::pow(std::max(double(s.roughness), double(f32::kLeastRoughness)), 4);
    const double nh = std::max(glm::dot(n, h), 0.0), nl = glm::dot(n, l), nv = glm::dot(n, v), vh = glm::dot(v, h);
    const double d = alpha2 / (kPi * std::pow(nh * nh * (alpha2 - 1) + 1, 2));
    const auto lambda = [&](double cosine) {
        return (-1 + std::sqrt(1 + alpha2 * (1 - cosine * cosine) / (cosine * cosine))) / 2;
    };
    const double shadowed = 1 / (1 + lambda(nl) + lambda(nv));
    const glm::dvec3 ahead = glm::mix(glm::dvec3(0.04), glm::dvec3(s.albedo), double(s.metalness));
    return kPi * d * shadowed / (4 * nl * nv) * (ahead + (1.0 - ahead) * std::pow(1 - vh, 5));
}

glm::dvec3 anyUnit(std::mt19937& random) {
    std::normal_distribution<double> normal;
    return glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
}
glm::dvec3 anyAbove(glm::dvec3 n, std::mt19937& random) {
    for (;;) {
        const glm::dvec3 d = anyUnit(random);
        if (glm::dot(n, d) > 0.02) return d;
    }
}

TEST(ChannelLight, HighlightsAreAsTheirFormulasSay) {
    for (uint32_t seed = 0; seed < 2000; ++seed) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> part(0, 1);
        const f32::LitSurface s =
            surfaceOf({part(random), part(random), part(random)}, part(random), seed % 3 == 0 ? 0.5 : seed % 3 - 1);
        const glm::dvec3 n = anyUnit(random), l = anyAbove(n, random), v = anyAbove(n, random);
        const glm::dvec3 expected = highlight(s, n, l, v);
        const glm::vec3 found = f32::reflectedPart(s, n, l, v);
        for (int c = 0; c < 3; ++c) {
            // Below them is a matt ground, of what is no metal.
            const double ground = double(found[c]) - expected[c], rounding = 2e-4 * (1 + 10 * expected[c]);
            ASSERT_GE(ground, -rounding) << seed;
            ASSERT_LE(ground, 1.1 * (1 - double(s.metalness)) * double(s.albedo[c]) + rounding) << seed;
        }
        const glm::vec3 back = f32::reflectedPart(s, n, v, l);
        for (int c = 0; c < 3; ++c) ASSERT_NEAR(found[c], back[c], 1e-5 * (1 + expected[c])) << seed;
    }
}

/// What a surface reflects of a white furnace, about the normal z: half of the directions are chosen by the cosine,
/// half as GGX's highlights lie, each weighted by how likely either is (Veach and Guibas 1995).
double reflectedOfFurnace(const f32::LitSurface& s, glm::dvec3 eye) {
    constexpr int kSteps = 200;
    const double alpha2 = std::pow(std::max(double(s.roughness), double(f32::kLeastRoughness)), 4);
    double sum = 0;
    const auto add = [&](glm::dvec3 l) {
        const glm::dvec3 h = glm::normalize(l + eye);
        if (l.z <= 1e-6 || h.z <= 0) return;
        const double d = alpha2 / (kPi * std::pow(h.z * h.z * (alpha2 - 1) + 1, 2));
        const double density = l.z / kPi + d * h.z / (4 * glm::dot(eye, h));
        sum += double(f32::reflectedPart(s, {0, 0, 1}, l, eye).x) / kPi * l.z / density;
    };
    for (int i = 0; i < kSteps; ++i)
        for (int j = 0; j < kSteps; ++j) {
            const double u = (i + 0.5) / kSteps, angle = 2 * kPi * (j + 0.5) / kSteps;
            const auto at = [angle](double cosine) {
                const double sine = std::sqrt(std::max(1 - cosine * cosine, 0.0));
                return glm::dvec3(sine * std::cos(angle), sine * std::sin(angle), cosine);
            };
            add(at(std::sqrt(1 - u)));
            const glm::dvec3 h = at(std::sqrt((1 - u) / (1 + (alpha2 - 1) * u)));
            if (glm::dot(eye, h) > 0) add(2 * glm::dot(eye, h) * h - eye);
        }
    return sum / (kSteps * kSteps);
}

TEST(ChannelLight, NeverReflectsMoreThanFallsIn) {
    for (const double metalness : {0.0, 0.5, 1.0})
        for (const double roughness : {0.0, 0.3, 0.6, 1.0})
            for (const double cosine : {0.05, 0.3, 0.7, 1.0}) {
                SCOPED_TRACE(testing::Message() << metalness << " " << roughness << " " << cosine);
                const f32::LitSurface white = surfaceOf(glm::vec3(1), roughness, metalness);
                const glm::dvec3 eye(std::sqrt(1 - cosine * cosine), 0, cosine);
                const double reflected = reflectedOfFurnace(white, eye);
                EXPECT_LT(reflected, 1.03);
                // Metal loses what goes from facet to facet.
                EXPECT_GT(reflected, metalness == 0 ? 0.9 : 0.3);
                // Light from everywhere is reflected as the integral says.
                const f32::ReflectedParts parts = f32::reflectedParts(white, {0, 0, 1}, eye);
                EXPECT_NEAR(parts.matt.x + parts.mirrored.x, reflected, 0.08);
                EXPECT_LT(parts.matt.x + parts.mirrored.x, 1.001f);
                EXPECT_GE(std::min(parts.matt.x, parts.mirrored.x), 0.0f);
            }
}

TEST(ChannelLight, IsThePlainLightWhereItIsMattAlmost) {
    const glm::vec3 n(0, 0, 1), l = glm::normalize(glm::vec3(0.3f, 0.2f, 1));
    const f32::LitSurface matt = surfaceOf(glm::vec3(0.5f), 1, 0);
    EXPECT_NEAR(f32::reflectedPart(matt, n, l, n).x, 0.5f, 0.05f);
    EXPECT_NEAR(f32::lightUnderSky(0.5f + 0.5f * n.z, 0, 1), f32::colourOfLight(glm::vec3(f32::skylight(n, n))).x,
                1e-6f);
}

TEST(ChannelLight, StaysANumberFromAnywhere) {
    for (const double roughness : {0.0, 1.0})
        for (const float z : {1.0f, 1e-4f, 0.0f, -0.5f}) {
            const glm::vec3 d = glm::normalize(glm::vec3(1, 0, z)), n(0, 0, 1);
            for (const glm::vec3 light : {d, -d, n}) {
                const glm::vec3 found = f32::reflectedPart(surfaceOf(glm::vec3(1), roughness, 1), n, light, d);
                EXPECT_TRUE(std::isfinite(found.x) && found.x >= 0);
            }
        }
}

}  // namespace
}  // namespace vcp
