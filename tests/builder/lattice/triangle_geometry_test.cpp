// Closest points, overlaps and clipping against slow references in long double.
#include "builder/lattice/triangle_geometry.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace vcp {
namespace {

using Long = long double;
using Long3 = glm::vec<3, long double>;

Long segmentSquared(Long3 p, Long3 a, Long3 b) {
    const Long3 u = b - a;
    const Long uu = glm::dot(u, u);
    const Long w = uu > 0 ? std::clamp<Long>(glm::dot(p - a, u) / uu, 0, 1) : 0;
    const Long3 d = a + w * u - p;
    return glm::dot(d, d);
}

/// Least distance to edges and, where the foot of the perpendicular is inside, to the plane.
Long slowDistance(glm::dvec3 query, const Triangle3& t) {
    const Long3 p(query), a(t[0]), b(t[1]), c(t[2]);
    Long best = std::min({segmentSquared(p, a, b), segmentSquared(p, b, c), segmentSquared(p, c, a)});
    const Long3 n = glm::cross(b - a, c - a);
    const Long nn = glm::dot(n, n);
    if (nn > 0) {
        const bool inside = glm::dot(glm::cross(b - a, p - a), n) >= 0 && glm::dot(glm::cross(c - b, p - b), n) >= 0 &&
                            glm::dot(glm::cross(a - c, p - c), n) >= 0;
        const Long h = glm::dot(p - a, n);
        if (inside) best = std::min(best, h * h / nn);
    }
    return std::sqrt(best);
}

class Points {
public:
    explicit Points(uint64_t seed) : random_(seed) {}
    double unit() { return std::uniform_real_distribution<double>(0, 1)(random_); }
    glm::dvec3 point(double scale = 1) { return scale * (glm::dvec3(unit(), unit(), unit()) - 0.5); }
    /// On the lattice of 1/2048, as all triangles of pages are.
    glm::dvec3 latticePoint(double scale) { return glm::round(point(scale) * 2048.0) / 2048.0; }
    int integer(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }

private:
    std::mt19937_64 random_;
};

void expectClosest(glm::dvec3 query, const Triangle3& t, double scale, uint64_t seed) {
    const ClosestPoint c = closestOnTriangle(query, t);
    const double truth = double(slowDistance(query, t));
    ASSERT_NEAR(std::sqrt(c.squared), truth, 1e-9 * scale) << "seed " << seed;
    ASSERT_NEAR(c.squared, glm::dot(c.offset, c.offset), 1e-12 * scale * scale) << "seed " << seed;
    // The answer is a point of the triangle, and the weights say which.
    ASSERT_LT(double(slowDistance(query + c.offset, t)), 1e-9 * scale) << "seed " << seed;
    ASSERT_NEAR(c.weights.x + c.weights.y + c.weights.z, 1, 1e-9);
    ASSERT_GE(std::min({c.weights.x, c.weights.y, c.weights.z}), -1e-9) << "seed " << seed;
}

TEST(ClosestOnTriangle, RandomTriangles) {
    for (uint64_t seed = 0; seed < 50000; ++seed) {
        Points p(seed);
        const Triangle3 t{p.point(), p.point(), p.point()};
        const glm::dvec3 query = p.point(2);
        ASSERT_NO_FATAL_FAILURE(expectClosest(query, t, 2, seed));
        const ClosestPoint c = closestOnTriangle(query, t);
        const glm::dvec3 at = c.weights.x * t[0] + c.weights.y * t[1] + c.weights.z * t[2];
        ASSERT_LT(glm::length(at - query - c.offset), 1e-9) << seed;
    }
}

TEST(ClosestOnTriangle, Slivers) {
    for (uint64_t seed = 0; seed < 50000; ++seed) {
        Points p(seed);
        const glm::dvec3 a = p.point(), b = p.point();
        const Triangle3 t{a, b, a + (b - a) * p.unit() + p.point(1e-6)};  // aspect about 1e6
        const glm::dvec3 near = a + (b - a) * p.unit() + p.point(p.integer(0, 1) ? 1e-5 : 1.0);
        ASSERT_NO_FATAL_FAILURE(expectClosest(near, t, 2, seed));
    }
}

TEST(ClosestOnTriangle, SegmentsAndPoints) {
    for (uint64_t seed = 0; seed < 20000; ++seed) {
        Points p(seed);
        const glm::dvec3 a = p.latticePoint(4), b = p.latticePoint(4), query = p.point(6);
        for (const Triangle3& t : {Triangle3{a, b, b}, Triangle3{a, a, b}, Triangle3{a, b, a}, Triangle3{a, a, a},
                                   Triangle3{a, b, (a + b) / 2.0}}) {
            const ClosestPoint c = closestOnTriangle(query, t);
            ASSERT_NEAR(std::sqrt(c.squared), double(slowDistance(query, t)), 1e-12) << seed;
        }
        const ClosestPoint self = closestOnTriangle(a, {a, b, b});
        ASSERT_EQ(self.squared, 0);
    }
}

TEST(ClosestOnTriangle, FarQueries) {
    for (uint64_t seed = 0; seed < 10000; ++seed) {
        Points p(seed);
        const Triangle3 t{p.latticePoint(4), p.latticePoint(4), p.latticePoint(4)};
        const glm::dvec3 query = p.point(2000);
        const ClosestPoint c = closestOnTriangle(query, t);
        ASSERT_NEAR(std::sqrt(c.squared), double(slowDistance(query, t)), 1e-9) << seed;
    }
}

TEST(ClosestOnTriangle, OnTheTriangleItself) {
    for (uint64_t seed = 0; seed < 10000; ++seed) {
        Points p(seed);
        const Triangle3 t{p.latticePoint(4), p.latticePoint(4), p.latticePoint(4)};
        double u = p.unit(), v = p.unit();
        if (u + v > 1) u = 1 - u, v = 1 - v;
        const glm::dvec3 on = t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0]);
        ASSERT_LT(std::sqrt(closestOnTriangle(on, t).squared), 1e-14 * 100) << seed;
        for (const glm::dvec3& corner : t) ASSERT_EQ(closestOnTriangle(corner, t).squared, 0) << seed;
    }
}

TEST(SquaredDistances, AreThoseOfTheTriangles) {
    for (uint64_t seed = 0; seed < 20000; ++seed) {
        Points p(seed);
        const glm::dvec3 query = p.latticePoint(4);
        TriangleBatch batch;
        Triangle3 triangles[TriangleBatch::kSize];
        for (int i = 0; i < TriangleBatch::kSize; ++i) {
            Triangle3& t = triangles[i];
            t = {p.latticePoint(4), p.latticePoint(4), p.latticePoint(4)};
            if (i % 4 == 1) t[1] = t[0] + glm::round(p.point(0.01) * 2048.0) / 2048.0;  // a needle
            if (i % 4 == 2) t[2] = (t[0] + t[1]) / 2.0;                                 // no area
            if (i == 3) t[2] = t[1] = t[0];
            if (i == 7) t[0] = query;
            for (int c = 0; c < 9; ++c) batch.corners[c][i] = float(t[c / 3][c % 3]);
            for (glm::dvec3& corner : t) corner = glm::dvec3(glm::vec3(corner));
        }
        squaredDistances(query, batch);
        for (int i = 0; i < TriangleBatch::kSize; ++i) {
            const double exact = closestOnTriangle(query, triangles[i]).squared;
            ASSERT_NEAR(batch.squared[i], exact, 1e-12 * exact) << "seed " << seed << " triangle " << i;
        }
        ASSERT_EQ(batch.squared[7], 0);
    }
}

/// Clips with exact decisions: lattice coordinates are scaled to integers, and so are the box's.
/// Sutherland and Hodgman in long double: inputs of 24 bits keep cut points exact far beyond what is asked.
std::vector<Long3> slowClip(const Triangle3& t, glm::dvec3 lower, glm::dvec3 upper) {
    std::vector<Long3> polygon{Long3(t[0]), Long3(t[1]), Long3(t[2])};
    for (int axis = 0; axis < 3; ++axis)
        for (const int side : {0, 1}) {
            std::vector<Long3> next;
            const auto inside = [&](const Long3& p) {
                return side == 0 ? p[axis] - Long(lower[axis]) : Long(upper[axis]) - p[axis];
            };
            for (size_t i = 0; i < polygon.size(); ++i) {
                const Long3 a = polygon[i], b = polygon[(i + 1) % polygon.size()];
                const Long da = inside(a), db = inside(b);
                if (da >= 0) next.push_back(a);
                if ((da < 0) != (db < 0)) next.push_back(a + (b - a) * (da / (da - db)));
            }
            polygon = next;
        }
    return polygon;
}

Long slowArea(const std::vector<Long3>& polygon) {
    Long3 sum(0);
    for (size_t i = 1; i + 1 < polygon.size(); ++i)
        sum += glm::cross(polygon[i] - polygon[0], polygon[i + 1] - polygon[0]);
    return glm::length(sum) / 2;
}

TEST(BoxOverlap, ClippedPolygonIsNotEmpty) {
    int overlaps = 0, differences = 0;
    for (uint64_t seed = 0; seed < 100000; ++seed) {
        Points p(seed);
        const Triangle3 t{p.latticePoint(4), p.latticePoint(4), p.latticePoint(4)};
        const double half = p.integer(1, 16) / 16.0;
        const glm::dvec3 centre = p.latticePoint(4);
        const bool fast = BoxOverlap(t).test(centre, half), slow = !slowClip(t, centre - half, centre + half).empty();
        overlaps += slow;
        // Never is an overlap denied; what is only touched within 1e-9 may be granted.
        ASSERT_TRUE(fast || !slow) << "seed " << seed;
        if (fast && !slow) {
            ++differences;
            ASSERT_FALSE(slowClip(t, centre - half - 1e-8, centre + half + 1e-8).empty()) << "seed " << seed;
        }
    }
    EXPECT_GT(overlaps, 10000);
    EXPECT_LT(differences, 50);
}

TEST(BoxOverlap, TouchingIsOverlap) {
    // Small integer coordinates: corners on faces, edges through edges, planes through corners, all the time.
    int touching = 0;
    for (uint64_t seed = 0; seed < 100000; ++seed) {
        Points p(seed);
        Triangle3 t;
        for (glm::dvec3& corner : t) corner = glm::dvec3(p.integer(-3, 3), p.integer(-3, 3), p.integer(-3, 3));
        const bool slow = !slowClip(t, glm::dvec3(-1), glm::dvec3(1)).empty();
        const bool within = !slowClip(t, glm::dvec3(-1 + 1e-6), glm::dvec3(1 - 1e-6)).empty();
        touching += slow && !within;
        const bool fast = BoxOverlap(t).test(glm::dvec3(0), 1);
        ASSERT_TRUE(fast || !slow) << "seed " << seed;
        if (fast && !slow) {
            ASSERT_FALSE(slowClip(t, glm::dvec3(-1 - 1e-8), glm::dvec3(1 + 1e-8)).empty()) << "seed " << seed;
        }
    }
    EXPECT_GT(touching, 1000);
}

TEST(BoxOverlap, BoundsAreTheTriangles) {
    const BoxOverlap overlap({glm::dvec3(1, 5, -2), glm::dvec3(0, 7, 3), glm::dvec3(2, 6, 0)});
    EXPECT_EQ(overlap.lower(), glm::dvec3(0, 5, -2));
    EXPECT_EQ(overlap.upper(), glm::dvec3(2, 7, 3));
}

TEST(ClipToBox, AreasAndPoints) {
    Polygon polygon;
    for (uint64_t seed = 0; seed < 50000; ++seed) {
        Points p(seed);
        const Triangle3 t{p.latticePoint(4), p.latticePoint(4), p.latticePoint(4)};
        const glm::dvec3 centre = p.latticePoint(2);
        const double half = p.integer(1, 16) / 16.0;
        clipToBox(t, centre - half, centre + half, polygon);
        std::vector<Long3> fast;
        for (const glm::dvec3& q : polygon) {
            fast.emplace_back(q);
            for (int axis = 0; axis < 3; ++axis) ASSERT_LE(std::abs(q[axis] - centre[axis]), half + 1e-12) << seed;
            ASSERT_LT(double(slowDistance(q, t)), 1e-12) << seed;
        }
        ASSERT_NEAR(double(slowArea(fast)), double(slowArea(slowClip(t, centre - half, centre + half))), 1e-11) << seed;
        ASSERT_LE(polygon.size(), 9u);
    }
}

TEST(ClipToBox, BoxesThatTileKeepTheArea) {
    Polygon polygon;
    for (uint64_t seed = 0; seed < 500; ++seed) {
        Points p(seed);
        const Triangle3 t{p.point(4), p.point(4), p.point(4)};
        Long sum = 0;
        for (int z = -2; z < 2; ++z)
            for (int y = -2; y < 2; ++y)
                for (int x = -2; x < 2; ++x) {
                    clipToBox(t, glm::dvec3(x, y, z), glm::dvec3(x + 1, y + 1, z + 1), polygon);
                    std::vector<Long3> part;
                    for (const glm::dvec3& q : polygon) part.emplace_back(q);
                    sum += slowArea(part);
                }
        const Long whole = slowArea({Long3(t[0]), Long3(t[1]), Long3(t[2])});
        ASSERT_NEAR(double(sum), double(whole), 1e-12) << seed;
    }
}

TEST(SegmentMeetsBox, AgreesWithClipping) {
    int meets = 0;
    for (uint64_t seed = 0; seed < 100000; ++seed) {
        Points p(seed);
        const bool coarse = seed % 2 == 0;
        const auto any = [&] {
            return coarse ? glm::dvec3(p.integer(-3, 3), p.integer(-3, 3), p.integer(-3, 3)) : p.latticePoint(6);
        };
        const glm::dvec3 a = any(), b = any();
        // A segment is a triangle of two corners to the slow clipper.
        const auto slow = [&](double half) {
            return !slowClip({a, b, b}, glm::dvec3(-half), glm::dvec3(half)).empty();
        };
        const bool fast = segmentMeetsBox(a, b, glm::dvec3(0), 1);
        meets += fast;
        if (slow(1)) {
            ASSERT_TRUE(fast) << seed;
        }
        if (!slow(1 + 1e-8)) {
            ASSERT_FALSE(fast) << seed;
        }
    }
    EXPECT_GT(meets, 10000);
}

}  // namespace
}  // namespace vcp
