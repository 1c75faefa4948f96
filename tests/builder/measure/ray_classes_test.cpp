// Ray classes and holes, on surfaces whose faults are known because the test made them.
#include "builder/measure/ray_classes.h"

#include <gtest/gtest.h>

#include "tests/support/test_meshes.h"

namespace vcp {
namespace {

constexpr double kCellEdge = 0.1;
constexpr double kError = 0.004;

struct Rays {
    explicit Rays(uint64_t seed) : random(seed) {}
    std::mt19937_64 random;
    std::uniform_real_distribution<double> unit{0, 1};
    std::normal_distribution<double> normal;
    glm::dvec3 direction() { return glm::normalize(glm::dvec3(normal(random), normal(random), normal(random))); }
};

TEST(RayClasses, EachOfTheSix) {
    const IndexedMesh mesh = test::boxMesh({-1, -1, -1}, {1, 1, 1}, 4);
    const MeshBvh bvh(mesh);
    const RayJudge judge(bvh, kCellEdge, kError);
    const glm::dvec3 o(0.1, 0.2, 5), d(0, 0, -1), aside(3, 0, 5);
    const auto hitAt = [](double t) { return SurfaceHit{t, {0, 0, 1}, kError}; };

    const RayJudgement hit = judge.judge(o, d, hitAt(4.003));
    EXPECT_EQ(hit.rayClass, RayClass::Hit);
    EXPECT_NEAR(hit.depthError, 0.003, 1e-12);
    EXPECT_NEAR(hit.distance, 0.003, 1e-12);
    EXPECT_NEAR(hit.overCertified, 0.75, 1e-9);
    EXPECT_NEAR(hit.normalDegrees, 0, 1e-6);
    EXPECT_FALSE(hit.tooFar);
    EXPECT_FALSE(hit.hole);

    EXPECT_TRUE(judge.judge(o, d, hitAt(4.005)).tooFar);
    EXPECT_EQ(judge.judge(aside, d, {}).rayClass, RayClass::Miss);
    const RayJudgement missed = judge.judge(o, d, {});
    EXPECT_EQ(missed.rayClass, RayClass::Missed);
    EXPECT_TRUE(missed.hole);
    EXPECT_EQ(judge.judge(aside, d, hitAt(4)).rayClass, RayClass::False);
    EXPECT_TRUE(judge.judge(aside, d, hitAt(4)).tooFar);
    const RayJudgement behind = judge.judge(o, d, hitAt(6));
    EXPECT_EQ(behind.rayClass, RayClass::WrongSheet);
    EXPECT_TRUE(behind.hole);
    EXPECT_FALSE(behind.tooFar);
    EXPECT_FALSE(judge.judge(o, d, hitAt(3.5)).hole);
    EXPECT_EQ(judge.judge(o, d, {}, false).rayClass, RayClass::Unresolved);
    EXPECT_EQ(judge.judge(o, d, hitAt(std::nan(""))).rayClass, RayClass::Unresolved);
}

TEST(RayClasses, TableSumsToOne) {
    RayClassTable a, b;
    for (int i = 0; i < 1000; ++i) {
        RayJudgement j;
        j.rayClass = static_cast<RayClass>(i % 6);
        j.distance = i * 1e-3;
        (i % 2 == 0 ? a : b).add(j);
    }
    a.merge(b);
    double sum = 0;
    for (size_t i = 0; i < kRayClassNames.size(); ++i) sum += a.fraction(static_cast<RayClass>(i));
    EXPECT_NEAR(sum, 1, 1e-12);
    EXPECT_EQ(a.rays(), 1000u);
    EXPECT_NEAR(a.distanceCells(2).max, 0.996 / 2, 1e-6);
}

TEST(RayClasses, QuantilesAreTheNearestRank) {
    std::vector<float> values;
    for (int i = 100; i >= 1; --i) values.push_back(float(i));
    const Quantiles q = quantilesOf(values);
    EXPECT_EQ(q.p50, 50);
    EXPECT_EQ(q.p95, 95);
    EXPECT_EQ(q.p99, 99);
    EXPECT_EQ(q.max, 100);
    EXPECT_EQ(quantilesOf({7}).p50, 7);
    EXPECT_EQ(quantilesOf({}).max, 0);
}

/// Every ray that misses a surface moved by at most the certified error is excused; every other is a hole.
TEST(RayClasses, ShrunkenSphereHasNoHoles) {
    const IndexedMesh mesh = test::sphereMesh({0, 0, 0}, 1, 60);
    const IndexedMesh shrunken = test::sphereMesh({0, 0, 0}, 1 - 0.9 * kError, 60);
    const IndexedMesh tooSmall = test::sphereMesh({0, 0, 0}, 1 - 10 * kError, 60);
    const MeshBvh bvh(mesh), shrunkenBvh(shrunken), tooSmallBvh(tooSmall);
    const RayJudge judge(bvh, kCellEdge, kError);
    Rays rays(1);
    int excused = 0, caught = 0, beyond = 0;
    for (int i = 0; i < 20000; ++i) {
        // Near the silhouette.
        const glm::dvec3 d = rays.direction();
        const glm::dvec3 side = glm::normalize(glm::cross(d, rays.direction()));
        const glm::dvec3 o = side * (1 - 12 * kError * rays.unit(rays.random)) - 4.0 * d;
        if (!bvh.anyHit(o, d, 0, 10)) continue;
        if (!shrunkenBvh.anyHit(o, d, 0, 10)) {
            ++excused;
            EXPECT_FALSE(judge.leaks(o, d, std::numeric_limits<double>::infinity())) << i;
        }
        // A surface ten errors inside: rays that it misses by more than the error are real holes.
        if (tooSmallBvh.anyHit(o, d, 0, 10) || glm::length(o + 4.0 * d) > 1 - 1.3 * kError) continue;
        ++beyond;
        caught += judge.leaks(o, d, std::numeric_limits<double>::infinity()) ? 1 : 0;
    }
    EXPECT_GT(excused, 500);
    EXPECT_GT(beyond, 5000);
    EXPECT_EQ(caught, beyond);
}

TEST(RayClasses, ThinPlateSeenThroughIsAHole) {
    // Thinner than the certified error: parity would excuse it, the parallels do not.
    const IndexedMesh mesh = test::boxMesh({-1, -1, 0}, {1, 1, 0.3 * kError}, 4);
    const MeshBvh bvh(mesh);
    const RayJudge judge(bvh, kCellEdge, kError);
    Rays rays(2);
    for (int i = 0; i < 500; ++i) {
        const glm::dvec3 at(0.95 * (2 * rays.unit(rays.random) - 1), 0.95 * (2 * rays.unit(rays.random) - 1), 0);
        glm::dvec3 d = rays.direction();
        if (std::abs(d.z) < 0.2) continue;
        EXPECT_TRUE(judge.judge(at - 3.0 * d, d, {}).hole) << i;
    }
    // Past its rim by less than the error: excused.
    EXPECT_FALSE(judge.judge({1 - 0.5 * kError, 0, 3}, {0, 0, -1}, {}).hole);
    EXPECT_TRUE(judge.judge({1 - 1.5 * kError, 0, 3}, {0, 0, -1}, {}).hole);
}

TEST(RayClasses, OpenBorderMayRecede) {
    // One square, open all around.
    IndexedMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    const MeshBvh bvh(mesh);
    const RayJudge judge(bvh, kCellEdge, kError);
    for (const glm::dvec3 d : {glm::dvec3(0, 0, -1), glm::normalize(glm::dvec3(0.3, 0.4, -0.5))}) {
        EXPECT_FALSE(judge.judge(glm::dvec3(0.5 * kError, 0.5, 0) - 2.0 * d, d, {}).hole);
        EXPECT_TRUE(judge.judge(glm::dvec3(0.5, 0.5, 0) - 2.0 * d, d, {}).hole) << "on the diagonal";
        EXPECT_TRUE(judge.judge(glm::dvec3(0.3, 0.6, 0) - 2.0 * d, d, {}).hole);
    }
}

TEST(RayClasses, PartsThatTouchMayRecede) {
    // Two squares end to end: with an edge of their own each, and with one in common.
    IndexedMesh apart;
    apart.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}};
    apart.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}};
    IndexedMesh joined = apart;
    apart.positions[4].y = -0.1;
    apart.positions[7].y = 1.1;
    const MeshBvh apartBvh(apart), joinedBvh(joined);
    const glm::dvec3 d = glm::normalize(glm::dvec3(0.2, 0.1, -1));
    for (const double x : {1 - 0.5 * kError, 1.0, 1 + 0.5 * kError}) {
        const glm::dvec3 o = glm::dvec3(x, 0.5, 0) - 2.0 * d;
        EXPECT_FALSE(RayJudge(apartBvh, kCellEdge, kError).judge(o, d, {}).hole) << x;
        EXPECT_TRUE(RayJudge(joinedBvh, kCellEdge, kError).judge(o, d, {}).hole) << x;
    }
    const glm::dvec3 inner = glm::dvec3(1 - 3 * kError, 0.5, 0) - 2.0 * d;
    EXPECT_TRUE(RayJudge(apartBvh, kCellEdge, kError).judge(inner, d, {}).hole);
}

TEST(RayClasses, HitBehindACrossingNearbyIsNoHole) {
    const IndexedMesh mesh = test::boxMesh({-1, -1, -1}, {1, 1, 1}, 4);
    const MeshBvh bvh(mesh);
    const RayJudge judge(bvh, kCellEdge, kError);
    const glm::dvec3 o(0.1, 0.2, 5), d(0, 0, -1);
    EXPECT_FALSE(judge.leaks(o, d, 4 + 0.9 * kError));
    EXPECT_TRUE(judge.leaks(o, d, 4 + 5 * kError));
    EXPECT_FALSE(judge.leaks(o, d, 3));
}

}  // namespace
}  // namespace vcp
