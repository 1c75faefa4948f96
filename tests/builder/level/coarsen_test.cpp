// The coarser mesh and the finer one are within the strays of each other, whatever the mesh.
#include "builder/level/coarsen.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>

#include <gtest/gtest.h>

#include "builder/measure/mesh_bvh.h"
#include "octree/surface/packing.h"
#include "tests/support/lattice_meshes.h"
#include "tests/support/test_meshes.h"

namespace vcp {
namespace {

using Index3 = std::array<uint32_t, 3>;

/// Closed and open, smooth and crumpled; in cells of the finer level.
IndexedMesh randomSurface(uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    const double radius = 2 + 12 * unit(random), noise = unit(random) < 0.7 ? 0.3 * unit(random) : 1.5;
    IndexedMesh mesh = seed % 2 ? test::sphereMesh({24, 24, 24}, radius, uint32_t(8 + seed % 23))
                                : test::torusMesh({24, 24, 24}, radius, radius / 3, 40, 16);
    for (glm::dvec3& p : mesh.positions) p += noise * (glm::dvec3(unit(random), unit(random), unit(random)) - 0.5);
    if (seed % 3 == 0) mesh.triangles.resize(mesh.triangles.size() * 2 / 3);  // a border
    return mesh;
}

/// Triangles between random points: all sizes, through each other, needles among them.
IndexedMesh randomTriangles(uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    IndexedMesh mesh;
    for (int i = 0; i < 120; ++i) {
        const glm::dvec3 centre = 20.0 * glm::dvec3(unit(random), unit(random), unit(random)) + 5.0;
        const double size = std::pow(10, -3 + 4 * unit(random));
        const uint32_t first = uint32_t(mesh.positions.size());
        for (int c = 0; c < 3; ++c)
            mesh.positions.push_back(
                glm::max(centre + size * (glm::dvec3(unit(random), unit(random), unit(random)) - 0.5), 0.0));
        if (i % 5 == 0) mesh.positions.back() = 0.5 * (mesh.positions[first] + mesh.positions[first + 1]) + 0.002;
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    return mesh;
}

LatticeMesh withoutStray(const IndexedMesh& mesh) {
    LatticeMesh out = test::onLattice(mesh);
    std::fill(out.stray.begin(), out.stray.end(), 0.0f);
    return out;
}

/// Points all over a mesh's triangles, in cells; `visit` gets the triangle's number too.
template <class Visit>
void forSamples(const LatticeMesh& mesh, const Visit& visit) {
    constexpr int steps = 5;
    for (size_t k = 0; k < mesh.triangles.size(); ++k)
        for (int a = 0; a <= steps; ++a)
            for (int b = 0; a + b <= steps; ++b) {
                const Index3& t = mesh.triangles[k];
                const glm::dvec3 p = double(a) * glm::dvec3(mesh.positions[t[0]]) +
                                     double(b) * glm::dvec3(mesh.positions[t[1]]) +
                                     double(steps - a - b) * glm::dvec3(mesh.positions[t[2]]);
                visit(p / (steps * double(kLatticePerCell)), k);
            }
}

float mostStray(const LatticeMesh& mesh) { return *std::max_element(mesh.stray.begin(), mesh.stray.end()); }

/// Both ways, against the finest mesh, level by level; true for every triangle's own stray.
void expectWithinStray(const LatticeMesh& finest, int levels, const std::string& what) {
    SCOPED_TRACE(what);
    LatticeMesh mesh = finest;
    for (int level = 1; level <= levels; ++level) {
        SCOPED_TRACE(level);
        mesh = coarsen(mesh);
        ASSERT_FALSE(mesh.triangles.empty());
        ASSERT_EQ(mesh.stray.size(), mesh.triangles.size());
        const double scale = std::exp2(-level);
        const IndexedMesh finestMesh = test::inCells(finest, scale), coarseMesh = test::inCells(mesh);
        const MeshBvh finestBvh(finestMesh), coarseBvh(coarseMesh);
        double most = 0;
        forSamples(mesh, [&](glm::dvec3 p, size_t k) {
            const double distance = finestBvh.nearestPoint(p)->distance;
            most = std::max(most, distance);
            ASSERT_LE(distance, double(mesh.stray[k]) + 1e-9) << "triangle " << k;
        });
        const double stray = mostStray(mesh);
        forSamples(finest, [&](glm::dvec3 p, size_t k) {
            ASSERT_LE(coarseBvh.nearestPoint(p * scale)->distance, stray + 1e-9) << "of finest triangle " << k;
        });
    }
}

TEST(Coarsen, SurfacesStayWithinTheirStray) {
    for (uint64_t seed = 0; seed < 24; ++seed)
        expectWithinStray(withoutStray(randomSurface(seed)), 4, "seed " + std::to_string(seed));
}

TEST(Coarsen, SoupsStayWithinTheirStray) {
    for (uint64_t seed = 0; seed < 24; ++seed)
        expectWithinStray(withoutStray(randomTriangles(seed)), 5, "seed " + std::to_string(seed));
}

TEST(Coarsen, StraysOfTheFinerMeshAreHandedOn) {
    LatticeMesh fine = withoutStray(randomSurface(3));
    const float before = mostStray(coarsen(fine));
    std::fill(fine.stray.begin(), fine.stray.end(), 0.5f);
    const LatticeMesh coarse = coarsen(fine);
    for (const float stray : coarse.stray) ASSERT_GE(stray, 0.25f);
    EXPECT_LE(mostStray(coarse), before + 0.26f);
}

TEST(Coarsen, SmoothSurfacesStayClose) {
    // The surface, not its vertices: those move by half a cell along it.
    // Triangles of about a cell: long ones are bounded by how far their corners move.
    const LatticeMesh coarse = coarsen(withoutStray(test::sphereMesh({60, 60, 60}, 50, 240)));
    EXPECT_LT(mostStray(coarse), 0.26f);                     // bounds below a quarter are not improved
    EXPECT_EQ(test::edgeUses(coarse.triangles).size(), 1u);  // still closed: every edge twice
}

TEST(Coarsen, FlatIsExact) {
    // Slanted a little, and far from any border inside.
    const IndexedMesh plate = test::gridSurface(
        60, 60, false, [](double u, double v) { return glm::dvec3(10 + 50 * u, 10 + 50 * v, 20 + 10 * u); });
    LatticeMesh mesh = withoutStray(plate);
    const size_t before = mesh.triangles.size();
    mesh = coarsen(mesh);
    EXPECT_LT(mesh.triangles.size() * 3, before);
    EXPECT_LT(mostStray(mesh), 0.26f);  // at the border
    std::vector<float> strays = mesh.stray;
    std::nth_element(strays.begin(), strays.begin() + strays.size() / 2, strays.end());
    EXPECT_LT(strays[strays.size() / 2], 0.06f);
}

TEST(Coarsen, WiresStayConnected) {
    for (const double thickness : {0.02, 0.1, 0.3}) {
        // Winding up, thinner than any cluster.
        const IndexedMesh wire = test::gridSurface(8, 300, false, [&](double u, double v) {
            const double a = v * 3 * test::kTwoPi, around = u * test::kTwoPi;
            return glm::dvec3(30, 30, 5) + glm::dvec3((15 + thickness * std::cos(around)) * std::cos(a),
                                                      (15 + thickness * std::cos(around)) * std::sin(a),
                                                      30 * v + thickness * std::sin(around));
        });
        LatticeMesh mesh = withoutStray(wire);
        expectWithinStray(mesh, 4, "thickness " + std::to_string(thickness));
        for (int level = 1; level <= 4; ++level) {
            mesh = coarsen(mesh);
            EXPECT_LT(mostStray(mesh), 0.6f) << thickness << " level " << level;
        }
    }
}

TEST(Coarsen, IslandsDoNotVanish) {
    // Dust: tetrahedra of a hundredth of a cell and less, some of a few lattice steps.
    IndexedMesh dust;
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int i = 0; i < 60; ++i) {
        const glm::dvec3 centre =
            4.0 * glm::dvec3(i % 4, i / 4 % 4, i / 16) + 2.0 + glm::dvec3(unit(random), unit(random), unit(random));
        const double size = i % 3 == 0 ? 0.001 : 0.02;
        const uint32_t first = uint32_t(dust.positions.size());
        for (const glm::dvec3 corner : {glm::dvec3(0), glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1)})
            dust.positions.push_back(centre + size * corner);
        for (const Index3& t : {Index3{0, 1, 2}, Index3{0, 1, 3}, Index3{0, 2, 3}, Index3{1, 2, 3}})
            dust.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
    LatticeMesh mesh = withoutStray(dust);
    expectWithinStray(mesh, 6, "dust");
    const LatticeMesh once = coarsen(mesh);
    EXPECT_EQ(once.triangles.size(), 60u);
    EXPECT_LT(mostStray(once), 0.02f);
    for (int level = 0; level < 12; ++level) {
        mesh = coarsen(mesh);
        ASSERT_FALSE(mesh.triangles.empty());
        ASSERT_LT(mostStray(mesh), 0.6f);
    }
}

TEST(Coarsen, ThinDoubleSheetsDoNotOpen) {
    for (const double thickness : {0.01, 0.2, 0.6}) {
        IndexedMesh plate = test::boxMesh({4, 4, 10}, {40, 30, 10 + thickness}, 40);
        test::rotate(plate, {22, 17, 10}, {1, 2, 0.5}, 0.4);
        for (glm::dvec3& p : plate.positions) p += glm::dvec3(20);
        expectWithinStray(withoutStray(plate), 4, "thickness " + std::to_string(thickness));
        // A hole would be as far from the plate as it is wide.
        EXPECT_LT(mostStray(coarsen(withoutStray(plate))), 0.4f);
    }
}

TEST(Coarsen, LongTrianglesCountByTheirCorners) {
    for (uint64_t seed = 0; seed < 12; ++seed) {
        IndexedMesh house = test::boxMesh({2, 2, 2}, {40.3, 30.2, 20.7}, 1);
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> unit(0, 1);
        for (int i = 0; i < 20; ++i) {
            const glm::dvec3 low = 2.0 + 30.0 * glm::dvec3(unit(random), unit(random), unit(random));
            test::append(house, test::boxMesh(low, low + glm::dvec3(10 * unit(random), 0.3 * unit(random), 0.05), 1));
        }
        const LatticeMesh mesh = withoutStray(house);
        expectWithinStray(mesh, 4, "seed " + std::to_string(seed));
    }
}

TEST(Coarsen, AClusterMayHaveThousandsOfTriangles) {
    // A fan about one point and a ball that is much smaller than a cluster.
    IndexedMesh mesh = test::sphereMesh({5.3, 5.3, 5.3}, 0.2, 60);
    const uint32_t hub = uint32_t(mesh.positions.size());
    mesh.positions.push_back({12, 12, 4});
    for (uint32_t i = 0; i < 3000; ++i) {
        const double a = test::kTwoPi * i / 3000;
        mesh.positions.push_back({12 + 8 * std::cos(a), 12 + 8 * std::sin(a), 4 + std::sin(7 * a)});
        mesh.triangles.push_back({hub, hub + 1 + i, hub + 1 + (i + 1) % 3000});
    }
    expectWithinStray(withoutStray(mesh), 3, "fan and ball");
}

TEST(Coarsen, TrianglesBecomeFew) {
    LatticeMesh mesh = withoutStray(test::sphereMesh({140, 140, 140}, 120, 150));
    mesh = coarsen(mesh);
    const size_t first = mesh.triangles.size();
    for (int level = 1; level < 4; ++level) {
        const size_t before = mesh.triangles.size();
        mesh = coarsen(mesh);
        EXPECT_LT(mesh.triangles.size() * 14, before * 5) << level;
    }
    EXPECT_LT(mesh.triangles.size() * 40, first);
}

/// A triangle by what it looks like, not by its numbers.
using Shape = std::array<std::array<int64_t, 5>, 3>;
std::map<Shape, float> shapesOf(const LatticeMesh& mesh) {
    std::map<Shape, float> shapes;
    for (size_t k = 0; k < mesh.triangles.size(); ++k) {
        Shape s;
        for (int i = 0; i < 3; ++i) {
            const uint32_t v = mesh.triangles[k][i];
            s[i] = {mesh.positions[v].x, mesh.positions[v].y, mesh.positions[v].z, mesh.colours[v], mesh.normals[v]};
        }
        std::sort(s.begin(), s.end());
        shapes[s] = mesh.stray[k];
    }
    return shapes;
}

TEST(Coarsen, NumberingDoesNotMatter) {
    for (uint64_t seed = 0; seed < 12; ++seed) {
        std::mt19937_64 random(seed);
        LatticeMesh mesh = withoutStray(seed % 2 ? randomTriangles(seed) : randomSurface(seed));
        for (size_t v = 0; v < mesh.positions.size(); ++v) mesh.colours.push_back(uint32_t(random()));
        for (float& stray : mesh.stray) stray = float(random() % 100) / 1000;
        std::vector<uint32_t> vertex(mesh.positions.size()), triangle(mesh.triangles.size());
        std::iota(vertex.begin(), vertex.end(), 0u);
        std::iota(triangle.begin(), triangle.end(), 0u);
        std::shuffle(vertex.begin(), vertex.end(), random);
        std::shuffle(triangle.begin(), triangle.end(), random);
        LatticeMesh other;
        std::vector<uint32_t> place(vertex.size());
        for (uint32_t i = 0; i < vertex.size(); ++i) {
            place[vertex[i]] = i;
            other.positions.push_back(mesh.positions[vertex[i]]);
            other.colours.push_back(mesh.colours[vertex[i]]);
            other.normals.push_back(mesh.normals[vertex[i]]);
        }
        for (const uint32_t k : triangle) {
            Index3 t = mesh.triangles[k];
            std::shuffle(t.begin(), t.end(), random);
            other.triangles.push_back({place[t[0]], place[t[1]], place[t[2]]});
            other.stray.push_back(mesh.stray[k]);
        }
        for (int level = 0; level < 3; ++level) {
            mesh = coarsen(mesh);
            other = coarsen(other);
            ASSERT_EQ(shapesOf(mesh), shapesOf(other)) << "seed " << seed << " level " << level;
        }
    }
}

TEST(Coarsen, WhatIsFarAwayDoesNotMatter) {
    // A part of the mesh gives the same triangles as the whole, but near the cut.
    const LatticeMesh whole = withoutStray(randomSurface(2));
    LatticeMesh part = whole;
    const int32_t cut = 26 * kLatticePerCell;
    part.triangles.clear();
    for (const Index3& t : whole.triangles)
        if (std::min({whole.positions[t[0]].x, whole.positions[t[1]].x, whole.positions[t[2]].x}) < cut)
            part.triangles.push_back(t);
    part.stray.resize(part.triangles.size());
    ASSERT_LT(part.triangles.size(), whole.triangles.size());
    const auto shapes = [](LatticeMesh mesh) {
        mesh.colours.assign(mesh.positions.size(), 0);
        return shapesOf(mesh);
    };
    const auto all = shapes(coarsen(whole)), some = shapes(coarsen(part));
    // What reaches within so far of the cut may differ: a cluster, its triangles, their clusters, and again.
    const int64_t near = (cut - 10 * kLatticePerCell) / 2;
    size_t compared = 0;
    for (const auto& [shape, stray] : all) {
        if (std::max({shape[0][0], shape[1][0], shape[2][0]}) >= near) continue;
        const auto found = some.find(shape);
        ASSERT_NE(found, some.end());
        ASSERT_EQ(found->second, stray);
        ++compared;
    }
    EXPECT_GT(compared, 10u);
}

TEST(Coarsen, ColoursAndNormalsAreMeans) {
    LatticeMesh mesh;
    // Two vertices in one cluster, the others on their own.
    mesh.positions = {{0, 0, 0}, {100, 0, 0}, {4 * 2048, 0, 0}, {0, 4 * 2048, 0}};
    mesh.colours = {0xff000010u, 0xff00ff31u, 0x80402010u, 0xffffffffu};
    mesh.normals = {packNormal(glm::normalize(glm::dvec3(0.2, 0, 1)), false),
                    packNormal(glm::normalize(glm::dvec3(0.2, 0, -1)), false), packNormal({0, 0, 1}, true),
                    packNormal({0, 0, 1}, false)};
    mesh.triangles = {{0, 2, 3}, {1, 2, 3}};
    mesh.stray.assign(2, 0);
    const LatticeMesh coarse = coarsen(mesh);
    ASSERT_EQ(coarse.positions.size(), 3u);
    EXPECT_EQ(coarse.triangles.size(), 1u);  // both became the same
    const auto at = [&](glm::i32vec3 low, glm::i32vec3 high) {
        for (size_t v = 0; v < 3; ++v)
            if (glm::all(glm::lessThanEqual(low, coarse.positions[v])) &&
                glm::all(glm::lessThanEqual(coarse.positions[v], high)))
                return v;
        ADD_FAILURE();
        return size_t{0};
    };
    const size_t both = at({0, 0, 0}, {50, 0, 0}), right = at({4096, 0, 0}, {4096, 0, 0});
    // Half of the light of white is stored as 0xbc; that of 0x10 and 0x31 as 0x24.
    EXPECT_EQ(coarse.colours[both], 0xff00bc24u);
    EXPECT_EQ(coarse.colours[right], 0x80402010u);
    // Taken without a sign, the two normals' mean is upright.
    EXPECT_GT(std::abs(f64::decodeNormal(coarse.normals[both]).z), 0.9999);
    EXPECT_EQ(coarse.normals[both] & kNormalCreaseBit, 0u);
    EXPECT_EQ(coarse.normals[right] & kNormalCreaseBit, kNormalCreaseBit);
}

}  // namespace
}  // namespace vcp
