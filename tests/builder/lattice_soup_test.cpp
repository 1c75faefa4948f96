// Snapping to the lattice, and splitting of long edges.
#include "builder/lattice_soup.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "builder/measure/mesh_bvh.h"
#include "tests/support/lattice_meshes.h"
#include "tests/support/test_meshes.h"

namespace vcp {
namespace {

LatticeMesh meshFrom(const IndexedMesh& mesh) { return meshOf(test::soupOf(mesh), false); }

TEST(LatticeSnapper, SnapsToTheNearestPoint) {
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> unit(0, 1);
    for (const glm::dvec3 origin : {glm::dvec3(0), glm::dvec3(483920.25, 3792000.5, -1200)})
        for (const double cell : {0.37, 1.0, 250.0}) {
            const LatticeSnapper snapper({.origin = origin, .cell = cell});
            for (int i = 0; i < 500; ++i) {
                WorldTriangle<double> t{};
                for (auto& p : t.corner)
                    p = origin + cell * 100.0 * glm::dvec3(unit(random), unit(random), unit(random));
                for (uint32_t& c : t.colour) c = uint32_t(random());
                int pieces = 0;
                snapper.add(t, [&](const LatticeTriangle& s) {
                    ++pieces;
                    ASSERT_EQ(s.stray, float(kLatticeRounding));
                    for (int k = 0; k < 3; ++k) {
                        ASSERT_EQ(s.colour[k], t.colour[k]);
                        const glm::dvec3 back = origin + glm::dvec3(s.corner[k]) * (cell / kLatticePerCell);
                        ASSERT_LE(glm::distance(back, t.corner[k]), cell * kLatticeRounding * 1.0001);
                    }
                });
                ASSERT_EQ(pieces, 1);
            }
        }
}

TEST(LatticeSnapper, FloatsAreAsDoubles) {
    const LatticeSnapper snapper({.origin = {-1, -1, -1}, .cell = 0.01});
    WorldTriangle<float> f{};
    f.corner[0] = {0.1f, 0.2f, 0.3f};
    f.corner[1] = {0.7f, 0.2f, 0.1f};
    f.corner[2] = {0.4f, 0.9f, 0.6f};
    WorldTriangle<double> d{};
    for (int i = 0; i < 3; ++i) d.corner[i] = glm::dvec3(f.corner[i]);
    std::vector<LatticeTriangle> a, b;
    snapper.add(f, [&](const LatticeTriangle& t) { a.push_back(t); });
    snapper.add(d, [&](const LatticeTriangle& t) { b.push_back(t); });
    ASSERT_EQ(a.size(), 1u);
    ASSERT_EQ(b.size(), 1u);
    for (int i = 0; i < 3; ++i) EXPECT_EQ(a[0].corner[i], b[0].corner[i]);
}

TEST(LatticeSnapper, CornersOutsideAreClamped) {
    // Rounding may put a corner a hair below the origin.
    const LatticeSnapper snapper({.origin = {1, 1, 1}, .cell = 1});
    WorldTriangle<double> t{};
    t.corner[0] = {1 - 1e-9, 1, 1};
    t.corner[1] = {3, 1, 1};
    t.corner[2] = {1, 3, 1};
    snapper.add(t, [](const LatticeTriangle& s) { EXPECT_EQ(s.corner[0], glm::i32vec3(0)); });
}

void expectShortEdges(const LatticeMesh& mesh) {
    const double limit = double(kMaxEdgeCells) * kLatticePerCell;
    for (const auto& t : mesh.triangles)
        for (int i = 0; i < 3; ++i)
            ASSERT_LE(glm::length(glm::dvec3(mesh.positions[t[i]]) - glm::dvec3(mesh.positions[t[(i + 1) % 3]])),
                      limit);
}

TEST(SplitLongEdges, LeavesShortEdgesAlone) {
    // The diagonals are too long; without them nothing is.
    EXPECT_EQ(test::soupOf(test::boxMesh({1, 1, 1}, {170, 170, 170}, 1)).size(), 12u);
    const LatticeMesh mesh = meshFrom(test::boxMesh({1, 1, 1}, {200, 190, 180}, 1));
    EXPECT_GT(mesh.triangles.size(), 12u);
    expectShortEdges(mesh);
}

TEST(SplitLongEdges, ClosedStaysClosedAndKeepsItsArea) {
    for (const glm::dvec3 high :
         {glm::dvec3(3000, 2000, 1000), glm::dvec3(700, 701, 703), glm::dvec3(5000, 3, 2), glm::dvec3(257, 257, 257)}) {
        IndexedMesh box = test::boxMesh(glm::dvec3(0), high, 1);
        if (high.x < 1000) {
            test::rotate(box, high / 2.0, {1, 2, 3}, 0.7);
            for (glm::dvec3& p : box.positions) p += 400.0;
        }
        const double area = test::areaOf(box);
        const LatticeMesh mesh = meshFrom(box);
        expectShortEdges(mesh);
        EXPECT_EQ(test::edgeUses(mesh.triangles), (std::map<int, int>{{2, int(mesh.triangles.size() * 3 / 2)}}));
        EXPECT_NEAR(test::areaOf(test::inCells(mesh)), area, 2e-4 * area);
        // No corner of the pieces is farther from the old mesh than its stray.
        const MeshBvh bvh(box);
        for (size_t k = 0; k < mesh.triangles.size(); ++k) {
            ASSERT_LE(mesh.stray[k], 8 * kLatticeRounding);
            for (const uint32_t v : mesh.triangles[k]) {
                const auto nearest = bvh.nearestPoint(glm::dvec3(mesh.positions[v]) / double(kLatticePerCell));
                ASSERT_LE(nearest->distance, double(mesh.stray[k]) + 1e-9);
            }
        }
    }
}

TEST(SplitLongEdges, RandomClosedMeshesOfLongTriangles) {
    for (uint64_t seed = 0; seed < 20; ++seed) {
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> unit(0, 1);
        // A crumpled ring: closed, with edges of all lengths.
        IndexedMesh mesh = test::torusMesh({1500, 1500, 1500}, 900, 400, 7, 5);
        for (glm::dvec3& p : mesh.positions) p += 250.0 * (glm::dvec3(unit(random), unit(random), unit(random)) - 0.5);
        const double area = test::areaOf(mesh);
        const LatticeMesh lattice = meshFrom(mesh);
        ASSERT_GT(lattice.triangles.size(), mesh.triangles.size());
        expectShortEdges(lattice);
        EXPECT_EQ(test::edgeUses(lattice.triangles), (std::map<int, int>{{2, int(lattice.triangles.size() * 3 / 2)}}))
            << seed;
        EXPECT_NEAR(test::areaOf(test::inCells(lattice)), area, 1e-5 * area) << seed;
    }
}

TEST(SplitLongEdges, ColoursAreMixed) {
    IndexedMesh triangle;
    triangle.positions = {{0, 0, 0}, {300, 0, 0}, {0, 1, 0}};
    triangle.triangles = {{0, 1, 2}};
    const LatticeMesh mesh = meshOf(test::soupOf(triangle, {0xff000000u, 0xff204060u, 0xff000000u}), true);
    ASSERT_EQ(mesh.positions.size(), 5u);
    ASSERT_EQ(mesh.colours.size(), 5u);
    const auto at = std::find(mesh.positions.begin(), mesh.positions.end(), glm::i32vec3(150 * kLatticePerCell, 0, 0));
    ASSERT_NE(at, mesh.positions.end());
    EXPECT_EQ(mesh.colours[at - mesh.positions.begin()], 0xff102030u);
}

}  // namespace
}  // namespace vcp
