// The shared leaf maths against slow, obvious formulas; what holds here holds for the shader.
#include "octree/surface/leaf_math.h"

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "octree/surface/packing.h"

namespace vcp {
namespace {

/// Corner i of a leaf's 8, at (i & 1, i >> 1 & 1, i >> 2): signed distance and outward direction.
struct Corner {
    double distance;
    glm::dvec3 outward;
};
using Corners = std::array<Corner, 8>;

glm::dvec3 cornerOf(int i) { return {i & 1, i >> 1 & 1, i >> 2 & 1}; }

int cornerAt(glm::ivec3 p) { return p.x | p.y << 1 | p.z << 2; }

/// Which of the 8 corners is corner c of the face at `side` of `axis` (octree/shared/page_layout.h).
int faceCorner(uint32_t axis, int side, int c) {
    glm::ivec3 p;
    p[axis] = side;
    p[(axis + 1) % 3] = c & 1;
    p[(axis + 2) % 3] = c >> 1;
    return cornerAt(p);
}

/// The definition: f(x) = sum w_i (D_i + 1/2 N_i . (x - p_i)).
double definition(const Corners& corners, glm::dvec3 x) {
    double sum = 0;
    for (int i = 0; i < 8; ++i) {
        const glm::dvec3 p = cornerOf(i);
        double w = 1;
        for (int a = 0; a < 3; ++a) w *= p[a] > 0 ? x[a] : 1 - x[a];
        sum += w * (corners[i].distance + 0.5 * glm::dot(corners[i].outward, x - p));
    }
    return sum;
}

/// A leaf with these corners, not quantized.
f64::LeafField exactLeaf(const Corners& corners, uint32_t axis) {
    f64::LeafField leaf{};
    leaf.axis = axis;
    for (int c = 0; c < 4; ++c) {
        for (int side = 0; side < 2; ++side) {
            const int i = faceCorner(axis, side, c);
            const glm::dvec3 g = 0.5 * corners[i].outward;
            (side ? leaf.gx1 : leaf.gx0)[c] = g.x;
            (side ? leaf.gy1 : leaf.gy0)[c] = g.y;
            (side ? leaf.gz1 : leaf.gz0)[c] = g.z;
            (side ? leaf.a1 : leaf.a0)[c] = corners[i].distance - glm::dot(g, cornerOf(i));
        }
    }
    return leaf;
}

std::array<uint4, 2> packFaces(const Corners& corners, uint32_t axis, bool flip = false) {
    std::array<uint4, 2> faces;
    for (int side = 0; side < 2; ++side)
        for (int c = 0; c < 4; ++c) {
            const Corner& corner = corners[faceCorner(axis, side, c)];
            const bool inside = corner.distance < 0;
            const uint32_t code =
                packVector(std::abs(corner.distance), inside ? -corner.outward : corner.outward, inside);
            faces[side][c] = flip ? flipSide(code) : code;
        }
    return faces;
}

/// What the packed corners decode to, for comparing with the definition.
Corners decoded(const std::array<uint4, 2>& faces, uint32_t axis) {
    Corners corners;
    for (int side = 0; side < 2; ++side)
        for (int c = 0; c < 4; ++c) {
            const uint32_t code = faces[side][c];
            corners[faceCorner(axis, side, c)] = {f64::decodeSide(code) * f64::decodeDistance(code),
                                                  f64::decodeSide(code) * f64::decodeDirection(code >> 11)};
        }
    return corners;
}

Corners sphereCorners(glm::dvec3 centre, double radius) {
    Corners corners;
    for (int i = 0; i < 8; ++i) {
        const glm::dvec3 v = cornerOf(i) - centre;
        corners[i] = {glm::length(v) - radius, glm::normalize(v)};
    }
    return corners;
}

struct RandomLeaf {
    explicit RandomLeaf(uint64_t seed) : random(seed) {}
    std::mt19937_64 random;
    std::uniform_real_distribution<double> unit{0, 1};
    std::normal_distribution<double> normal;

    glm::dvec3 direction() { return glm::normalize(glm::dvec3(normal(random), normal(random), normal(random))); }
    glm::dvec3 inside() { return {unit(random), unit(random), unit(random)}; }
    /// A sphere of some curvature through the leaf.
    Corners sphere(double minRadius) {
        const double radius = minRadius / (0.02 + unit(random));
        return sphereCorners(inside() - direction() * radius, radius);
    }
};

TEST(LeafMath, ValueIsTheDefinitionOnEveryAxis) {
    RandomLeaf r(1);
    for (int i = 0; i < 2000; ++i) {
        const uint32_t axis = i % 3;
        const auto faces = packFaces(r.sphere(2), axis);
        const Corners corners = decoded(faces, axis);
        const f64::LeafField leaf = f64::decodeLeaf(faces[0], faces[1], axis);
        const f32::LeafField single = f32::decodeLeaf(faces[0], faces[1], axis);
        for (int k = 0; k < 10; ++k) {
            const glm::dvec3 x = r.inside();
            const double f = definition(corners, x);
            ASSERT_NEAR(f64::leafValue(leaf, x), f, 1e-13);
            ASSERT_NEAR(f32::leafValue(single, glm::vec3(x)), f, 2e-6);
        }
    }
}

TEST(LeafMath, RayValueIsTheValueOnTheRay) {
    RandomLeaf r(2);
    for (int i = 0; i < 3000; ++i) {
        const uint32_t axis = i % 3;
        const auto faces = packFaces(r.sphere(2), axis);
        const f64::LeafField leaf = f64::decodeLeaf(faces[0], faces[1], axis);
        const glm::dvec3 a = r.inside(), b = r.inside();
        const double u = r.unit(r.random);
        const double f = f64::leafValue(leaf, a + u * (b - a));
        ASSERT_NEAR(f64::rayValue(f64::restrictToRay(faces[0], faces[1], axis, a, b - a), u), f, 1e-13);
        ASSERT_NEAR(
            f32::rayValue(f32::restrictToRay(faces[0], faces[1], axis, glm::vec3(a), glm::vec3(b - a)), float(u)), f,
            3e-6);
    }
}

TEST(LeafMath, NormalIsTheBlendOfDirections) {
    RandomLeaf r(3);
    for (int i = 0; i < 2000; ++i) {
        const uint32_t axis = i % 3;
        const auto faces = packFaces(r.sphere(2), axis);
        const Corners corners = decoded(faces, axis);
        const glm::dvec3 x = r.inside();
        glm::dvec3 blend{0};
        for (int c = 0; c < 8; ++c) {
            double w = 1;
            for (int a = 0; a < 3; ++a) w *= cornerOf(c)[a] > 0 ? x[a] : 1 - x[a];
            blend += w * corners[c].outward;
        }
        const glm::dvec3 n = glm::normalize(f64::leafNormal(f64::decodeLeaf(faces[0], faces[1], axis), x));
        EXPECT_LT(glm::distance(n, glm::normalize(blend)), 1e-12);
    }
}

TEST(LeafMath, ExactForQuadrics) {
    // Given F and F' of any quadratic F at the corners, not quantized, the field is F itself.
    RandomLeaf r(4);
    for (int i = 0; i < 500; ++i) {
        double q[10];
        for (double& c : q) c = r.normal(r.random);
        const auto value = [&](glm::dvec3 p) {
            return q[0] * p.x * p.x + q[1] * p.y * p.y + q[2] * p.z * p.z + q[3] * p.x * p.y + q[4] * p.y * p.z +
                   q[5] * p.z * p.x + q[6] * p.x + q[7] * p.y + q[8] * p.z + q[9];
        };
        const auto gradient = [&](glm::dvec3 p) {
            return glm::dvec3(2 * q[0] * p.x + q[3] * p.y + q[5] * p.z + q[6],
                              2 * q[1] * p.y + q[3] * p.x + q[4] * p.z + q[7],
                              2 * q[2] * p.z + q[4] * p.y + q[5] * p.x + q[8]);
        };
        Corners corners;
        for (int c = 0; c < 8; ++c) corners[c] = {value(cornerOf(c)), gradient(cornerOf(c))};
        const f64::LeafField leaf = exactLeaf(corners, i % 3);
        for (int k = 0; k < 20; ++k) {
            const glm::dvec3 x = r.inside();
            ASSERT_NEAR(f64::leafValue(leaf, x), value(x), 1e-12);
        }
    }
}

TEST(LeafMath, ErrorIsOfThirdOrder) {
    // Distance to a torus, in leaves of edge h: the largest error of f divided by h falls like h^2 or faster,
    // so the error in world units like h^3.
    const auto torus = [](glm::dvec3 p) {
        const double around = std::hypot(p.x, p.y);
        const glm::dvec3 spine = glm::dvec3(p.x, p.y, 0) / around;
        const double r = glm::distance(p, spine);
        return Corner{r - 0.4, (p - spine) / r};
    };
    std::vector<double> worst;
    for (const double h : {0.1, 0.05, 0.025, 0.0125}) {
        RandomLeaf r(5);
        double error = 0;
        for (int i = 0; i < 4000; ++i) {
            // A leaf about a point of the surface.
            const double a = r.unit(r.random) * 6.283185307179586, b = r.unit(r.random) * 6.283185307179586;
            const glm::dvec3 at{(1 + 0.4 * std::cos(b)) * std::cos(a), (1 + 0.4 * std::cos(b)) * std::sin(a),
                                0.4 * std::sin(b)};
            const glm::dvec3 x = r.inside(), lowest = at - h * x;
            Corners corners;
            for (int c = 0; c < 8; ++c) {
                corners[c] = torus(lowest + h * cornerOf(c));
                corners[c].distance /= h;
            }
            error = std::max(error, h * std::abs(f64::leafValue(exactLeaf(corners, i % 3), x)));
        }
        worst.push_back(error);
    }
    for (size_t i = 1; i < worst.size(); ++i)
        EXPECT_GT(worst[i - 1] / worst[i], 7.0) << "halving " << i << ": " << worst[i];
}

TEST(LeafMath, ContinuousOverFacesOfAllAxes) {
    // Two neighbours share the four corners of a face, in whatever order their axes store them.
    RandomLeaf r(6);
    for (int i = 0; i < 3000; ++i) {
        const uint32_t across = i % 3, axisA = (i / 3) % 3, axisB = (i / 9) % 3;
        const glm::dvec3 n = r.direction(), through = r.inside();
        const double curve = 0.2 * r.unit(r.random);
        const auto at = [&](glm::dvec3 p) {
            const glm::dvec3 v = p - through;
            const glm::dvec3 g = n + curve * v;
            return Corner{glm::dot(n, v) * 0.5, glm::normalize(g)};
        };
        Corners a, b;
        glm::dvec3 shift{0};
        shift[across] = 1;
        for (int c = 0; c < 8; ++c) {
            a[c] = at(cornerOf(c));
            b[c] = at(cornerOf(c) + shift);
        }
        const auto facesA = packFaces(a, axisA), facesB = packFaces(b, axisB);
        const f64::LeafField leafA = f64::decodeLeaf(facesA[0], facesA[1], axisA);
        const f64::LeafField leafB = f64::decodeLeaf(facesB[0], facesB[1], axisB);
        const f32::LeafField singleA = f32::decodeLeaf(facesA[0], facesA[1], axisA);
        const f32::LeafField singleB = f32::decodeLeaf(facesB[0], facesB[1], axisB);
        for (int k = 0; k < 10; ++k) {
            glm::dvec3 x = r.inside();
            x[across] = 1;
            glm::dvec3 y = x;
            y[across] = 0;
            ASSERT_NEAR(f64::leafValue(leafA, x), f64::leafValue(leafB, y), 1e-13);
            ASSERT_LT(glm::distance(f64::leafNormal(leafA, x), f64::leafNormal(leafB, y)), 1e-13);
            ASSERT_NEAR(f32::leafValue(singleA, glm::vec3(x)), f32::leafValue(singleB, glm::vec3(y)),
                        float(kWallRounding));
            // A ray that leaves one enters the other with the same value.
            const glm::vec3 from(r.inside()), to(r.inside());
            const f32::RayField leaving = f32::restrictToRay(facesA[0], facesA[1], axisA, from, glm::vec3(x) - from);
            const f32::RayField entering =
                f32::restrictToRay(facesB[0], facesB[1], axisB, glm::vec3(y), to - glm::vec3(y));
            ASSERT_NEAR(leaving.last, entering.c.x, float(kWallRounding));
        }
    }
}

TEST(LeafMath, FlippingAllSidesFlipsTheField) {
    RandomLeaf r(7);
    for (int i = 0; i < 1000; ++i) {
        const Corners corners = r.sphere(2);
        const auto faces = packFaces(corners, i % 3), flipped = packFaces(corners, i % 3, true);
        const f32::LeafField a = f32::decodeLeaf(faces[0], faces[1], i % 3);
        const f32::LeafField b = f32::decodeLeaf(flipped[0], flipped[1], i % 3);
        const glm::vec3 p(r.inside()), d(r.inside() - glm::dvec3(p));
        ASSERT_EQ(f32::leafValue(a, p), -f32::leafValue(b, p));
        const float wall = i % 2 == 0 ? 0.0f : 0.01f;
        const f32::RayField rayA = f32::restrictToRay(faces[0], faces[1], i % 3, p, d);
        const f32::RayField rayB = f32::restrictToRay(flipped[0], flipped[1], i % 3, p, d);
        ASSERT_EQ(f32::firstCrossing(rayA, wall, wall, 1e30f, 5), f32::firstCrossing(rayB, wall, wall, 1e30f, 5));
    }
}

TEST(LeafMath, FirstCrossingAgainstDenseSampling) {
    RandomLeaf r(8);
    constexpr int kSamples = 2000;
    int crossings = 0, doubles = 0, missedDoubles = 0;
    double singleWorst = 0;
    for (int i = 0; i < 8000; ++i) {
        const uint32_t axis = i % 3;
        const auto faces = packFaces(r.sphere(i % 2 == 0 ? 1.5 : 0.4), axis);
        const glm::dvec3 p = r.inside(), d = r.inside() - p;
        const f64::RayField ray = f64::restrictToRay(faces[0], faces[1], axis, p, d);
        const double u = f64::firstCrossing(ray, 0, 0, 1e30, 64);
        int first = -1, changes = 0;
        for (int k = 0; k < kSamples; ++k) {
            const bool change =
                (f64::rayValue(ray, double(k) / kSamples) < 0) != (f64::rayValue(ray, double(k + 1) / kSamples) < 0);
            if (change && changes++ == 0) first = k;
        }
        if (first < 0) {
            // A crossing may hide between two samples, never the reverse.
            if (u >= 0) {
                ASSERT_NEAR(f64::rayValue(ray, u), 0, 1e-13) << i;
            }
            continue;
        }
        ++crossings;
        if (changes == 1) {
            ASSERT_GE(u, double(first) / kSamples - 1e-12) << i;
            ASSERT_LE(u, double(first + 1) / kSamples + 1e-12) << i;
            ASSERT_NEAR(f64::rayValue(ray, u), 0, 1e-13) << i;
            // In float with few steps the crossing is nearly the same.
            if (i % 2 == 1) continue;
            const f32::RayField single = f32::restrictToRay(faces[0], faces[1], axis, glm::vec3(p), glm::vec3(d));
            const float v = f32::firstCrossing(single, 0.0f, 0.0f, 1e30f, 4);
            singleWorst = std::max(singleWorst, std::abs(f64::rayValue(ray, v)));
        } else {
            ++doubles;
            if (!(std::abs(u * kSamples - first) < 2)) ++missedDoubles;
        }
    }
    EXPECT_GT(crossings, 1000);
    EXPECT_GT(doubles, 20);
    EXPECT_LE(missedDoubles, doubles / 10);
    EXPECT_LT(singleWorst, 0.02);
}

TEST(LeafMath, WallsCountWithinTheirTolerance) {
    // A plane just beyond the segment's far end, and just behind its near end.
    Corners corners;
    for (int i = 0; i < 8; ++i) corners[i] = {(cornerOf(i).z - 0.5) * 1.0, {0, 0, 1}};
    const f64::LeafField leaf = exactLeaf(corners, 0);
    const auto cross = [&](double from, double to, double wallIn, double wallOut) {
        const glm::dvec3 p(0.3, 0.3, from), d(0, 0, to - from);
        const f64::RayField ray =
            f64::blendOnRay(leaf.a0 + leaf.gx0 * p.x + leaf.gy0 * p.y + leaf.gz0 * p.z, leaf.gz0 * d.z,
                            leaf.a1 + leaf.gx1 * p.x + leaf.gy1 * p.y + leaf.gz1 * p.z, leaf.gz1 * d.z, p, d);
        return f64::firstCrossing(ray, wallIn, wallOut, 0.02, 32);
    };
    EXPECT_NEAR(cross(0.9, 0.1, 0, 0), 0.5, 1e-12);
    EXPECT_EQ(cross(0.9, 0.51, 0, 0.02), 1);
    EXPECT_EQ(cross(0.9, 0.51, 0, 0.005), -1);
    EXPECT_EQ(cross(0.49, 0.1, 0.02, 0), 0);
    EXPECT_EQ(cross(0.49, 0.1, 0, 0), -1);
    EXPECT_EQ(cross(0.5, 0.1, 0, 0), 0) << "a start on the surface is a hit";
}

TEST(LeafMath, AHitOnTheWallFacesTheSideTheRayComesFrom) {
    // The plane z = 0.5 under rays that enter by the wall x = 0 and graze it.
    Corners corners;
    for (int i = 0; i < 8; ++i) corners[i] = {(cornerOf(i).z - 0.5) * 1.0, {0, 0, 1}};
    const f64::LeafField leaf = exactLeaf(corners, 0);
    const auto upward = [&](double z, double rise, double wall) {
        const glm::dvec3 p(0, 0.3, z), d(0.5, 0, 0.5 * rise);
        const f64::RayField ray =
            f64::blendOnRay(leaf.a0 + leaf.gx0 * p.x + leaf.gy0 * p.y + leaf.gz0 * p.z, leaf.gz0 * d.z,
                            leaf.a1 + leaf.gx1 * p.x + leaf.gy1 * p.y + leaf.gz1 * p.z, leaf.gz1 * d.z, p, d);
        const double u = f64::firstCrossing(ray, wall, 0, 0.02, 32);
        EXPECT_GE(u, 0);
        const glm::dvec3 n = f64::facingNormal(f64::leafNormal(leaf, p + u * d), d, f64::sideBefore(ray, u, d));
        return n.z > 0;
    };
    EXPECT_TRUE(upward(0.51, -0.2, 0)) << "a crossing inside of the leaf, from above";
    EXPECT_FALSE(upward(0.49, 0.2, 0)) << "from below";
    EXPECT_TRUE(upward(0.49, -0.2, 0.02)) << "crossed before the wall, from above";
    EXPECT_FALSE(upward(0.51, 0.2, 0.02)) << "from below";
    EXPECT_TRUE(upward(0.51, 0.02, 0.02)) << "not crossed at all: the ray passes above and recedes";
    EXPECT_FALSE(upward(0.49, -0.02, 0.02)) << "below";
}

TEST(LeafMath, WallAndDipCodes) {
    EXPECT_EQ(f64::wallTolerance(kNodeSoft << kNodeTypeShift), double(kWallRounding));
    for (uint32_t code = 1; code <= kSoftWallMask; ++code)
        EXPECT_DOUBLE_EQ(f64::wallTolerance(kNodeSoft << kNodeTypeShift | code << kSoftWallShift),
                         double(kWallUnit) * code * code);
    double last = -1;
    for (uint32_t code = 0; code < 4; ++code) {
        const double dip = f64::dipBound(kNodeSoft << kNodeTypeShift | code << kSoftDipShift);
        EXPECT_GT(dip, last);
        last = dip;
    }
    EXPECT_GE(last, 1e30);
}

/// Barycentric intersection in long double, without slack: the obvious way.
struct Exact {
    bool inside;
    long double s;
    long double margin;  ///< smallest distance of the line to an edge's line, signed; below 0 outside
};
Exact exactTriangle(glm::dvec3 q, glm::dvec3 d, const std::array<glm::dvec3, 3>& v) {
    using L = glm::vec<3, long double>;
    const L a = L(v[0]) - L(q), b = L(v[1]) - L(q), c = L(v[2]) - L(q), dir(d);
    const L n = glm::cross(b - a, c - a);
    const long double nd = glm::dot(n, dir);
    const long double flip = nd < 0 ? -1 : 1;
    const long double w[3] = {flip * glm::dot(dir, glm::cross(b, c)) / glm::length(c - b),
                              flip * glm::dot(dir, glm::cross(c, a)) / glm::length(a - c),
                              flip * glm::dot(dir, glm::cross(a, b)) / glm::length(b - a)};
    const long double margin = std::min({w[0], w[1], w[2]});
    return {margin >= 0, glm::dot(n, a) / nd, margin};
}

TEST(LeafMath, TriangleAgainstLongDouble) {
    RandomLeaf r(10);
    constexpr double kSlack = 1e-4;
    int hits = 0;
    for (int i = 0; i < 50000; ++i) {
        std::array<glm::dvec3, 3> v = {r.inside(), r.inside(), r.inside()};
        if (i % 4 == 1) v[2] = glm::mix(v[0], v[1], r.unit(r.random)) + r.direction() * 1e-3;  // a sliver
        for (glm::dvec3& p : v) p = glm::round(p * 2048.0) / 2048.0;
        if (glm::length(glm::cross(v[1] - v[0], v[2] - v[0])) < 1e-4) continue;
        const glm::dvec3 d = r.direction();
        const glm::dvec3 q = r.inside() - d * r.unit(r.random);
        if (std::abs(glm::dot(glm::normalize(glm::cross(v[1] - v[0], v[2] - v[0])), d)) < 0.05) continue;
        const Exact exact = exactTriangle(q, d, v);
        const glm::dvec3 found = f64::intersectTriangle(q, d, v[0], v[1], v[2], kSlack);
        const glm::vec3 single = f32::intersectTriangle(glm::vec3(q), glm::vec3(d), glm::vec3(v[0]), glm::vec3(v[1]),
                                                        glm::vec3(v[2]), float(kSlack));
        if (exact.inside) {
            ++hits;
            ASSERT_NEAR(found.x, double(exact.s), 1e-9) << i;
            ASSERT_LT(single.x, 1e29f) << i << " in float";
            ASSERT_NEAR(single.x, double(exact.s), 2e-4) << i << " in float";
            const glm::dvec3 there = v[0] + found.y * (v[1] - v[0]) + found.z * (v[2] - v[0]);
            ASSERT_LT(glm::distance(there, q + found.x * d), 1e-9) << i;
        } else if (exact.margin < -kSlack - 1e-5) {
            ASSERT_GT(found.x, 1e29) << i;
            ASSERT_GT(single.x, 1e29f) << i << " in float";
        }
    }
    EXPECT_GT(hits, 1000);
}

TEST(LeafMath, NoRayBetweenTriangles) {
    // A fan of triangles about a point, and rays through its edges and the point itself.
    RandomLeaf r(11);
    for (int i = 0; i < 5000; ++i) {
        const glm::dvec3 n = r.direction(), u = glm::normalize(glm::cross(n, r.direction())), w = glm::cross(n, u);
        const glm::dvec3 centre = glm::round(r.inside() * 2048.0) / 2048.0;
        const int sides = 3 + i % 6;
        std::vector<glm::dvec3> rim;
        for (int k = 0; k < sides; ++k) {
            const double a = 6.283185307179586 * k / sides;
            rim.push_back(glm::round((centre + (std::cos(a) * u + std::sin(a) * w) * (0.2 + 0.6 * r.unit(r.random)) +
                                      n * 0.05 * r.unit(r.random)) *
                                     2048.0) /
                          2048.0);
        }
        const double along = i % 2 == 0 ? 0 : 0.8 * r.unit(r.random);
        const glm::dvec3 target = glm::mix(centre, rim[i % sides], along);
        glm::dvec3 d = r.direction();
        if (std::abs(glm::dot(d, n)) < 0.5) d = n;
        const glm::dvec3 q = target - d;
        bool hit = false;
        for (int k = 0; k < sides; ++k) {
            const glm::vec3 found = f32::intersectTriangle(glm::vec3(q), glm::vec3(d), glm::vec3(centre),
                                                           glm::vec3(rim[k]), glm::vec3(rim[(k + 1) % sides]), 1e-4f);
            hit = hit || (found.x < 1e29f && std::abs(found.x - 1) < 1e-3f);
        }
        ASSERT_TRUE(hit) << "fan " << i;
    }
}

TEST(LeafMath, HitsStayOnTheirTriangle) {
    // Grazing rays past an edge and needles thinner than the slack: a hit may be off the triangle by the
    // slack, not by how far its plane runs on.
    RandomLeaf r(12);
    double worst = 0;
    for (int i = 0; i < 200000; ++i) {
        std::array<glm::dvec3, 3> v = {r.inside(), r.inside(), r.inside()};
        if (i % 2 == 1) v[2] = glm::mix(v[0], v[1], r.unit(r.random)) + r.direction() * 5e-4;
        for (glm::dvec3& p : v) p = glm::round(p * 2048.0) / 2048.0;
        const glm::dvec3 n = glm::cross(v[1] - v[0], v[2] - v[0]);
        if (glm::length(n) == 0) continue;
        // A direction almost within the plane, past an edge.
        glm::dvec3 d = glm::normalize(glm::cross(n, r.direction()));
        d = glm::normalize(d + glm::normalize(n) * 1e-4 * r.normal(r.random));
        const glm::dvec3 past = glm::mix(v[i % 3], v[(i + 1) % 3], r.unit(r.random)) + r.direction() * 2e-4;
        const glm::dvec3 q = past - d;
        const glm::vec3 hit = f32::intersectTriangle(glm::vec3(q), glm::vec3(d), glm::vec3(v[0]), glm::vec3(v[1]),
                                                     glm::vec3(v[2]), 1e-4f);
        if (hit.x > 1e29f) continue;
        const glm::dvec3 on = v[0] + double(hit.y) * (v[1] - v[0]) + double(hit.z) * (v[2] - v[0]);
        worst = std::max(worst, glm::distance(on, q + double(hit.x) * d));
    }
    EXPECT_LT(worst, 5e-3);
}

TEST(LeafMath, DegenerateTrianglesAreMissed) {
    const glm::dvec3 a{0.5, 0.5, 0.5}, b{0.7, 0.5, 0.5};
    EXPECT_GT(f64::intersectTriangle({0.5, 0.5, 0}, {0, 0, 1}, a, a, a, 1e-4).x, 1e29);
    EXPECT_GT(f64::intersectTriangle({0.5, 0.5, 0}, {0, 0, 1}, a, b, a, 1e-4).x, 1e29);
    EXPECT_GT(f32::intersectTriangle({0.5f, 0.5f, 0}, {0, 0, 1}, glm::vec3(a), glm::vec3(b), glm::vec3(a), 1e-4f).x,
              1e29f);
}

}  // namespace
}  // namespace vcp
