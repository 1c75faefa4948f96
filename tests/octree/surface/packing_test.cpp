// Both packings of a vector to the closest point: bounds of what they lose, and codes that never change.
#include "octree/surface/packing.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "octree/surface/leaf_math.h"

namespace vcp {
namespace {

constexpr double kDegrees = 180 / 3.14159265358979323846;

glm::dvec3 randomUnitVector(std::mt19937_64& random) {
    std::normal_distribution<double> normal;
    return glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
}

double angleDegrees(glm::dvec3 a, glm::dvec3 b) {
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)) * kDegrees;
}

TEST(Packing, DefaultLosesLittle) {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> distance(0, std::sqrt(3.0));
    double angleSum = 0, angleMax = 0, distanceMax = 0;
    constexpr int kCount = 400000;
    for (int i = 0; i < kCount; ++i) {
        const glm::dvec3 n = randomUnitVector(random);
        const double d = distance(random);
        const uint32_t code = packVector(d, n, i % 2 == 1);
        const double angle = angleDegrees(f64::decodeDirection(code >> 11), n);
        angleSum += angle;
        angleMax = std::max(angleMax, angle);
        distanceMax = std::max(distanceMax, std::abs(f64::decodeDistance(code) - d));
        EXPECT_EQ(f64::decodeSide(code), i % 2 == 1 ? -1 : 1);
        EXPECT_EQ(f64::decodeSide(flipSide(code)), i % 2 == 1 ? 1 : -1);
    }
    RecordProperty("mean_degrees", std::to_string(angleSum / kCount));
    RecordProperty("max_degrees", std::to_string(angleMax));
    std::printf("default packing: direction mean %.4f max %.4f degrees, distance max %.2e leaf edges\n",
                angleSum / kCount, angleMax, distanceMax);
    EXPECT_LT(angleSum / kCount, 0.085);
    EXPECT_LT(angleMax, 0.24);
    EXPECT_LE(distanceMax, double(kPackedDistanceRange) / kPackedDistanceMax / 2 * 1.0001);
}

TEST(Packing, PapersLosesLittle) {
    std::mt19937_64 random(2);
    std::uniform_real_distribution<double> unit(0, 1);
    const double range = std::sqrt(3.0);
    double angleSum = 0, angleMax = 0, relativeMax = 0;
    constexpr int kCount = 400000;
    for (int i = 0; i < kCount; ++i) {
        const double d = 0.01 + (range - 0.01) * unit(random);
        const glm::dvec3 v = randomUnitVector(random) * d;
        const glm::dvec3 back = unpackVectorSpherical(packVectorSpherical(v, range), range);
        const double angle = angleDegrees(back, v);
        angleSum += angle;
        angleMax = std::max(angleMax, angle);
        // A step of the square root is 1/8191 of the root of the range.
        relativeMax = std::max(relativeMax, std::abs(glm::length(back) - d) / std::sqrt(d * range));
    }
    std::printf("paper's packing: direction mean %.4f max %.4f degrees, distance max %.2e of the root\n",
                angleSum / kCount, angleMax, relativeMax);
    EXPECT_LT(angleSum / kCount, 0.125);
    EXPECT_LT(angleMax, 0.25);
    EXPECT_LT(relativeMax, 1.05 / 8191);
}

TEST(Packing, DirectionIsKeptAtDistanceZero) {
    std::mt19937_64 random(3);
    for (int i = 0; i < 1000; ++i) {
        const glm::dvec3 n = randomUnitVector(random);
        const uint32_t code = packVector(0, n, false);
        EXPECT_EQ(f64::decodeDistance(code), 0);
        EXPECT_LT(angleDegrees(f64::decodeDirection(code >> 11), n), 0.24);
    }
    EXPECT_EQ(packVectorSpherical(glm::dvec3(0), 1), 0u);
}

TEST(Packing, AxesAndDiagonalsDecodeToUnitVectors) {
    for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
            for (int z = -1; z <= 1; ++z) {
                if (x == 0 && y == 0 && z == 0) continue;
                const glm::dvec3 n = glm::normalize(glm::dvec3(x, y, z));
                EXPECT_LT(angleDegrees(f64::decodeDirection(packVector(1, n, false) >> 11), n), 0.24) << x << y << z;
                EXPECT_LT(angleDegrees(f64::decodeNormal(packNormal(n, false)), n), 0.01) << x << y << z;
            }
}

TEST(Packing, EveryDirectionCodeIsAFiniteUnitVector) {
    double worst = 0;
    float worstSingle = 0;
    for (uint32_t code = 0; code < 1u << 20; ++code) {
        worst = std::max(worst, std::abs(glm::length(f64::decodeDirection(code)) - 1));
        worstSingle = std::max(worstSingle, std::abs(glm::length(f32::decodeDirection(code)) - 1));
        // The other bits of the word do not matter.
        ASSERT_EQ(f64::decodeDirection(code), f64::decodeDirection(code | 1u << 20));
    }
    EXPECT_LT(worst, 1e-14);  // fails for NaN, too
    EXPECT_LT(worstSingle, 1e-6f);
}

TEST(Packing, RepackingIsStable) {
    std::mt19937 random(4);
    for (int i = 0; i < 100000; ++i) {
        const uint32_t code = uint32_t(random());
        const glm::dvec3 n = f64::decodeDirection(code >> 11);
        const uint32_t again = packVector(f64::decodeDistance(code), n, (code >> 31) != 0);
        ASSERT_EQ(again & kPackedDistanceMax, code & kPackedDistanceMax);
        ASSERT_LT(angleDegrees(f64::decodeDirection(again >> 11), n), 1e-5) << code;
    }
}

TEST(Packing, DistanceIsClamped) {
    EXPECT_EQ(packVector(100, {0, 0, 1}, false) & kPackedDistanceMax, kPackedDistanceMax);
    EXPECT_EQ(f64::decodeDistance(packVector(100, {0, 0, 1}, false)), double(kPackedDistanceRange));
    EXPECT_GE(double(kPackedDistanceRange), std::sqrt(3.0));
}

TEST(Packing, GoldenCodes) {
    EXPECT_EQ(packVector(0, {0, 0, 1}, false), 512u << 11 | 512u << 21);
    EXPECT_EQ(packVector(0, {1, 0, 0}, true), 1023u << 11 | 512u << 21 | 1u << 31);
    EXPECT_EQ(packVector(double(kPackedDistanceRange), {0, -1, 0}, false), 2047u | 512u << 11);
    EXPECT_EQ(packNormal({0, 0, 1}, true), 16384u << 1 | 1u | 32768u << 16);
    EXPECT_EQ(pack21(1, 2, 3).x, 1u | 2u << 21);
    EXPECT_EQ(pack21(1, 2, 3).y, 3u << 10);
    EXPECT_EQ(packVectorSpherical({1, 0, 0}, 1), 8191u | 256u << 13);
}

TEST(Packing, VerticesComeBack) {
    std::mt19937 random(5);
    for (int i = 0; i < 10000; ++i) {
        const glm::u32vec3 v(random() & kField21Mask, random() & kField21Mask, random() & kField21Mask);
        const glm::u32vec2 code = pack21(v.x, v.y, v.z);
        EXPECT_EQ(unpack21(code), v);
        const glm::dvec3 exact = (glm::dvec3(v) - double(kLatticeBias)) / double(kLatticePerCell);
        EXPECT_EQ(f64::decodeVertex(code.x, code.y), exact);
        EXPECT_EQ(glm::dvec3(f32::decodeVertex(code.x, code.y)), exact);  // 21 bits fit in a float
    }
}

}  // namespace
}  // namespace vcp
