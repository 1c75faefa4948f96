// Meshes from bags of triangles, whatever their order; normals.
#include "builder/lattice/lattice_mesh.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "builder/measure/mesh_bvh.h"
#include "octree/surface/packing.h"
#include "tests/support/lattice_meshes.h"
#include "tests/support/test_meshes.h"

namespace vcp {
namespace {

using Positions = std::vector<glm::i32vec3>;
using Triangles = std::vector<std::array<uint32_t, 3>>;

LatticeTriangle latticeTriangle(glm::i32vec3 a, glm::i32vec3 b, glm::i32vec3 c, float stray = 0.5f) {
    LatticeTriangle t{};
    t.corner[0] = a;
    t.corner[1] = b;
    t.corner[2] = c;
    t.stray = stray;
    return t;
}

LatticeTriangle coloured(LatticeTriangle t, uint32_t a, uint32_t b, uint32_t c) {
    t.colour[0] = a;
    t.colour[1] = b;
    t.colour[2] = c;
    return t;
}

TEST(MeshOf, MergesEqualPositions) {
    const LatticeMesh mesh = meshOf(std::vector{latticeTriangle({0, 0, 0}, {9, 0, 0}, {0, 9, 0}, 1),
                                                latticeTriangle({9, 0, 0}, {9, 9, 0}, {0, 9, 0}, 4)},
                                    false);
    // One cell: by z, y, x.
    EXPECT_EQ(mesh.positions, (Positions{{0, 0, 0}, {9, 0, 0}, {0, 9, 0}, {9, 9, 0}}));
    EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {1, 3, 2}}));
    EXPECT_EQ(mesh.stray, (std::vector<float>{1, 4}));
    EXPECT_TRUE(mesh.colours.empty());
}

TEST(MeshOf, VerticesFollowTheMortonCurve) {
    constexpr int32_t cell = kLatticePerCell;
    const LatticeMesh mesh = meshOf(std::vector{latticeTriangle({0, 0, cell}, {cell, 0, 0}, {0, cell - 1, 0}),
                                                latticeTriangle({0, 2 * cell, 0}, {cell, 1, 0}, {5, 5, 5})},
                                    false);
    EXPECT_EQ(mesh.positions,
              (Positions{{0, cell - 1, 0}, {5, 5, 5}, {cell, 0, 0}, {cell, 1, 0}, {0, 0, cell}, {0, 2 * cell, 0}}));
    EXPECT_TRUE(std::is_sorted(mesh.triangles.begin(), mesh.triangles.end()));
}

TEST(MeshOf, OneOfTheRepeatedStaysWithTheLargestStray) {
    const glm::i32vec3 a{0, 0, 0}, b{9, 0, 0}, c{0, 9, 0};
    const std::vector<LatticeTriangle> copies{latticeTriangle(c, b, a, 1), latticeTriangle(a, b, c, 2),
                                              latticeTriangle(b, c, a, 5), latticeTriangle(b, a, c, 3)};
    // The orientation that ascends is kept, whichever comes first.
    for (size_t first = 0; first < copies.size(); ++first) {
        std::vector<LatticeTriangle> soup = copies;
        std::rotate(soup.begin(), soup.begin() + ptrdiff_t(first), soup.end());
        const LatticeMesh mesh = meshOf(soup, false);
        EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}}));
        EXPECT_EQ(mesh.stray, (std::vector<float>{5}));
    }
    EXPECT_EQ(meshOf(std::vector{latticeTriangle(c, b, a)}, false).triangles, (Triangles{{0, 2, 1}}));
}

TEST(MeshOf, ColoursAreMeansOverTheTriangles) {
    const glm::i32vec3 a{0, 0, 0}, b{9, 0, 0}, c{0, 9, 0}, d{9, 9, 0};
    const std::vector<LatticeTriangle> soup{coloured(latticeTriangle(a, b, c), 0xff000001u, 0xff102030u, 0),
                                            coloured(latticeTriangle(b, d, c), 0xff122131u, 7, 0),
                                            coloured(latticeTriangle(d, a, c), 9, 0x00000004u, 3)};
    const LatticeMesh mesh = meshOf(soup, true);
    // Halves are rounded up.
    EXPECT_EQ(mesh.colours, (std::vector<uint32_t>{0x80000003u, 0xff112131u, 1, 8}));
}

TEST(MeshOf, OwnNormalsStayWithTheirCorners) {
    const glm::i32vec3 a{0, 0, 0}, b{9, 0, 0}, c{0, 9, 0}, d{9, 9, 0};
    LatticeTriangle first = latticeTriangle(c, a, b), second = latticeTriangle(b, d, c),
                    turned = latticeTriangle(a, c, b);
    std::copy_n(std::array<uint32_t, 3>{30, 10, 20}.begin(), 3, first.own);
    std::copy_n(std::array<uint32_t, 3>{10, 31, 20}.begin(), 3, turned.own);
    const uint32_t none = kUnknownNormal;
    std::vector<LatticeTriangle> soup{first, second, turned};
    for (int turn = 0; turn < 3; ++turn) {
        std::rotate(soup.begin(), soup.begin() + 1, soup.end());
        LatticeMesh mesh = meshOf(soup, false);
        ASSERT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {1, 3, 2}}));
        // The triangle that is there twice has its least normals.
        EXPECT_EQ(mesh.cornerNormals, (std::vector<std::array<uint32_t, 3>>{{10, 20, 30}, {none, none, none}}));
        mesh.normals = {1, 5, 7, 9};
        EXPECT_EQ(mesh.normalOf(0, 2), 30u);
        EXPECT_EQ(mesh.normalOf(1, 2), 7u);
    }
    EXPECT_TRUE(meshOf(std::vector{second}, false).cornerNormals.empty());
}

TEST(SettleNormals, KeepsWhatIsFarFromTheComputed) {
    // A roof of two slopes, whose ridge is a crease, and a flat beside it.
    const glm::i32vec3 p[] = {{0, 0, 0}, {900, 0, 900}, {0, 900, 0}, {1800, 0, 0}, {900, 900, 900}};
    const std::vector<LatticeTriangle> soup{latticeTriangle(p[0], p[1], p[2]), latticeTriangle(p[1], p[4], p[2]),
                                            latticeTriangle(p[1], p[3], p[4])};
    const auto leaning = [](double degrees) {
        const double a = glm::radians(45 + degrees);
        return packDirection({-std::sin(a), 0, std::cos(a)});
    };
    constexpr double kNear = 0.8 * kSettledDegrees, kFar = 1.2 * kSettledDegrees;
    for (const double degrees : {0.0, kNear, -kNear, kFar, -kFar, 60.0}) {
        LatticeMesh mesh = meshOf(soup, false);
        computeNormals(mesh);
        mesh.cornerNormals.assign(3, {leaning(degrees), kUnknownNormal, leaning(degrees)});
        const auto own = mesh.cornerNormals;
        const bool counts = std::abs(degrees) > kSettledDegrees;
        settleNormals(mesh);
        ASSERT_EQ(mesh.cornerNormals.empty(), false) << "the other slope's";
        size_t ofSlope = 0;
        for (size_t k = 0; k < 3; ++k) {
            const auto& [a, b, c] = mesh.triangles[k];
            const WideVector n = areaNormal(mesh.positions[a], mesh.positions[b], mesh.positions[c]);
            const bool isSlope = (n.x < 0) == (n.z > 0);
            ofSlope += isSlope;
            EXPECT_EQ(mesh.cornerNormals[k][1], kUnknownNormal);
            for (const size_t i : {0, 2})
                EXPECT_EQ(mesh.cornerNormals[k][i], !isSlope || counts ? own[k][i] : kUnknownNormal) << degrees;
        }
        EXPECT_EQ(ofSlope, 2u);
    }
    LatticeMesh mesh = meshOf(std::span(soup).first(2), false);
    computeNormals(mesh);
    mesh.cornerNormals.assign(2, {leaning(0), leaning(kNear), kUnknownNormal});
    settleNormals(mesh);
    EXPECT_TRUE(mesh.cornerNormals.empty()) << "none is left";
}

TEST(MeshOf, NothingIsEmpty) {
    const LatticeMesh mesh = meshOf({}, true);
    EXPECT_TRUE(mesh.positions.empty());
    EXPECT_TRUE(mesh.triangles.empty());
    EXPECT_FALSE(findVertex(mesh, {0, 0, 0}).has_value());
}

TEST(HasArea, IsExactOverTheWholeLattice) {
    constexpr int32_t far = 2147483647;
    EXPECT_FALSE(hasArea({0, 0, 0}, {far, far, far}, {far - 1, far - 1, far - 1}));
    EXPECT_TRUE(hasArea({0, 0, 0}, {far, far, far}, {far, far - 1, far}));
    EXPECT_TRUE(hasArea({0, 0, 0}, {far, far, far}, {0, 0, 1}));
    EXPECT_FALSE(hasArea({5, 5, 5}, {5, 5, 5}, {far, 0, 1}));
    EXPECT_FALSE(hasArea({1, 2, 3}, {1, 2, 3}, {1, 2, 3}));
}

std::vector<LatticeTriangle> randomSoup(uint64_t seed) {
    std::mt19937_64 random(seed);
    const auto any = [&](int n) { return int(random() % uint64_t(n)); };
    std::vector<LatticeTriangle> soup;
    const int side = seed % 2 ? 6 : 100000;
    while (soup.size() < 500) {
        const auto point = [&] { return glm::i32vec3(any(side), any(side), any(side)); };
        LatticeTriangle t = latticeTriangle(point(), point(), point(), float(any(100)));
        if (!soup.empty() && any(3) == 0) std::copy_n(soup[random() % soup.size()].corner, 3, t.corner);
        if (any(2)) std::swap(t.corner[0], t.corner[1]);
        if (hasArea(t.corner[0], t.corner[1], t.corner[2]))
            soup.push_back(coloured(t, uint32_t(random()), uint32_t(random()), 0xff00ff00u));
    }
    return soup;
}

using SortedCorners = std::array<std::array<int, 3>, 3>;

SortedCorners sorted(glm::i32vec3 a, glm::i32vec3 b, glm::i32vec3 c) {
    SortedCorners key{{{a.x, a.y, a.z}, {b.x, b.y, b.z}, {c.x, c.y, c.z}}};
    std::sort(key.begin(), key.end());
    return key;
}

TEST(MeshOf, RandomAgainstMap) {
    for (uint64_t seed = 0; seed < 50; ++seed) {
        const std::vector<LatticeTriangle> soup = randomSoup(seed);
        const LatticeMesh mesh = meshOf(soup, false);
        std::map<SortedCorners, float> want;
        for (const LatticeTriangle& t : soup) {
            float& stray = want[sorted(t.corner[0], t.corner[1], t.corner[2])];
            stray = std::max(stray, t.stray);
        }
        ASSERT_EQ(mesh.triangles.size(), want.size()) << seed;
        for (size_t k = 0; k < mesh.triangles.size(); ++k) {
            const auto& v = mesh.triangles[k];
            const auto found = want.find(sorted(mesh.positions[v[0]], mesh.positions[v[1]], mesh.positions[v[2]]));
            ASSERT_NE(found, want.end()) << seed;
            ASSERT_EQ(mesh.stray[k], found->second) << seed;
            want.erase(found);
        }
        for (uint32_t v = 0; v < mesh.positions.size(); ++v) ASSERT_EQ(findVertex(mesh, mesh.positions[v]), v) << seed;
        ASSERT_FALSE(findVertex(mesh, mesh.positions[0] + glm::i32vec3(1 << 20, 0, 0)).has_value());
    }
}

TEST(MeshOf, OrderDoesNotMatter) {
    for (uint64_t seed = 0; seed < 20; ++seed) {
        std::vector<LatticeTriangle> soup = randomSoup(seed);
        const LatticeMesh before = meshOf(soup, true);
        std::mt19937_64 random(seed);
        std::shuffle(soup.begin(), soup.end(), random);
        // Which corner comes first does not matter either.
        for (LatticeTriangle& t : soup) {
            const auto turn = ptrdiff_t(random() % 3);
            std::rotate(t.corner, t.corner + turn, t.corner + 3);
            std::rotate(t.colour, t.colour + turn, t.colour + 3);
        }
        LatticeMesh after = meshOf(soup, true);
        ASSERT_EQ(before.positions, after.positions) << seed;
        ASSERT_EQ(before.triangles, after.triangles) << seed;
        ASSERT_EQ(before.stray, after.stray) << seed;
        ASSERT_EQ(before.colours, after.colours) << seed;
        LatticeMesh normals = before;
        computeNormals(normals);
        computeNormals(after);
        ASSERT_EQ(normals.normals, after.normals) << seed;
    }
}

TEST(MeshOf, PartsAgreeOnTheOrder) {
    // What a bin sees of a vertex does not depend on what else it has.
    const std::vector<LatticeTriangle> soup = test::soupOf(test::torusMesh({40, 40, 40}, 30, 9, 90, 40));
    LatticeMesh whole = meshOf(soup, false);
    computeNormals(whole);
    std::vector<LatticeTriangle> half;
    for (const LatticeTriangle& t : soup)
        if (std::min({t.corner[0].x, t.corner[1].x, t.corner[2].x}) < 40 * kLatticePerCell) half.push_back(t);
    LatticeMesh part = meshOf(half, false);
    computeNormals(part);
    size_t compared = 0;
    for (uint32_t v = 0; v < part.positions.size(); ++v) {
        if (part.positions[v].x >= 40 * kLatticePerCell) continue;  // some of its triangles are missing
        const auto same = findVertex(whole, part.positions[v]);
        ASSERT_TRUE(same.has_value());
        ASSERT_EQ(part.normals[v], whole.normals[*same]);
        ++compared;
    }
    EXPECT_GT(compared, 1000u);
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
    LatticeMesh mesh = meshOf(std::vector{latticeTriangle({0, 0, 0}, {1 << 19, 0, 0}, {1 << 18, 1, 0})}, false);
    mesh.positions.push_back({1 << 20, 5, 5});
    computeNormals(mesh);
    ASSERT_EQ(mesh.normals.size(), 4u);
    for (int v = 0; v < 3; ++v) EXPECT_GT(std::abs(f64::decodeNormal(mesh.normals[v]).z), 0.9999);
}

}  // namespace
}  // namespace vcp
