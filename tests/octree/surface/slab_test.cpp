// Slab leaves: the packed slab holds what it was packed for, and no ray slips through what it holds.
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "octree/surface/leaf_math.h"
#include "octree/surface/packing.h"

namespace vcp {
namespace {

const double kSlack = double(kSlabSlack);

class Dice {
public:
    explicit Dice(uint64_t seed) : random_(seed) {}
    double unit() { return std::uniform_real_distribution<double>(0, 1)(random_); }
    uint32_t below(uint32_t n) { return uint32_t(random_() % n); }
    glm::dvec3 inCube() { return {unit(), unit(), unit()}; }
    glm::dvec3 direction() {
        std::normal_distribution<double> normal;
        return glm::normalize(glm::dvec3(normal(random_), normal(random_), normal(random_)));
    }

private:
    std::mt19937_64 random_;
};

glm::dvec3 directionOf(uint32_t code) { return f64::decodeDirection(code >> kSlabDirectionShift); }
double heightOver(uint32_t code, glm::dvec3 x) { return glm::dot(directionOf(code), x - 0.5) - f64::slabOffset(code); }

TEST(SlabPacking, DirectionsLoseLittle) {
    Dice dice(1);
    double worst = 0;
    for (int i = 0; i < 200000; ++i) {
        const glm::dvec3 n = dice.direction();
        const uint32_t code = packSlabDirection(n);
        ASSERT_LT(code, 1u << 20);
        ASSERT_EQ(code, packSlabDirection(-n)) << "n and -n mean the same planes";
        const glm::dvec3 back = f64::decodeDirection(code);
        const double along = std::abs(glm::dot(n, back));
        worst = std::max(worst, glm::length(glm::cross(n, back)));
        // None of the neighbouring codes is nearer.
        for (int dx = -1; dx <= 1; ++dx)
            for (int dy = -1; dy <= 1; ++dy) {
                const int x = int(code & 1023u) + dx, y = int(code >> 10) + dy;
                if (std::min(x, y) < 0 || std::max(x, y) > 1023) continue;
                ASSERT_LE(std::abs(glm::dot(n, f64::decodeDirection(uint32_t(x) | uint32_t(y) << 10))), along + 1e-15);
            }
    }
    EXPECT_LT(worst, 0.0042);  // 0.24 degrees
    // The component of largest magnitude is positive; the first of equals decides.
    for (const glm::dvec3 n : {glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1)})
        for (const double side : {-1.0, 1.0}) {
            EXPECT_GT(glm::dot(f64::decodeDirection(packSlabDirection(side * n)), n), 0.999);
            EXPECT_GT(f64::decodeDirection(packSlabDirection(side * glm::normalize(glm::dvec3(1, -1, 0)))).x, 0.7);
        }
}

TEST(SlabPacking, OffsetsReachTheCornersAndZeroIsExact) {
    EXPECT_EQ(f64::slabOffset(kSlabOffsetZero), 0);
    EXPECT_GE(f64::slabOffset(kSlabOffsetMask), std::sqrt(0.75));
    EXPECT_EQ(f64::slabOffset(1), -f64::slabOffset(kSlabOffsetMask));
    EXPECT_GE(f64::slabHalfThickness(kSlabThicknessMask << kSlabThicknessShift), std::sqrt(0.75) + kSlack);
    EXPECT_EQ(f64::slabHalfThickness(0), 0);
}

TEST(SlabPacking, SlabsHoldWhatTheyWerePackedFor) {
    Dice dice(2);
    for (int i = 0; i < 300000; ++i) {
        const uint32_t direction = packSlabDirection(dice.direction());
        // Planes, thin slabs, thick ones, and such as reach beyond the leaf.
        const double width = i % 4 == 0 ? 0 : std::pow(10.0, -4 + 4.5 * dice.unit());
        const double first = -1 + 2 * dice.unit(), last = first + width;
        const uint32_t code = packSlab(direction, first, last);
        ASSERT_EQ(code >> kSlabDirectionShift, direction);
        const double corner = std::sqrt(0.75), middle = f64::slabOffset(code), half = f64::slabHalfThickness(code);
        const double low = std::clamp(first, -corner, corner), high = std::clamp(last, -corner, corner);
        ASSERT_LE(middle - half, low - kSlack);
        ASSERT_GE(middle + half, high + kSlack);
        // No thinner slab of the code does, wherever it lies.
        const uint32_t thickness = code >> kSlabThicknessShift & kSlabThicknessMask;
        for (uint32_t offset = 0; thickness > 0 && offset <= kSlabOffsetMask; ++offset) {
            const uint32_t thinner = offset | (thickness - 1) << kSlabThicknessShift;
            const double at = f64::slabOffset(thinner), reach = f64::slabHalfThickness(thinner);
            ASSERT_FALSE(at - reach <= low - kSlack && high + kSlack <= at + reach) << i;
        }
    }
}

TEST(SlabPacking, PointsStayInTheSlabInSinglePrecision) {
    Dice dice(3);
    for (int i = 0; i < 100000; ++i) {
        const uint32_t direction = packSlabDirection(dice.direction());
        const glm::dvec3 n = f64::decodeDirection(direction);
        const std::array<glm::dvec3, 3> points{dice.inCube(), dice.inCube(), dice.inCube()};
        double first = 1, last = -1;
        for (const glm::dvec3 x : points) {
            first = std::min(first, glm::dot(n, x - 0.5));
            last = std::max(last, glm::dot(n, x - 0.5));
        }
        const uint32_t code = packSlab(direction, first, last);
        for (const glm::dvec3 x : points) {
            ASSERT_LE(std::abs(heightOver(code, x)), f64::slabHalfThickness(code) - kSlack);
            // The leaf may be one of 1/8 cell in a page of 128: its points have been rounded by 2^-17 cells.
            const glm::vec3 rounded = glm::vec3((x + 1016.0) / 8.0) * 8.0f - 1016.0f;
            const float height =
                glm::dot(f32::decodeDirection(code >> kSlabDirectionShift), rounded - 0.5f) - f32::slabOffset(code);
            ASSERT_LE(std::abs(height), f32::slabHalfThickness(code));
        }
    }
}

TEST(SlabPacking, NodeWordsHaveTheirParts) {
    for (const uint32_t octants : {1u, 0x80u, 0xffu})
        for (const uint32_t vector : {0u, 77u, kSlabVectorMask}) {
            const uint32_t word = slabNode(octants, vector);
            EXPECT_EQ(nodeType(word), kNodeSlab);
            EXPECT_EQ(word >> kSlabOctantsShift & kSlabOctantsMask, octants);
            EXPECT_EQ(word & kSlabVectorMask, vector);
        }
}

/// A segment of a ray in a leaf: from the wall by which it enters to the one by which it leaves.
struct Segment {
    glm::dvec3 p, d;
};

/// The part of the line through x along `direction` within the leaf; x in it.
Segment segmentThrough(glm::dvec3 x, glm::dvec3 direction) {
    double first = -1e30, last = 1e30;
    for (int axis = 0; axis < 3; ++axis) {
        if (direction[axis] == 0) continue;
        const double a = -x[axis] / direction[axis], b = (1 - x[axis]) / direction[axis];
        first = std::max(first, std::min(a, b));
        last = std::min(last, std::max(a, b));
    }
    return {glm::clamp(x + first * direction, 0.0, 1.0), (last - first) * direction};
}

uint32_t octantOf(glm::dvec3 x) { return (x.x >= 0.5 ? 1u : 0u) | (x.y >= 0.5 ? 2u : 0u) | (x.z >= 0.5 ? 4u : 0u); }

/// How far a point is outside of the nearest octant that is named: 0 within.
double outsideOctants(uint32_t octants, glm::dvec3 x) {
    double least = 2;
    for (uint32_t o = 0; o < 8; ++o) {
        if ((octants >> o & 1u) == 0) continue;
        const glm::dvec3 low = glm::dvec3(o & 1u, o >> 1 & 1u, o >> 2 & 1u) * 0.5;
        const glm::dvec3 away = glm::max(glm::max(low - x, x - low - 0.5), 0.0);
        least = std::min(least, std::max({away.x, away.y, away.z}));
    }
    return least;
}

/// A ray through a point of a slab and an octant that is named, of every kind: along axes, in middle planes, in the
/// slab's plane.
struct Throw {
    uint32_t code = 0, octants = 0;
    glm::dvec3 point{0};
    Segment segment;
};

Throw throwRay(Dice& dice, int kind) {
    Throw t;
    const uint32_t direction = packSlabDirection(kind % 5 == 0 ? glm::dvec3(0, 0, 1) : dice.direction());
    const glm::dvec3 n = f64::decodeDirection(direction);
    t.point = dice.inCube();
    glm::dvec3 along = dice.direction();
    if (kind % 3 == 1) along = glm::dvec3(0), along[int(dice.below(3))] = dice.below(2) == 0 ? 1 : -1;
    if (kind % 7 == 2) along = glm::normalize(glm::cross(n, along));
    if (kind % 4 == 3) {
        // Within a middle plane, where either octant holds the point.
        const int axis = int(dice.below(3));
        t.point[axis] = 0.5;
        along[axis] = 0;
        if (glm::length(along) < 1e-3) along = glm::dvec3(0), along[(axis + 1) % 3] = 1;
        along = glm::normalize(along);
    }
    if (kind % 11 == 4) along = glm::normalize(along * glm::dvec3(1, 1e-7, 1e-9));
    const double at = glm::dot(n, t.point - 0.5), thick = std::pow(10.0, -3 * dice.unit());
    t.code = packSlab(direction, at - thick * dice.unit(), at + thick * dice.unit());
    t.octants = dice.below(256);
    uint32_t own = octantOf(t.point);
    for (int axis = 0; axis < 3; ++axis)
        if (t.point[axis] == 0.5 && dice.below(2) == 0) own ^= 1u << axis;
    t.octants |= 1u << own;
    t.segment = segmentThrough(t.point, along);
    return t;
}

/// Whether some point of the segment before u - tolerance is well inside the slab and a named octant.
bool isInsideBefore(const Throw& t, double u, double tolerance) {
    constexpr int kSteps = 200;
    for (int i = 0; i <= kSteps; ++i) {
        const double at = double(i) / kSteps;
        if (at >= u - tolerance) return false;
        const glm::dvec3 x = t.segment.p + at * t.segment.d;
        const bool inSlab = std::abs(heightOver(t.code, x)) < f64::slabHalfThickness(t.code) - kSlack;
        if (inSlab && outsideOctants(t.octants, x) == 0) {
            // The piece that is hit begins here or before; within it the hit may lie at its end.
            bool reaches = true;
            for (double v = at; v < u && reaches; v += 0.002) {
                const glm::dvec3 y = t.segment.p + v * t.segment.d;
                reaches = std::abs(heightOver(t.code, y)) <= f64::slabHalfThickness(t.code) + kSlack &&
                          outsideOctants(t.octants, y) <= 2 * kSlack;
            }
            return !reaches;
        }
    }
    return false;
}

void expectGoodHit(const Throw& t, double u, double rounding, int i) {
    ASSERT_GE(u, 0) << i << ": the ray slipped through";
    ASSERT_LE(u, 1) << i;
    const glm::dvec3 hit = t.segment.p + u * t.segment.d;
    ASSERT_LE(std::abs(heightOver(t.code, hit)), f64::slabHalfThickness(t.code) + rounding) << i;
    ASSERT_LE(outsideOctants(t.octants, hit), kSlack + rounding) << i;
    ASSERT_FALSE(isInsideBefore(t, u, 0.003)) << i << ": an earlier piece was passed";
}

TEST(SlabRays, NoRaySlipsThrough) {
    Dice dice(4);
    for (int i = 0; i < 60000 && !testing::Test::HasFatalFailure(); ++i) {
        const Throw t = throwRay(dice, i);
        expectGoodHit(t, f64::intersectSlab(t.code, t.octants, t.segment.p, t.segment.d), 1e-12, i);
    }
}

TEST(SlabRays, NoRaySlipsThroughInSinglePrecision) {
    Dice dice(5);
    for (int i = 0; i < 60000 && !testing::Test::HasFatalFailure(); ++i) {
        const Throw t = throwRay(dice, i);
        const float u = f32::intersectSlab(t.code, t.octants, glm::vec3(t.segment.p), glm::vec3(t.segment.d));
        expectGoodHit(t, double(u), 3e-6, i);
    }
}

TEST(SlabRays, RaysThatMeetNothingMiss) {
    Dice dice(6);
    int missed = 0;
    for (int i = 0; i < 100000; ++i) {
        Throw t = throwRay(dice, i);
        t.octants = 1u << dice.below(8);
        double nearest = 2;
        for (int k = 0; k <= 1000; ++k) {
            const glm::dvec3 x = t.segment.p + k * 1e-3 * t.segment.d;
            nearest = std::min(nearest, std::max(std::abs(heightOver(t.code, x)) - f64::slabHalfThickness(t.code),
                                                 outsideOctants(t.octants, x)));
        }
        if (nearest < 4e-3) continue;  // between the samples it may come near
        ++missed;
        ASSERT_EQ(f64::intersectSlab(t.code, t.octants, t.segment.p, t.segment.d), -1) << i;
        ASSERT_EQ(f32::intersectSlab(t.code, t.octants, glm::vec3(t.segment.p), glm::vec3(t.segment.d)), -1) << i;
    }
    EXPECT_GT(missed, 20000);
}

TEST(SlabRays, TheMiddlePlaneIsHitWhereAnOctantHoldsIt) {
    Dice dice(7);
    for (int i = 0; i < 50000; ++i) {
        const Throw t = throwRay(dice, i);
        const double before = heightOver(t.code, t.segment.p), after = heightOver(t.code, t.segment.p + t.segment.d);
        if (before * after >= 0) continue;
        const double u = f64::intersectSlab(t.code, 255, t.segment.p, t.segment.d);
        ASSERT_GE(u, 0);
        // With all octants, the first of the at most four pieces that the slab touches is hit: at the middle plane or
        // where it leaves towards it.
        const double crossing = before / (before - after);
        ASSERT_LE(u, crossing + 1e-9);
        if (std::abs(u - crossing) < 1e-9) continue;
        const glm::dvec3 end = t.segment.p + u * t.segment.d;
        const glm::dvec3 off = glm::abs(end - 0.5);
        ASSERT_LE(std::min({off.x, off.y, off.z}), kSlack + 1e-9) << "the piece ends at a middle plane of the leaf";
    }
}

TEST(SlabRays, ARayWithinAMiddlePlaneMeetsBothSides) {
    // Whatever side of the plane between octants the one with surface lies on.
    const uint32_t code = packSlab(packSlabDirection({0, 0, 1}), -0.01, 0.01);
    for (const uint32_t octants : {0x0fu, 0xf0u, 0x01u, 0x80u, 0x20u}) {
        const glm::dvec3 p(0, 0.5, 0.5), d(1, 0, 0);
        EXPECT_GE(f64::intersectSlab(code, octants, p, d), 0) << octants;
        EXPECT_GE(f32::intersectSlab(code, octants, glm::vec3(p), glm::vec3(d)), 0) << octants;
        EXPECT_GE(f32::intersectSlab(code, octants, glm::vec3(1, 0.5f, 0.5f), glm::vec3(-1, 0, 0)), 0) << octants;
        // A segment without length, in the middle of all octants.
        EXPECT_GE(f32::intersectSlab(code, octants, glm::vec3(0.5f), glm::vec3(0)), 0) << octants;
    }
    EXPECT_EQ(f32::intersectSlab(code, 0x01u, glm::vec3(0, 0.75f, 0.5f), glm::vec3(1, 0, 0)), -1);
    EXPECT_EQ(f32::intersectSlab(code, 0xffu, glm::vec3(0, 0.75f, 0.75f), glm::vec3(1, 0, 0)), -1);
}

}  // namespace
}  // namespace vcp
