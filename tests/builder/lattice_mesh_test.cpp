// Welding, splitting of long edges, normals.
#include "builder/lattice_mesh.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "builder/mesh_bvh.h"
#include "octree/packing.h"
#include "tests/builder/lattice_meshes.h"
#include "tests/builder/test_meshes.h"

namespace vcp {
namespace {

LatticeMesh meshOf(std::vector<glm::i32vec3> positions, std::vector<std::array<uint32_t, 3>> triangles) {
    LatticeMesh mesh;
    mesh.positions = std::move(positions);
    mesh.triangles = std::move(triangles);
    mesh.stray.assign(mesh.positions.size(), 0.5f);
    return mesh;
}

TEST(Weld, MergesEqualPositions) {
    LatticeMesh mesh = meshOf({{0, 0, 0}, {9, 0, 0}, {0, 9, 0}, {9, 0, 0}, {9, 9, 0}, {0, 9, 0}}, {{0, 1, 2}, {3, 4, 5}});
    mesh.colours = {10, 11, 12, 13, 14, 15};
    mesh.stray = {1, 2, 3, 4, 5, 1};
    weld(mesh);
    EXPECT_EQ(mesh.positions, (std::vector<glm::i32vec3>{{0, 0, 0}, {9, 0, 0}, {0, 9, 0}, {9, 9, 0}}));
    EXPECT_EQ(mesh.colours, (std::vector<uint32_t>{10, 11, 12, 14}));
    EXPECT_EQ(mesh.stray, (std::vector<float>{1, 4, 3, 5}));
    EXPECT_EQ(mesh.triangles, (std::vector<std::array<uint32_t, 3>>{{0, 1, 2}, {1, 3, 2}}));
}

TEST(Weld, DropsWhatHasNoAreaOrIsRepeated) {
    LatticeMesh mesh = meshOf({{0, 0, 0}, {9, 0, 0}, {0, 9, 0}, {18, 0, 0}, {9, 0, 0}},
                              {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}, {2, 0, 4}, {1, 0, 2}, {2, 2, 1}, {1, 3, 2}});
    weld(mesh);
    // The first of the copies stays, whatever their orientation; collinear corners go.
    EXPECT_EQ(mesh.triangles, (std::vector<std::array<uint32_t, 3>>{{0, 1, 2}, {1, 3, 2}}));
}

TEST(Weld, AreaIsExactOverTheWholeLattice) {
    constexpr int32_t far = 2147483647;
    LatticeMesh mesh = meshOf({{0, 0, 0}, {far, far, far}, {far - 1, far - 1, far - 1}, {far, far - 1, far}, {0, 0, 1}},
                              {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}});
    weld(mesh);
    EXPECT_EQ(mesh.triangles, (std::vector<std::array<uint32_t, 3>>{{0, 1, 3}, {0, 1, 4}}));
}

TEST(Weld, NothingIsEmpty) {
    LatticeMesh mesh;
    weld(mesh);
    EXPECT_TRUE(mesh.positions.empty());
    EXPECT_TRUE(mesh.triangles.empty());
}

TEST(Weld, RandomAgainstMap) {
    for (uint64_t seed = 0; seed < 50; ++seed) {
        std::mt19937_64 random(seed);
        const auto any = [&](int n) { return static_cast<int>(random() % n); };
        LatticeMesh mesh;
        for (int i = 0; i < 300; ++i) mesh.positions.emplace_back(any(6), any(6), any(6));
        for (int i = 0; i < 500; ++i) mesh.triangles.push_back({uint32_t(any(300)), uint32_t(any(300)), uint32_t(any(300))});
        mesh.stray.assign(300, 0);
        const LatticeMesh before = mesh;
        weld(mesh);
        std::map<std::array<int, 3>, int> names;
        for (const auto& p : mesh.positions) EXPECT_EQ((names[{p.x, p.y, p.z}]++), 0) << seed;
        // Which triangles there are, as sets of three positions.
        const auto all = [](const LatticeMesh& m) {
            std::map<std::array<std::array<int, 3>, 3>, int> triangles;
            for (const auto& t : m.triangles) {
                const glm::i32vec3 u = m.positions[t[1]] - m.positions[t[0]], v = m.positions[t[2]] - m.positions[t[0]];
                if (glm::cross(glm::dvec3(u), glm::dvec3(v)) == glm::dvec3(0)) continue;
                std::array<std::array<int, 3>, 3> key;
                for (int i = 0; i < 3; ++i) key[i] = {m.positions[t[i]].x, m.positions[t[i]].y, m.positions[t[i]].z};
                std::sort(key.begin(), key.end());
                ++triangles[key];
            }
            return triangles;
        };
        const auto want = all(before), have = all(mesh);
        EXPECT_EQ(have.size(), want.size());
        EXPECT_EQ(mesh.triangles.size(), want.size());
        for (const auto& [key, count] : have) EXPECT_EQ(want.count(key), 1u);
    }
}

void expectShortEdges(const LatticeMesh& mesh) {
    const double limit = double(kMaxEdgeCells) * kLatticePerCell;
    for (const auto& t : mesh.triangles)
        for (int i = 0; i < 3; ++i)
            ASSERT_LE(glm::length(glm::dvec3(mesh.positions[t[i]]) - glm::dvec3(mesh.positions[t[(i + 1) % 3]])), limit);
}

TEST(SplitLongEdges, LeavesShortEdgesAlone) {
    LatticeMesh mesh = test::onLattice(test::boxMesh({1, 1, 1}, {200, 190, 180}, 1));
    // The diagonals are too long; without them nothing is.
    const LatticeMesh small = test::onLattice(test::boxMesh({1, 1, 1}, {170, 170, 170}, 1));
    LatticeMesh same = small;
    splitLongEdges(same);
    EXPECT_EQ(same.positions, small.positions);
    EXPECT_EQ(same.triangles, small.triangles);
    const size_t before = mesh.triangles.size();
    splitLongEdges(mesh);
    EXPECT_GT(mesh.triangles.size(), before);
    expectShortEdges(mesh);
}

TEST(SplitLongEdges, ClosedStaysClosedAndKeepsItsArea) {
    for (const glm::dvec3 high : {glm::dvec3(3000, 2000, 1000), glm::dvec3(700, 701, 703), glm::dvec3(5000, 3, 2), glm::dvec3(257, 257, 257)}) {
        IndexedMesh box = test::boxMesh(glm::dvec3(0), high, 1);
        if (high.x < 1000) {
            test::rotate(box, high / 2.0, {1, 2, 3}, 0.7);
            for (glm::dvec3& p : box.positions) p += 400.0;
        }
        LatticeMesh mesh = test::onLattice(box);
        const double area = test::areaOf(test::inCells(mesh));
        const std::vector<float> strayBefore = mesh.stray;
        splitLongEdges(mesh);
        expectShortEdges(mesh);
        EXPECT_EQ(test::edgeUses(mesh.triangles), (std::map<int, int>{{2, static_cast<int>(mesh.triangles.size() * 3 / 2)}}));
        EXPECT_NEAR(test::areaOf(test::inCells(mesh)), area, 1e-5 * area);
        // No corner of the pieces is farther from the old mesh than its stray.
        const MeshBvh bvh(box);
        for (size_t v = 0; v < mesh.positions.size(); ++v) {
            const auto nearest = bvh.nearestPoint(glm::dvec3(mesh.positions[v]) / double(kLatticePerCell));
            ASSERT_LE(nearest->distance, double(mesh.stray[v]) + 1e-9);
            ASSERT_LE(mesh.stray[v], 8 * kLatticeRounding);
        }
    }
}

TEST(SplitLongEdges, RandomClosedMeshesOfLongTriangles) {
    for (uint64_t seed = 0; seed < 20; ++seed) {
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> unit(0, 1);
        // A tetrahedron fan about a random point: closed, with edges of all lengths.
        IndexedMesh mesh = test::sphereMesh({1500, 1500, 1500}, 1200, 4);
        for (glm::dvec3& p : mesh.positions) p += 250.0 * (glm::dvec3(unit(random), unit(random), unit(random)) - 0.5);
        LatticeMesh lattice = test::onLattice(mesh);
        const bool closed = test::edgeUses(lattice.triangles).size() == 1;
        const double area = test::areaOf(test::inCells(lattice));
        splitLongEdges(lattice);
        expectShortEdges(lattice);
        if (closed) {
            EXPECT_EQ(test::edgeUses(lattice.triangles).size(), 1u) << seed;
        }
        EXPECT_NEAR(test::areaOf(test::inCells(lattice)), area, 1e-5 * area) << seed;
    }
}

TEST(SplitLongEdges, ColoursAreMixed) {
    LatticeMesh mesh = meshOf({{0, 0, 0}, {300 * kLatticePerCell, 0, 0}, {0, 2048, 0}}, {{0, 1, 2}});
    mesh.colours = {0xff000000u, 0xff204060u, 0xff000000u};
    splitLongEdges(mesh);
    ASSERT_EQ(mesh.positions.size(), 5u);
    ASSERT_EQ(mesh.colours.size(), 5u);
    const auto at = std::find(mesh.positions.begin(), mesh.positions.end(), glm::i32vec3(150 * kLatticePerCell, 0, 0));
    ASSERT_NE(at, mesh.positions.end());
    EXPECT_EQ(mesh.colours[at - mesh.positions.begin()], 0xff102030u);
}

bool isCrease(uint32_t normal) { return (normal & kNormalCreaseBit) != 0; }

TEST(ComputeNormals, SphereIsSmooth) {
    const glm::dvec3 centre(20, 20, 20);
    const LatticeMesh mesh = test::onLattice(test::sphereMesh(centre, 15, 40));
    for (size_t v = 0; v < mesh.positions.size(); ++v) {
        const glm::dvec3 outward = glm::normalize(glm::dvec3(mesh.positions[v]) / double(kLatticePerCell) - centre);
        const double cosine = std::abs(glm::dot(outward, f64::decodeNormal(mesh.normals[v])));
        ASSERT_GT(cosine, std::cos(3 * test::kTwoPi / 360)) << v;
        ASSERT_FALSE(isCrease(mesh.normals[v])) << v;
    }
}

TEST(ComputeNormals, CubeHasCreases) {
    const LatticeMesh mesh = test::onLattice(test::boxMesh(glm::dvec3(2), glm::dvec3(10), 4));
    int creases = 0;
    for (size_t v = 0; v < mesh.positions.size(); ++v) {
        const glm::dvec3 p = glm::dvec3(mesh.positions[v]) / double(kLatticePerCell);
        int onFaces = 0;
        for (int axis = 0; axis < 3; ++axis) onFaces += p[axis] == 2 || p[axis] == 10;
        EXPECT_EQ(isCrease(mesh.normals[v]), onFaces > 1) << v;
        creases += onFaces > 1;
    }
    EXPECT_EQ(creases, 8 + 12 * 3);
}

TEST(ComputeNormals, OrientationDoesNotMatter) {
    IndexedMesh ball = test::sphereMesh({20, 20, 20}, 15, 12);
    const LatticeMesh straight = test::onLattice(ball);
    std::mt19937 random(1);
    for (auto& t : ball.triangles)
        if (random() % 2) std::swap(t[0], t[1]);
    const LatticeMesh turned = test::onLattice(ball);
    ASSERT_EQ(straight.positions, turned.positions);
    for (size_t v = 0; v < straight.positions.size(); ++v) {
        const double cosine = glm::dot(f64::decodeNormal(straight.normals[v]), f64::decodeNormal(turned.normals[v]));
        EXPECT_GT(std::abs(cosine), 0.9999) << v;
        EXPECT_EQ(isCrease(straight.normals[v]), isCrease(turned.normals[v])) << v;
    }
}

TEST(ComputeNormals, UnusedVerticesAndNeedlesAreFinite) {
    LatticeMesh mesh = meshOf({{0, 0, 0}, {1 << 19, 0, 0}, {1 << 18, 1, 0}, {5, 5, 5}}, {{0, 1, 2}});
    computeNormals(mesh);
    ASSERT_EQ(mesh.normals.size(), 4u);
    for (int v = 0; v < 3; ++v) EXPECT_GT(std::abs(f64::decodeNormal(mesh.normals[v]).z), 0.9999);
}

}  // namespace
}  // namespace vcp
