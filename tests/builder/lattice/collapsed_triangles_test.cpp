// What is kept of triangles that have no area on the lattice.
#include "builder/lattice/collapsed_triangles.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "builder/lattice/lattice_mesh.h"

namespace vcp {
namespace {

LatticeTriangle triangle(glm::i32vec3 a, glm::i32vec3 b, glm::i32vec3 c, uint32_t colour = 0xffffffff) {
    LatticeTriangle t{};
    t.corner[0] = a;
    t.corner[1] = b;
    t.corner[2] = c;
    for (uint32_t& v : t.colour) v = colour;
    return t;
}

// Pages of 1000 lattice points an edge, each a bin of its own.
glm::i32vec3 pageOf(glm::i32vec3 p) { return p / 1000; }
bool samePage(glm::i32vec3 p, glm::i32vec3 q) { return pageOf(p) == pageOf(q); }

std::vector<LatticeTriangle> kept(std::vector<LatticeTriangle> soup, glm::i32vec3 page = {0, 0, 0}) {
    keepCollapsed(
        soup, [&](glm::i32vec3 p) { return pageOf(p) == page; }, samePage, [](glm::i32vec3) { return 1; });
    return soup;
}

bool hasEdge(const LatticeTriangle& t, glm::i32vec3 a, glm::i32vec3 b) {
    const auto has = [&](glm::i32vec3 p) { return t.corner[0] == p || t.corner[1] == p || t.corner[2] == p; };
    return has(a) && has(b);
}

TEST(CollapsedTriangles, TrianglesWithAreaStayAsTheyAre) {
    const auto soup = kept({triangle({0, 0, 0}, {5, 0, 0}, {0, 5, 0})});
    ASSERT_EQ(soup.size(), 1u);
    EXPECT_EQ(soup[0].stray, 0);
}

TEST(CollapsedTriangles, ASliverOnItsOwnKeepsItsLine) {
    const glm::i32vec3 a{10, 10, 10}, b{40, 10, 10}, c{90, 10, 10};
    const auto soup = kept({triangle(b, c, a, 0xff0000ff)});
    ASSERT_EQ(soup.size(), 2u);
    for (const LatticeTriangle& t : soup) {
        EXPECT_TRUE(hasArea(t.corner[0], t.corner[1], t.corner[2]));
        EXPECT_GE(t.stray, float(kLatticeRounding + 1.0 / 2048));
        EXPECT_EQ(t.colour[2], 0xff0000ffu);
    }
    EXPECT_TRUE(hasEdge(soup[0], a, b) || hasEdge(soup[1], a, b));
    EXPECT_TRUE(hasEdge(soup[0], b, c) || hasEdge(soup[1], b, c));
}

TEST(CollapsedTriangles, BetweenOthersNothingIsMissing) {
    const glm::i32vec3 a{10, 10, 10}, b{40, 10, 10}, c{90, 10, 10}, above{50, 60, 10}, below{50, 0, 10};
    // The sliver a b c lies between a c below and a b, b c above.
    const auto soup = kept({triangle(a, b, c), triangle(a, c, below), triangle(a, b, above), triangle(b, c, above)});
    EXPECT_EQ(soup.size(), 3u);
    // At a border, one of the parts is nobody's edge.
    EXPECT_EQ(kept({triangle(a, b, c), triangle(a, c, below), triangle(a, b, above)}).size(), 3u);
}

TEST(CollapsedTriangles, APointIsKeptUnlessOthersMeetThere) {
    const glm::i32vec3 p{999, 999, 999};
    const auto alone = kept({triangle(p, p, p)});
    ASSERT_EQ(alone.size(), 1u);
    EXPECT_TRUE(hasArea(alone[0].corner[0], alone[0].corner[1], alone[0].corner[2]));
    for (const glm::i32vec3 q : alone[0].corner) EXPECT_TRUE(samePage(p, q));
    EXPECT_EQ(kept({triangle(p, p, p), triangle(p, {0, 0, 0}, {5, 0, 9})}).size(), 1u);
    EXPECT_TRUE(kept({triangle({1500, 0, 0}, {1500, 0, 0}, {1500, 0, 0})}).empty()) << "another bin's";
}

TEST(CollapsedTriangles, BothBinsOfALineKeepTheSame) {
    std::mt19937 random(1);
    for (int i = 0; i < 500; ++i) {
        const auto coordinate = [&] { return int(random() % 2000); };
        const glm::i32vec3 a{coordinate(), coordinate(), 999}, b{coordinate(), coordinate(), 1000};
        const auto inA = kept({triangle(a, b, a)}, pageOf(a)), inB = kept({triangle(b, a, b)}, pageOf(b));
        ASSERT_EQ(inA.size(), 1u);
        ASSERT_EQ(inB.size(), 1u);
        for (int c = 0; c < 3; ++c) EXPECT_EQ(inA[0].corner[c], inB[0].corner[c]);
        // Its third corner is found in the bin of one of its ends.
        EXPECT_TRUE(samePage(inA[0].corner[2], a) || samePage(inA[0].corner[2], b));
    }
}

TEST(CollapsedTriangles, TheOrderDoesNotMatter) {
    std::mt19937 random(2);
    std::vector<LatticeTriangle> soup;
    for (int i = 0; i < 300; ++i) {
        const auto point = [&] { return glm::i32vec3(random() % 6, random() % 6, 3); };
        soup.push_back(triangle(point(), point(), point(), uint32_t(random() % 3)));
    }
    const auto meshOfKept = [&] { return meshOf(kept(soup), false); };
    const LatticeMesh first = meshOfKept();
    EXPECT_LT(first.triangles.size(), 300u);
    for (int i = 0; i < 10; ++i) {
        std::shuffle(soup.begin(), soup.end(), random);
        const LatticeMesh again = meshOfKept();
        EXPECT_EQ(again.positions, first.positions);
        EXPECT_EQ(again.triangles, first.triangles);
        EXPECT_EQ(again.stray, first.stray);
    }
}

}  // namespace
}  // namespace vcp
