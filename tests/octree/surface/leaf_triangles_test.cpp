// Which triangles touch a cube, against clipping.
#include "octree/surface/leaf_triangles.h"

#include <algorithm>
#include <array>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace vcp {
namespace {

/// Whether a closed triangle touches a closed cube: for certain, or perhaps (clipped with a little room).
struct Touch {
    bool certain, perhaps;
};
Touch clipped(const std::array<glm::i32vec3, 3>& t, glm::i32vec3 lower, int edge) {
    const auto meets = [&](double room) {
        std::vector<glm::dvec3> polygon(t.begin(), t.end());
        for (int plane = 0; plane < 6 && !polygon.empty(); ++plane) {
            const int axis = plane / 2;
            const double side = plane % 2 != 0 ? 1 : -1;
            const double limit = (side > 0 ? lower[axis] + edge : -lower[axis]) + room;
            std::vector<glm::dvec3> kept;
            for (size_t i = 0; i < polygon.size(); ++i) {
                const glm::dvec3 p = polygon[i], q = polygon[(i + 1) % polygon.size()];
                const double dp = limit - side * p[axis], dq = limit - side * q[axis];
                if (dp >= 0) kept.push_back(p);
                if ((dp >= 0) != (dq >= 0)) kept.push_back(p + (q - p) * (dp / (dp - dq)));
            }
            polygon = kept;
        }
        return !polygon.empty();
    };
    return {meets(-1e-6), meets(1e-6)};
}

TEST(CubeTest, AgreesWithClipping) {
    std::mt19937 random(3);
    size_t touching = 0, apart = 0;
    for (int i = 0; i < 60000; ++i) {
        SCOPED_TRACE(i);
        const int range = 1 << (2 + i % 10);
        const auto any = [&] { return int(random() % unsigned(2 * range)) - range; };
        const std::array<glm::i32vec3, 3> t{glm::i32vec3(any(), any(), any()), glm::i32vec3(any(), any(), any()),
                                            glm::i32vec3(any(), any(), any())};
        const glm::i32vec3 lower(any(), any(), any());
        const int edge = 1 + int(random() % unsigned(range));
        const Touch expected = clipped(t, lower, edge);
        // The bounding boxes must overlap.
        bool boxes = true;
        for (int axis = 0; axis < 3; ++axis)
            boxes = boxes && std::min({t[0][axis], t[1][axis], t[2][axis]}) <= lower[axis] + edge &&
                    std::max({t[0][axis], t[1][axis], t[2][axis]}) >= lower[axis];
        if (!boxes) continue;
        const bool touches = CubeTest(t).touches(lower, edge);
        ASSERT_TRUE(touches || !expected.certain);
        ASSERT_TRUE(!touches || expected.perhaps);
        ++(touches ? touching : apart);
    }
    EXPECT_GT(touching, 5000u);
    EXPECT_GT(apart, 5000u);
}

TEST(CubeTest, OctantsAreTouchedAsCubesAre) {
    std::mt19937 random(5);
    size_t touched = 0, apart = 0;
    for (int i = 0; i < 60000; ++i) {
        SCOPED_TRACE(i);
        const int half = 1 << (i % 12), reach = half << (i % 3);
        const auto any = [&] { return int(random() % unsigned(2 * reach + 1)) - reach; };
        const glm::i32vec3 middle(any(), any(), any()), offset(any(), any(), any());
        std::array<glm::i32vec3, 3> t;
        for (glm::i32vec3& p : t) p = middle + offset / 2 + glm::i32vec3(any(), any(), any());
        const glm::i32vec3 low = glm::min(t[0], glm::min(t[1], t[2])), high = glm::max(t[0], glm::max(t[1], t[2]));
        // The bounding boxes must overlap.
        if (glm::any(glm::greaterThan(low, middle + half)) || glm::any(glm::lessThan(high, middle - half))) continue;
        const uint32_t among = octantsTouched(low, high, middle);
        uint32_t expected = 0;
        for (uint32_t o = 0; o < 8; ++o) {
            if ((among >> o & 1u) == 0) continue;
            const glm::i32vec3 upper(o & 1u, o >> 1 & 1u, o >> 2);
            const bool touches = CubeTest(t).touches(middle + half * (upper - 1), half);
            if (touches) expected |= 1u << o;
            ++(touches ? touched : apart);
        }
        ASSERT_EQ(CubeTest(t).touchedOctants(middle, half, among), expected);
    }
    EXPECT_GT(touched, 5000u);
    EXPECT_GT(apart, 5000u);
}

TEST(CubeTest, TouchingCounts) {
    const int e = 256;
    const glm::i32vec3 o(512, 512, 512);
    // In the plane of a face; at a corner; along an edge; a step away from each.
    EXPECT_TRUE(CubeTest({glm::i32vec3(768, 0, 0), {768, 2000, 0}, {768, 0, 2000}}).touches(o, e));
    EXPECT_FALSE(CubeTest({glm::i32vec3(769, 0, 0), {769, 2000, 0}, {769, 0, 2000}}).touches({513, 512, 512}, 255));
    EXPECT_TRUE(CubeTest({glm::i32vec3(768 * 3, 0, 0), {0, 768 * 3, 0}, {0, 0, 768 * 3}}).touches(o, e));
    EXPECT_FALSE(CubeTest({glm::i32vec3(768 * 3 + 1, 0, 0), {0, 768 * 3 + 1, 0}, {0, 0, 768 * 3 + 1}}).touches(o, e));
    // The largest triangle and page that there may be.
    const int far = kMaxEdgeSteps;
    const glm::i32vec3 corner(-far / 2, -far / 2, -far / 2);
    EXPECT_TRUE(CubeTest({corner, corner + glm::i32vec3(far, far, 0), corner + glm::i32vec3(far, 0, far)})
                    .touches(glm::i32vec3(0), kLatticePerCell << 7));
}

}  // namespace
}  // namespace vcp
