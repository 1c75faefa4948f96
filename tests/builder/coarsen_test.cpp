// The coarser mesh stays within its strays of the finer one.
#include "builder/coarsen.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "builder/mesh_bvh.h"
#include "tests/builder/lattice_meshes.h"
#include "tests/builder/test_meshes.h"

namespace vcp {
namespace {

/// Closed and open, smooth and crumpled; in cells of the finer level.
LatticeMesh randomMesh(uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    const double radius = 2 + 12 * unit(random), noise = 0.3 * unit(random);
    IndexedMesh mesh = seed % 2 ? test::sphereMesh({24, 24, 24}, radius, static_cast<uint32_t>(8 + seed % 23)) : test::torusMesh({24, 24, 24}, radius, radius / 3, 40, 16);
    for (glm::dvec3& p : mesh.positions) p += noise * (glm::dvec3(unit(random), unit(random), unit(random)) - 0.5);
    if (seed % 3 == 0) mesh.triangles.resize(mesh.triangles.size() * 2 / 3);  // a border
    return test::onLattice(mesh);
}

/// Corners, edge middles and points inside.
template <class Visit>
void forSamples(const LatticeMesh& mesh, const Visit& visit) {
    constexpr double weights[7][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.5, 0.5, 0}, {0, 0.5, 0.5}, {0.25, 0.25, 0.5}, {0.4, 0.35, 0.25}};
    for (const auto& t : mesh.triangles)
        for (const auto& w : weights) {
            glm::dvec3 p(0);
            float stray = 0;
            for (int i = 0; i < 3; ++i) {
                p += w[i] * glm::dvec3(mesh.positions[t[i]]);
                stray = std::max(stray, mesh.stray[t[i]]);
            }
            visit(p / double(kLatticePerCell), double(stray), t);
        }
}

TEST(Coarsen, CoarseMeshIsWithinItsStrayOfTheFine) {
    for (uint64_t seed = 0; seed < 24; ++seed) {
        LatticeMesh fine = randomMesh(seed);
        std::fill(fine.stray.begin(), fine.stray.end(), 0.0f);
        const LatticeMesh coarse = coarsen(fine);
        ASSERT_FALSE(coarse.triangles.empty());
        const IndexedMesh fineMesh = test::inCells(fine, 0.5);  // in coarse cells
        const MeshBvh bvh(fineMesh);
        double most = 0;
        forSamples(coarse, [&](glm::dvec3 p, double stray, const auto&) {
            const double distance = bvh.nearestPoint(p)->distance;
            most = std::max(most, distance);
            ASSERT_LE(distance, stray + 1e-9) << "seed " << seed;
        });
        EXPECT_GT(most, 0) << seed;
        // A vertex leaves its cube by no more than the rounding of the mean.
        for (const float stray : coarse.stray) EXPECT_LE(stray, kClusterCells * std::sqrt(3.0) + 1e-3);
    }
}

TEST(Coarsen, FineMeshIsWithinTheStrayOfTheCoarse) {
    for (uint64_t seed = 0; seed < 24; ++seed) {
        LatticeMesh fine = randomMesh(seed);
        std::fill(fine.stray.begin(), fine.stray.end(), 0.0f);
        const LatticeMesh coarse = coarsen(fine);
        const float most = *std::max_element(coarse.stray.begin(), coarse.stray.end());
        const IndexedMesh coarseMesh = test::inCells(coarse);
        const MeshBvh bvh(coarseMesh);
        const auto cluster = [&](uint32_t v) { return fine.positions[v] / static_cast<int>(2 * kClusterCells * kLatticePerCell); };
        size_t compared = 0;
        forSamples(fine, [&](glm::dvec3 p, double, const auto& t) {
            // Collapsed triangles count as the segments they became.
            if (cluster(t[0]) == cluster(t[1]) || cluster(t[1]) == cluster(t[2]) || cluster(t[2]) == cluster(t[0])) return;
            ++compared;
            ASSERT_LE(bvh.nearestPoint(p / 2.0)->distance, double(most) + 1e-9) << "seed " << seed;
        });
        EXPECT_GT(compared, 100u) << seed;
    }
}

TEST(Coarsen, StrayAddsUpOverLevels) {
    for (uint64_t seed = 1; seed < 6; ++seed) {
        const LatticeMesh finest = randomMesh(seed);
        LatticeMesh mesh = finest;
        for (int level = 1; level <= 4; ++level) {
            mesh = coarsen(mesh);
            if (mesh.triangles.empty()) break;
            const IndexedMesh finestMesh = test::inCells(finest, std::exp2(-level));
            const MeshBvh bvh(finestMesh);
            forSamples(mesh, [&](glm::dvec3 p, double stray, const auto&) { ASSERT_LE(bvh.nearestPoint(p)->distance, stray + 1e-9) << seed << " level " << level; });
        }
    }
}

TEST(Coarsen, ClosedMeshesShrink) {
    LatticeMesh mesh = test::onLattice(test::sphereMesh({40, 40, 40}, 30, 60));
    const size_t before = mesh.triangles.size();
    mesh = coarsen(coarsen(mesh));
    EXPECT_LT(mesh.triangles.size(), before);
    for (int i = 0; i < 12; ++i) mesh = coarsen(mesh);
    EXPECT_TRUE(mesh.triangles.empty());
}

TEST(Coarsen, IsDeterministic) {
    const LatticeMesh fine = randomMesh(5);
    const LatticeMesh a = coarsen(fine), b = coarsen(fine);
    EXPECT_EQ(a.positions, b.positions);
    EXPECT_EQ(a.triangles, b.triangles);
    EXPECT_EQ(a.stray, b.stray);
}

TEST(Coarsen, ColoursAreAveraged) {
    LatticeMesh mesh;
    // Two vertices in one cluster of a quarter coarse cell, which is half a fine one; two on their own.
    mesh.positions = {{0, 0, 0}, {100, 0, 0}, {4 * 2048, 0, 0}, {0, 4 * 2048, 0}};
    mesh.colours = {0xff000010u, 0xff00ff31u, 0x80402010u, 0xffffffffu};
    mesh.stray.assign(4, 0);
    mesh.triangles = {{0, 2, 3}, {1, 2, 3}};
    const LatticeMesh coarse = coarsen(mesh);
    ASSERT_EQ(coarse.positions.size(), 3u);
    EXPECT_EQ(coarse.triangles.size(), 1u);  // both became the same
    const auto colourAt = [&](glm::i32vec3 p) {
        const auto at = std::find(coarse.positions.begin(), coarse.positions.end(), p);
        return at == coarse.positions.end() ? 0u : coarse.colours[at - coarse.positions.begin()];
    };
    EXPECT_EQ(colourAt({25, 0, 0}), 0xff008021u);  // (0x10 + 0x31) / 2 and (0 + 0xff) / 2, rounded
    EXPECT_EQ(colourAt({2 * 2048, 0, 0}), 0x80402010u);
    EXPECT_EQ(colourAt({0, 2 * 2048, 0}), 0xffffffffu);
}

}  // namespace
}  // namespace vcp
