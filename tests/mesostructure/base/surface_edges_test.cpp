#include "mesostructure/base/surface_edges.h"

#include <map>
#include <set>
#include <string_view>

#include <gtest/gtest.h>

#include "mesostructure/base/manifold_part.h"
#include "tests/mesostructure/base/surfaces.h"

namespace vcp::meso {
namespace {

using namespace test;

SurfaceEdges edges(const BaseSurface& surface) {
    const auto found = edgesOf(surface);
    EXPECT_TRUE(found) << found.error().line();
    return found ? *found : SurfaceEdges();
}

std::string refusal(const BaseSurface& surface) {
    const auto found = edgesOf(surface);
    EXPECT_FALSE(found);
    return found ? "" : found.error().line();
}

TEST(SurfaceEdges, AreCounted) {
    const SurfaceEdges closed = edges(tetrahedron());
    EXPECT_EQ(closed.all, 6u);
    EXPECT_EQ(closed.border, 0u);
    EXPECT_EQ(closed.parts, 1u);
    EXPECT_EQ(closed.firstBorder, "");
    const SurfaceEdges open = edges(square(4));
    EXPECT_EQ(open.all, 4u * 5 * 2 + 16);
    EXPECT_EQ(open.border, 16u);
    EXPECT_EQ(open.seams, 0u);
    EXPECT_EQ(open.firstBorder, "from (0, 0, 0) to (0.25, 0, 0)");
    EXPECT_EQ(open.firstBorderTriangle, 0u);
    const SurfaceEdges two = edges(both(tetrahedron(), tetrahedron(), {3, 0, 0}));
    EXPECT_EQ(two.parts, 2u);
    EXPECT_EQ(two.border, 0u);
}

TEST(SurfaceEdges, ShapesAreManifoldAndClosed) {
    // The teapot's handle touches its body at a corner.
    const std::map<std::string_view, uint32_t> parts = {{"teapot", 4}, {"bird", 3}, {"dinosaur", 5}, {"tree", 13}};
    const std::set<std::string_view> open = {"quad", "teapot", "vase", "tree"};
    for (const auto name : baseSurfaceNames()) {
        const SurfaceEdges found = edges(shape(std::string(name).c_str()));
        EXPECT_EQ(found.border > 0, open.contains(name)) << name;
        EXPECT_EQ(found.parts, parts.contains(name) ? parts.at(name) : 1u) << name;
        // A map of one sheet has a seam all the same where its ends meet.
        EXPECT_EQ(found.seams > 0, name != "quad") << name;
    }
    EXPECT_EQ(edges(shape("box")).seams, 12u * 16);
    EXPECT_EQ(edges(shape("sphere")).seams, 12u * 20);
    EXPECT_EQ(edges(shape("torus")).seams, 96u + 40u);
}

TEST(SurfaceEdges, WhatIsNotManifoldIsNamed) {
    BaseSurface fin = tetrahedron();
    fin.positions.push_back({5, 5, 5});
    fin.triangles.push_back({0, 1, 4});
    EXPECT_EQ(refusal(fin),
              "triangle 4: 3 triangles meet at the edge from (0, 0, 0) to (1, 0, 0), where a surface has two at most; "
              "take apart what only touches, or remove what lies inside");
    BaseSurface turned = tetrahedron();
    std::swap(turned.triangles[2][0], turned.triangles[2][1]);
    EXPECT_NE(refusal(turned).find("is turned against triangle"), std::string::npos);
    BaseSurface twice = tetrahedron();
    twice.triangles.push_back(twice.triangles[0]);
    EXPECT_NE(refusal(twice).find("3 triangles meet"), std::string::npos);
}

TEST(SurfaceEdges, PartsMayTouchAtACorner) {
    // Two closed parts, a closed and an open one, and two open ones.
    BaseSurface closed = both(tetrahedron(), tetrahedron(), {1, 0, 0});
    joinPositions(closed);
    BaseSurface one = both(tetrahedron(), square(1), {1, 0, 0}), open = both(square(1), square(1), {1, 1, 0});
    one.uvs.clear();
    joinPositions(one), joinPositions(open);
    EXPECT_EQ(closed.positions.size(), 7u);
    EXPECT_EQ(edges(closed).parts, 2u);
    EXPECT_EQ(edges(closed).border, 0u);
    EXPECT_EQ(edges(one).parts, 2u);
    EXPECT_EQ(edges(one).border, 4u);
    EXPECT_EQ(edges(open).parts, 2u);
    EXPECT_EQ(edges(open).border, 8u);
}

TEST(SurfaceEdges, TrianglesWithEqualCornersAreLeftOut) {
    BaseSurface surface = tetrahedron();
    surface.triangles.push_back({1, 1, 2});
    surface.triangles.push_back({3, 3, 3});
    EXPECT_EQ(edges(surface).triangles, 4u);
    EXPECT_EQ(edges({}).all, 0u);
    EXPECT_EQ(edges({{{0, 0, 0}}, {{0, 0, 0}}, {}}).triangles, 0u);
}

TEST(SurfaceEdges, FindTheirOtherSides) {
    // A torus with a hole, against a search.
    const BaseSurface torus = shape("torus");
    auto triangles = torus.triangles;
    triangles.erase(triangles.begin() + 5, triangles.begin() + 9);
    const std::vector<uint32_t> opposite = oppositeEdges(triangles, torus.positions.size());
    ASSERT_EQ(opposite.size(), 3 * triangles.size());
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> numbers;
    for (uint32_t e = 0; e < opposite.size(); ++e)
        numbers[{triangles[e / 3][e % 3], triangles[e / 3][(e + 1) % 3]}] = e;
    size_t open = 0;
    for (const auto& [ends, edge] : numbers) {
        const auto found = numbers.find({ends.second, ends.first});
        ASSERT_EQ(opposite[edge], found == numbers.end() ? kNoEdge : found->second) << edge;
        open += found == numbers.end();
    }
    EXPECT_GT(open, 3u);
}

TEST(SurfaceEdges, FoldsAreLeftOut) {
    // Two triangles back to back on an edge of a tetrahedron, and a third one that is no fold.
    BaseSurface surface = tetrahedron();
    const BaseSurface whole = surface;
    surface.positions.push_back({5, 5, 5});
    surface.triangles.insert(surface.triangles.begin() + 1, {0, 1, 4});
    surface.triangles.push_back({4, 1, 0});
    EXPECT_EQ(leaveOutFolds(surface), 2u);
    EXPECT_EQ(surface.triangles, whole.triangles);
    EXPECT_EQ(leaveOutFolds(surface), 0u);
    // Of two on one side and one on the other, one stays.
    surface.triangles = {{0, 1, 2}, {2, 1, 0}, {1, 2, 0}};
    EXPECT_EQ(leaveOutFolds(surface), 2u);
    EXPECT_EQ(surface.triangles, (std::vector<std::array<uint32_t, 3>>{{1, 2, 0}}));
}

TEST(SurfaceEdges, AFanOfAMillionTakesNoLongerThanItsTriangles) {
    const BaseSurface cone = doubleCone(500'000);
    EXPECT_EQ(edges(cone).all, 1'500'000u);
    const std::vector<uint32_t> opposite = oppositeEdges(cone.triangles, cone.positions.size());
    for (uint32_t e = 0; e < opposite.size(); ++e) ASSERT_EQ(opposite[opposite[e]], e);
}

TEST(JoinPositions, NumbersInTheOrderInWhichPlacesFirstCome) {
    BaseSurface surface{
        {{2, 0, 0}, {0.0, 1, 0}, {2, 0, 0}, {-0.0, 1, 0}, {1, 1, 1}, {2, 0, 0}}, {{0, 1, 4}, {2, 3, 4}, {5, 4, 1}}, {}};
    joinPositions(surface);
    EXPECT_EQ(surface.positions, (std::vector<glm::dvec3>{{2, 0, 0}, {0, 1, 0}, {1, 1, 1}}));
    EXPECT_EQ(surface.triangles, (std::vector<std::array<uint32_t, 3>>{{0, 1, 2}, {0, 1, 2}, {0, 2, 1}}));
}

}  // namespace
}  // namespace vcp::meso
