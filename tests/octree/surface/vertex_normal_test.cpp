// Normals of vertices: the grid that they are rounded to, and where a surface has a crease.
#include "octree/surface/vertex_normal.h"

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "octree/surface/leaf_math.h"
#include "octree/surface/packing.h"

namespace vcp {
namespace {

TEST(VertexNormal, GridPointsComeBackAndAreNear) {
    std::mt19937 random(9);
    for (int i = 0; i < 20000; ++i) {
        SCOPED_TRACE(i);
        const int bits = 1 + i % 40;
        const auto any = [&] { return int64_t(random() | uint64_t{random()} << 32) >> (63 - bits); };
        const WideVector sum(any(), any(), any());
        if (sum == WideVector(0)) continue;
        const bool crease = i % 2 != 0;
        const NormalGridPoint point = normalGridPoint(sum), turned = normalGridPoint(-sum);
        const uint32_t code = packGridNormal(point, crease);
        NormalGridPoint back{};
        ASSERT_TRUE(gridPointOf(code, back));
        ASSERT_EQ(back.u, point.u);
        ASSERT_EQ(back.v, point.v);
        ASSERT_EQ(turned.u, point.u) << "a normal has no side";
        ASSERT_EQ(turned.v, point.v);
        ASSERT_EQ((code & kNormalCreaseBit) != 0, crease);
        const glm::dvec3 n = glm::normalize(glm::dvec3(sum)), m = f64::decodeNormal(code);
        ASSERT_LT(glm::length(glm::cross(n, m)), 0.00122) << "0.07 degrees";
    }
}

TEST(VertexNormal, DirectionsOfAnyLengthArePacked) {
    std::mt19937 random(4);
    std::normal_distribution<double> any;
    for (int i = 0; i < 5000; ++i) {
        const glm::dvec3 n = glm::normalize(glm::dvec3(any(random), any(random), i % 7 == 0 ? 0.0 : any(random)));
        const uint32_t code = packDirection(n);
        const glm::dvec3 m = f64::decodeNormal(code);
        ASSERT_LT(glm::length(glm::cross(n, m)), 0.00122) << i;
        // On the rim of the grid, z = 0, a line has two codes.
        if (std::abs(n.z) > 0.01) {
            ASSERT_EQ(packDirection(m), code) << i << ": packed again";
        }
        ASSERT_LT(glm::length(glm::cross(m, f64::decodeNormal(packDirection(m)))), 0.00122) << i;
        for (const double scale : {-1.0, 1e-300, 1e300, -1e-12}) ASSERT_EQ(packDirection(scale * n), code) << i;
    }
    const double inf = std::numeric_limits<double>::infinity();
    for (const glm::dvec3& none : {glm::dvec3(0), glm::dvec3(1, inf, 0), glm::dvec3(-inf), glm::dvec3(0, inf - inf, 1)})
        EXPECT_EQ(packDirection(none), kUnknownNormal);
    NormalGridPoint point{};
    EXPECT_FALSE(gridPointOf(kUnknownNormal, point));
}

TEST(VertexNormal, CreasesTurnByFortyDegrees) {
    for (const int degrees : {0, 10, 38, 42, 80, 138, 142, 180}) {
        const double a = degrees * 3.14159265358979 / 180;
        const WideVector sum(0, 0, 1 << 20);
        const WideVector normal(int64_t(std::sin(a) * 1e6), 0, int64_t(std::cos(a) * 1e6));
        const std::vector<std::array<uint32_t, 3>> triangles{{0, 0, 0}};
        EXPECT_EQ(creases(std::span(&normal, 1), std::span(&sum, 1), triangles)[0] != 0, degrees > 40 && degrees < 140)
            << degrees;
    }
}

TEST(VertexNormal, SliversAloneMakeNoCrease) {
    const WideVector sum(0, 0, 1 << 20), sliver(1 << 15, 0, 0);
    const std::vector<std::array<uint32_t, 3>> corner{{0, 1, 2}};
    const std::vector<WideVector> sums(3, sum);
    EXPECT_EQ(creases(std::span(&sliver, 1), sums, corner)[0], 1) << "without a share any triangle counts";
    EXPECT_EQ(creases(std::span(&sliver, 1), sums, corner, 16)[0], 0) << "1 of 32";
    EXPECT_EQ(creases(std::span(&sliver, 1), sums, corner, 32)[0], 1);
    const std::vector<WideVector> slivers(2, sliver);
    const std::vector<std::array<uint32_t, 3>> both{{0, 1, 2}, {0, 2, 1}};
    EXPECT_EQ(creases(slivers, sums, both, 16)[0], 1) << "2 of 32";
}

}  // namespace
}  // namespace vcp
