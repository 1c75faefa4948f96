// Shapes: their truths against independent ones, and what is refused.
#include "mesostructure/shape.h"

#include <random>

#include <glm/geometric.hpp>

#include "tests/support/meso_rays.h"

namespace vcp::meso {
namespace {

TEST(Shape, FieldsBoundTheDistanceAndRepeat) {
    for (const auto name : solidNames()) {
        const auto shape = test::solid(std::string(name));
        std::mt19937 random(7);
        for (int i = 0; i < 2000; ++i) {
            const MarchRay a = test::rayAnywhere(random, shape->extent());
            const double fa = shape->field(a.origin), step = 0.07 * (i % 10 + 1) / 10,
                         fb = shape->field(a.origin + step * a.direction);
            ASSERT_LE(std::abs(fa - fb), step * (1 + 1e-9)) << name << " " << i;
            ASSERT_NEAR(fa, shape->field(a.origin + glm::dvec3(-3, 5, 0)), 1e-9) << name;
        }
    }
}

TEST(Shape, HeightFieldTruthIsTheFirstCrossing) {
    for (const auto name : heightFieldNames()) {
        const HeightMap map = *makeHeightField(name, 32, 2);
        const auto shape = test::heights(map);
        std::mt19937 random(11);
        for (int i = 0; i < 100; ++i) {
            const MarchRay ray = test::rayFromTop(random, shape->extent(), 10);
            const TruthHit hit = shape->trace(ray.origin, ray.direction, 100);
            ASSERT_TRUE(hit.hit) << name << i;
            ASSERT_NEAR(shape->field(ray.origin + hit.t * ray.direction), 0, 1e-9) << name << i;
            for (double t = 0; t < hit.t - 1e-9; t += hit.t / 200)
                ASSERT_GT(shape->field(ray.origin + t * ray.direction), -1e-12) << name << i;
        }
    }
}

/// An octahedron-like ball of quads in the middle of the tile, cut into triangles.
std::vector<TileTriangle> ballMesh(glm::dvec3 centre, double radius, int rings) {
    const auto point = [&](int i, int j) {
        const double a = M_PI * i / rings, b = M_PI * j / rings;
        return centre + radius * glm::dvec3(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a));
    };
    std::vector<TileTriangle> triangles;
    for (int i = 0; i < rings; ++i)
        for (int j = 0; j < 2 * rings; ++j) {
            if (i > 0) triangles.push_back({point(i, j), point(i + 1, j), point(i, j + 1)});
            if (i + 1 < rings) triangles.push_back({point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)});
        }
    return triangles;
}

TEST(Shape, MeshEqualsTheBallItWasMadeOf) {
    // Across the tile's border, so that three more tiles show parts of it.
    const glm::dvec3 centre(0.95, 0.05, 0.12);
    const auto mesh = ballMesh(centre, 0.1, 24);
    const auto shape = meshShape(mesh, {1, 1, 0.25});
    ASSERT_TRUE(shape.ok()) << shape.error().line();
    const auto exact = [&](glm::dvec3 p) {
        double least = 9;
        p.x -= std::floor(p.x), p.y -= std::floor(p.y);
        for (const double x : {-1.0, 0.0, 1.0})
            for (const double y : {-1.0, 0.0, 1.0})
                least = std::min(least, glm::length(p - centre - glm::dvec3(x, y, 0)) - 0.1);
        return least;
    };
    std::mt19937 random(3);
    int hits = 0;
    for (int i = 0; i < 1500; ++i) {
        const MarchRay ray = test::rayAnywhere(random, {1, 1, 0.25});
        const double f = (*shape)->field(ray.origin);
        // Distances far away are cut.
        ASSERT_NEAR(std::min(f, 0.09), std::min(exact(ray.origin), 0.09), 0.002) << i;
        const TruthHit hit = (*shape)->trace(ray.origin, ray.direction, 5);
        if (!hit.hit || exact(ray.origin) < 0) continue;
        ++hits;
        ASSERT_NEAR(exact(ray.origin + hit.t * ray.direction), 0, 0.002) << i;
        ASSERT_LT(glm::dot(hit.normal, ray.direction), 0);
    }
    EXPECT_GT(hits, 50);
}

TEST(Shape, OpenOrInvertedMeshesAreRefused) {
    auto mesh = ballMesh({0.5, 0.5, 0.12}, 0.1, 12);
    auto open = mesh;
    open.resize(open.size() - 40);
    EXPECT_NE(meshShape(open, {1, 1, 0.25}).error().message.find("not closed"), std::string::npos);
    for (TileTriangle& triangle : mesh) std::swap(triangle[0], triangle[1]);
    EXPECT_NE(meshShape(mesh, {1, 1, 0.25}).error().message.find("inwards"), std::string::npos);
    EXPECT_FALSE(meshShape({}, {1, 1, 1}).ok());
    EXPECT_FALSE(meshShape(ballMesh({0.5, 0.5, 0}, 0.1, 8), {1, 1, 0.25}).ok());
    EXPECT_FALSE(meshShape({{{glm::dvec3(NAN), glm::dvec3(0), glm::dvec3(1, 0, 0)}}}, {1, 1, 0.25}).ok());
}

TEST(Shape, BadHeightMapsAreRefused) {
    EXPECT_FALSE(heightShape({}).ok());
    EXPECT_FALSE(heightShape({{2, 2}, 0.1, std::vector<uint16_t>(3)}).ok());
    EXPECT_FALSE(heightShape({{2, 2}, 0, std::vector<uint16_t>(4)}).ok());
    EXPECT_FALSE(makeHeightField("fbm", 4, 1).ok());
    EXPECT_FALSE(makeHeightField("nothing", 64, 1).ok());
    EXPECT_FALSE(makeSolid("nothing", 1).ok());
    // One texel, one height: a plane.
    const HeightMap plane{{1, 1}, 0.1, {30000}};
    const auto shape = test::heights(plane);
    const TruthHit hit = shape->trace({0.2, 0.3, 0.1}, {0, 0, -1}, 10);
    EXPECT_TRUE(hit.hit);
    EXPECT_NEAR(hit.t, 0.1 - 0.1 * 30000 / 65535, 1e-12);
}

}  // namespace
}  // namespace vcp::meso
