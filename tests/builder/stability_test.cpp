// Meshes that break builders: what is built of them is compared with the oracle, at every level. No ray may
// slip through, and nothing may lie farther from the mesh than the certified error.
#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "builder/measure/ray_classes.h"
#include "octree/reference_caster.h"
#include "tests/support/built_mesh.h"

namespace vcp {
namespace {

using Built = test::BuiltMesh;

struct Ray {
    glm::dvec3 origin, direction;
};

glm::dvec3 randomDirection(std::mt19937_64& random) {
    std::normal_distribution<double> normal;
    return glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
}

/// Rays from around the mesh to points on it and beside it, along its triangles, and along the axes in the
/// planes of the grid.
std::vector<Ray> raysAt(const Built& built, size_t count, uint64_t seed) {
    const IndexedMesh& mesh = built.bvh().mesh();
    const glm::dvec3 low = built.bvh().low(), high = built.bvh().high();
    const double radius = 0.5 * glm::distance(low, high);
    const Dataset& dataset = built.cache().dataset();
    const glm::dvec3 origin(dataset.header.origin[0], dataset.header.origin[1], dataset.header.origin[2]);
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    std::vector<Ray> rays;
    while (rays.size() < count) {
        const auto t = mesh.corners(random() % mesh.triangles.size());
        const double u = unit(random), v = unit(random) * (1 - u);
        glm::dvec3 target = t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0]);
        glm::dvec3 direction = randomDirection(random);
        switch (rays.size() % 6) {
            case 0:
                break;
            case 1:
                target = t[random() % 3];
                break;  // a vertex
            case 2:
                target = t[0] + u * (t[1] - t[0]);
                break;  // an edge
            case 3: {   // grazing: nearly in the triangle's plane
                const glm::dvec3 in = t[1] - t[0], normal = glm::cross(in, t[2] - t[0]);
                if (glm::length(in) > 0 && glm::length(normal) > 0)
                    direction = glm::normalize(glm::normalize(in) +
                                               std::pow(10.0, -1 - 7 * unit(random)) * glm::normalize(normal));
                break;
            }
            case 4: {  // along an axis, in a plane of the grid
                const int axis = int(random() % 3);
                direction = glm::dvec3(0);
                direction[axis] = random() % 2 ? 1 : -1;
                const int across = (axis + 1) % 3;
                target[across] = origin[across] + std::round((target[across] - origin[across]) / dataset.header.cell) *
                                                      dataset.header.cell;
                break;
            }
            default:
                target += radius * 0.3 * randomDirection(random);
        }
        rays.push_back({target - 3.0 * radius * direction, direction});
    }
    return rays;
}

// What floats may add where a ray meets a triangle nearly edge-on, of the distance it came.
constexpr double kFloatSlack = 2e-5;

/// `coarsest`: the first level that rays are cast at.
void expectRight(const Built& built, size_t rays = 6000, uint32_t coarsest = 0) {
    ASSERT_TRUE(built.ok());
    for (uint32_t level = std::min(coarsest, built.levels() - 1); level < built.levels(); ++level) {
        const Dataset& dataset = built.cache().dataset();
        const auto cut = cutAtLevel(dataset, level);
        const double certified = dataset.header.level[level].certifiedError;
        EXPECT_LE(certified, 2 * dataset.cellOf(level)) << "level " << level;
        const RayJudge judge(built.bvh(), dataset.cellOf(level), certified);
        for (const bool single : {false, true}) {
            SCOPED_TRACE(testing::Message()
                         << "level " << level << " of " << built.levels() << (single ? ", float" : ""));
            const auto caster =
                ReferenceCaster::create(built.cache(), cut, {.singlePrecision = single, .steps = single ? 8 : 64});
            ASSERT_TRUE(caster.ok());
            RayClassTable table;
            // Those of the finest level are the same however many levels are above it.
            for (const Ray& ray : raysAt(built, rays, built.levels() - 1 - level)) {
                const auto hit = caster->cast({ray.origin, ray.direction});
                const double slack = single && hit ? kFloatSlack * hit->t : 0;
                table.add(judge.judge(
                    ray.origin, ray.direction,
                    hit ? std::optional(SurfaceHit{hit->t, hit->normal, hit->certifiedError + slack}) : std::nullopt));
            }
            EXPECT_EQ(table.holes(), 0u);
            EXPECT_EQ(table.tooFar(), 0u);
            EXPECT_EQ(table.count(RayClass::Unresolved), 0u);
            EXPECT_GT(table.count(RayClass::Hit), 0u);
        }
    }
    test::expectWithinCertified(built, 3000);
}

void expectRight(const IndexedMesh& mesh, double cell, size_t rays = 6000) { expectRight(Built(mesh, cell), rays); }

/// A wavy sheet of n by n quads over the unit square, its vertices moved by up to `noise` edges.
IndexedMesh sheet(uint32_t n, double noise = 0, uint64_t seed = 1) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(-0.5, 0.5);
    IndexedMesh mesh;
    for (uint32_t j = 0; j <= n; ++j)
        for (uint32_t i = 0; i <= n; ++i) {
            const double x = double(i) / n, y = double(j) / n;
            mesh.positions.push_back(glm::dvec3(x, y, 0.1 * std::sin(7 * x) * std::cos(5 * y)) +
                                     noise / n * glm::dvec3(unit(random), unit(random), unit(random)));
        }
    for (uint32_t j = 0; j < n; ++j)
        for (uint32_t i = 0; i < n; ++i) {
            const uint32_t a = j * (n + 1) + i;
            mesh.triangles.push_back({a, a + 1, a + n + 2});
            mesh.triangles.push_back({a, a + n + 2, a + n + 1});
        }
    return mesh;
}

// Cells from 0.3 to 10 edge lengths.
TEST(Stability, CellsOfAllSizes) {
    IndexedMesh mesh = sheet(40, 0.4);
    test::rotate(mesh, {0.5, 0.5, 0}, {3, 1, 2}, 0.8);
    for (const double edges : {0.3, 0.5, 1.0, 2.0, 4.0, 10.0}) {
        SCOPED_TRACE(edges);
        expectRight(mesh, edges / 40, 4000);
    }
}

TEST(Stability, SliversInASurface) {
    // Every quad has a cap along its diagonal, a millionth as high as long: below what the lattice can tell, and
    // a little above it.
    for (const double height : {1e-6, 1e-3}) {
        IndexedMesh mesh = sheet(16, 0.3);
        std::vector<std::array<uint32_t, 3>> triangles;
        for (size_t k = 0; k < mesh.triangles.size(); k += 2) {
            const auto [a, b, c] = mesh.triangles[k];
            const glm::dvec3 pa = mesh.positions[a], pb = mesh.positions[b], pc = mesh.positions[c];
            const auto m = uint32_t(mesh.positions.size());
            mesh.positions.push_back(0.4 * pa + 0.6 * pc + height * (pb - pa));
            for (const std::array<uint32_t, 3> t :
                 {std::array{a, b, m}, std::array{b, c, m}, std::array{a, m, c}, mesh.triangles[k + 1]})
                triangles.push_back(t);
        }
        mesh.triangles = triangles;
        test::rotate(mesh, {0.5, 0.5, 0}, {1, 2, 3}, 0.6);
        for (const double cell : {0.02, 0.06, 0.3}) expectRight(mesh, cell, 3000);
    }
}

TEST(Stability, NeedlesOnTheirOwn) {
    // A thousand cells long and a thousandth wide: aspect 10^6.
    IndexedMesh mesh;
    std::mt19937_64 random(2);
    for (uint32_t i = 0; i < 12; ++i) {
        const glm::dvec3 along = randomDirection(random),
                         across = glm::normalize(glm::cross(along, randomDirection(random)));
        for (const glm::dvec3 p : {glm::dvec3(0), along, along + 3e-6 * across}) mesh.positions.push_back(p);
        mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    expectRight(Built(mesh, 0.001), 1500, ~0u);
}

TEST(Stability, NeedlesThinnerThanTheLattice) {
    // Thirty cells long and 10^-5 of a cell wide, and crumbs of that size: nothing is left of them on the lattice.
    IndexedMesh mesh;
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> unit(0, 1);
    for (uint32_t i = 0; i < 24; ++i) {
        const glm::dvec3 from(unit(random), unit(random), unit(random)), across = randomDirection(random);
        const glm::dvec3 along = i < 16 ? randomDirection(random) : 3e-7 * randomDirection(random);
        for (const glm::dvec3 p : {from, from + along, from + (i % 2 ? 0.4 : 0.0) * along + 3e-7 * across})
            mesh.positions.push_back(p);
        mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    const Built built(mesh, 0.03);
    test::expectWithinCertified(built, 3000);
}

TEST(Stability, SliverFanInASmoothSurface) {
    // A long strip is cut so that each of its parts ends in a point on the other side: caps and needles.
    IndexedMesh mesh;
    constexpr uint32_t kParts = 200;
    for (uint32_t i = 0; i <= kParts; ++i) mesh.positions.push_back({double(i) / kParts, 0.002 * std::sin(i * 0.1), 0});
    mesh.positions.push_back({0.5, 1, 0.2});
    mesh.positions.push_back({0.5, -1e-6, 0});
    for (uint32_t i = 0; i < kParts; ++i) mesh.triangles.push_back({i, i + 1, kParts + 1});
    mesh.triangles.push_back({0, kParts, kParts + 2});
    expectRight(mesh, 0.05);
}

TEST(Stability, PointAndSegmentTriangles) {
    IndexedMesh mesh = sheet(16);
    const auto n = uint32_t(mesh.positions.size());
    for (uint32_t i = 0; i < n; i += 3) mesh.triangles.push_back({i, i, i});
    for (uint32_t i = 0; i + 1 < n; i += 3) mesh.triangles.push_back({i, i + 1, i});
    // Points away from the surface: nothing is built of them.
    mesh.positions.push_back({0.5, 0.5, 0.9});
    mesh.triangles.push_back({n, n, n});
    const Built built(mesh, 0.04);
    ASSERT_TRUE(built.ok());
    EXPECT_GT(built.report().degenerateTriangles, 150u);
    // The oracle has the surface without them.
    IndexedMesh clean = sheet(16);
    clean.positions.push_back({0.5, 0.5, 0.9});
    expectRight(Built(clean, 0.04));
}

TEST(Stability, OriginsFarAway) {
    // UTM coordinates, and an origin ten million cells away, in cells that are no power of two.
    for (const glm::dvec3 origin :
         {glm::dvec3(483920.25, 5430128.5, 312.125), glm::dvec3(-4e5, 4e5, 0), glm::dvec3(4e5 / 3)}) {
        IndexedMesh mesh = sheet(24, 0.3);
        test::append(mesh, test::boxMesh({0.3, 0.3, 0.2}, {0.7, 0.6, 0.5}, 4));
        for (glm::dvec3& p : mesh.positions) p += origin;
        expectRight(mesh, 0.04, 4000);
    }
}

TEST(Stability, ManyScales) {
    for (const double scale : {1e-6, 1e6}) {
        IndexedMesh mesh = sheet(20, 0.3);
        for (glm::dvec3& p : mesh.positions) p = p * scale;
        expectRight(mesh, 0.05 * scale, 3000);
    }
}

TEST(Stability, NonManifold) {
    // Five fins at one edge, a bow tie, and an edge that four triangles share.
    IndexedMesh mesh;
    for (int k = 0; k <= 10; ++k) mesh.positions.push_back({0, 0, k * 0.1});
    for (int fin = 0; fin < 5; ++fin) {
        const double a = fin * 1.1;
        const auto v = uint32_t(mesh.positions.size());
        for (int k = 0; k <= 10; ++k) mesh.positions.push_back({0.6 * std::cos(a), 0.6 * std::sin(a), k * 0.1});
        for (uint32_t k = 0; k < 10; ++k) {
            mesh.triangles.push_back({k, k + 1, v + k});
            mesh.triangles.push_back({k + 1, v + k + 1, v + k});
        }
    }
    IndexedMesh tie;
    tie.positions = {{1, 0, 0}, {0.7, 0.3, 0.4}, {0.8, -0.3, 0.3}, {1.4, 0.2, 0.1}, {1.3, -0.3, -0.2}, {1, 0, 1}};
    tie.triangles = {{0, 1, 2}, {0, 3, 4}, {0, 5, 1}, {0, 5, 2}, {0, 5, 3}, {0, 5, 4}};
    test::append(mesh, tie);
    expectRight(mesh, 0.03);
    expectRight(mesh, 0.2);
}

TEST(Stability, NonOrientable) {
    // A Moebius strip: open, too.
    IndexedMesh mesh;
    constexpr uint32_t kAround = 80, kAcross = 8;
    for (uint32_t i = 0; i < kAround; ++i)
        for (uint32_t j = 0; j <= kAcross; ++j) {
            const double a = test::kTwoPi * i / kAround, w = 0.6 * (double(j) / kAcross - 0.5);
            const double r = 1 + w * std::cos(a / 2);
            mesh.positions.push_back({r * std::cos(a), r * std::sin(a), w * std::sin(a / 2)});
        }
    for (uint32_t i = 0; i < kAround; ++i)
        for (uint32_t j = 0; j < kAcross; ++j) {
            const auto at = [&](uint32_t u, uint32_t v) { return u < kAround ? u * (kAcross + 1) + v : kAcross - v; };
            mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    expectRight(mesh, 0.05);
    // A Klein bottle: closed, non-orientable, through itself.
    expectRight(
        test::gridSurface(60, 60, false,
                          [](double u, double v) {
                              const double a = u * test::kTwoPi, b = v * test::kTwoPi;
                              const double r = 2 + std::cos(b / 2) * std::sin(a) - std::sin(b / 2) * std::sin(2 * a);
                              return glm::dvec3(r * std::cos(b), r * std::sin(b),
                                                std::sin(b / 2) * std::sin(a) + std::cos(b / 2) * std::sin(2 * a));
                          }),
        0.12);
}

TEST(Stability, Open) {
    // Holes of all sizes and isolated triangles, some smaller than a cell.
    IndexedMesh mesh = sheet(40);
    std::mt19937_64 random(4);
    std::erase_if(mesh.triangles, [&](const auto&) { return random() % 3 == 0; });
    expectRight(mesh, 0.03);
    expectRight(mesh, 0.11);
}

TEST(Stability, SelfIntersecting) {
    IndexedMesh mesh = sheet(20);
    for (int k = 1; k < 4; ++k) {
        IndexedMesh other = sheet(20);
        test::rotate(other, {0.5, 0.5, 0}, {1, 0.3 * k, 0.1}, 0.5 * k);
        test::append(mesh, other);
    }
    expectRight(mesh, 0.04);
}

TEST(Stability, Duplicated) {
    // Everything three times, once turned inside out, once moved by less than the lattice can tell.
    const IndexedMesh once = sheet(20, 0.3);
    IndexedMesh mesh = once, inside = once, moved = once;
    for (auto& t : inside.triangles) std::swap(t[0], t[1]);
    for (glm::dvec3& p : moved.positions) p += 1e-9;
    test::append(mesh, inside);
    test::append(mesh, moved);
    expectRight(mesh, 0.05);
}

TEST(Stability, Nested) {
    // Shells that are less than a cell apart.
    IndexedMesh mesh;
    for (const double radius : {0.5, 0.51, 0.55, 0.9, 0.9001})
        test::append(mesh, test::sphereMesh({0.1, 0.2, 0.3}, radius, 16));
    expectRight(mesh, 0.06);
}

TEST(Stability, AxisAlignedOnGridPlanes) {
    // The grid begins a cell below the mesh: its faces, edges and vertices lie on planes, in page walls as well.
    IndexedMesh mesh = test::boxMesh({0, 0, 0}, {2, 2, 2}, 4);
    test::append(mesh, test::boxMesh({0.5, 0.5, 0.5}, {1.5, 1.5, 1.5}, 2));
    expectRight(mesh, 1.0 / 16);
    expectRight(mesh, 1.0 / 16 / 1.5);
    expectRight(mesh, 1.0 / 3);
}

TEST(Stability, ThinPlatesAndGaps) {
    for (const double cells : {0.4, 0.05, 1e-3}) {
        const double cell = 0.05;
        IndexedMesh mesh = test::boxMesh({0, 0, 0}, {1, 0.7, cells * cell}, 6);
        test::append(mesh, test::boxMesh({0, 0, (cells + 0.5) * cell}, {1, 0.7, 0.3}, 6));
        test::rotate(mesh, {0, 0, 0}, {2, 1, 5}, 0.3);
        expectRight(mesh, cell, 4000);
    }
}

TEST(Stability, GrazingRaysAlongALongWall) {
    // Ten thousand cells are seen edge-on.
    IndexedMesh mesh = test::boxMesh({0, 0, 0}, {100, 0.05, 3}, 1);
    test::rotate(mesh, {0, 0, 0}, {1, 2, 3}, 0.2);
    expectRight(mesh, 0.1, 3000);
}

TEST(Stability, WallsThinnerThanACell) {
    // A thousand cells long: one triangle in each face, so that the narrow faces are needles.
    IndexedMesh mesh = test::boxMesh({0, 0, 0}, {100, 0.05, 3}, 1);
    test::rotate(mesh, {0, 0, 0}, {1, 2, 3}, 0.2);
    expectRight(Built(mesh, 0.1), 60000, ~0u);
}

TEST(Stability, RandomSoup) {
    for (uint64_t seed = 0; seed < 3; ++seed) {
        // Coarser levels merge triangles that lie apart: the finest only.
        const IndexedMesh mesh = test::randomTriangles(400, seed, false);
        expectRight(Built(mesh, 0.02), 3000, ~0u);
        expectRight(Built(mesh, 0.2), 3000, ~0u);
    }
}

}  // namespace
}  // namespace vcp
