// Sheets that touch along edges are parted, and what is closed stays closed.
#include "mesostructure/base/manifold_part.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "mesostructure/base/surface_edges.h"

namespace vcp::meso {
namespace {

/// A double cone about the z axis at a place: closed, of 2 * sides triangles.
BaseSurface doubleCone(uint32_t sides, glm::dvec3 at) {
    BaseSurface made;
    for (uint32_t i = 0; i < sides; ++i) {
        const double turn = 2 * M_PI * i / sides;
        made.positions.push_back(at + glm::dvec3(std::cos(turn), std::sin(turn), 0));
        const uint32_t next = (i + 1) % sides;
        made.triangles.push_back({i, next, sides});
        made.triangles.push_back({next, i, sides + 1});
    }
    made.positions.push_back(at + glm::dvec3(0, 0, 1));
    made.positions.push_back(at - glm::dvec3(0, 0, 1));
    return made;
}

/// Adds a surface whose corners 0 and 1 become corners of the other, turned so that the edges between them meet.
void touch(BaseSurface& to, const BaseSurface& other, uint32_t a, uint32_t b) {
    const auto first = uint32_t(to.positions.size());
    to.positions.insert(to.positions.end(), other.positions.begin(), other.positions.end());
    for (auto t : other.triangles) {
        for (uint32_t& corner : t) corner = corner == 0 ? a : corner == 1 ? b : first + corner;
        to.triangles.push_back(t);
    }
}

uint64_t dropped(BaseSurface surface) { return keepManifoldPart(surface); }

TEST(ManifoldPart, SheetsThatTouchAreParted) {
    for (const bool isTurned : {false, true}) {
        BaseSurface surface = doubleCone(20, {0, 0, 0});
        touch(surface, doubleCone(12, {2, 0, 0}), isTurned ? 1 : 0, isTurned ? 0 : 1);
        ASSERT_GT(dropped(surface), 0u) << "an edge has four triangles";
        const std::vector<glm::dvec3> before = surface.positions;
        partSheets(surface);
        EXPECT_EQ(surface.triangles.size(), 2u * (20 + 12));
        EXPECT_EQ(dropped(surface), 0u);
        const auto edges = edgesOf(surface);
        ASSERT_TRUE(edges) << edges.error().line();
        EXPECT_EQ(edges->border, 0u);
        EXPECT_EQ(edges->parts, 2u);
        // Two corners are new, and near those that they were.
        ASSERT_EQ(surface.positions.size(), before.size() + 2);
        for (size_t i = before.size(); i < surface.positions.size(); ++i) {
            double nearest = 1e300;
            for (const uint32_t k : {0u, 1u})
                nearest = std::min(nearest, glm::distance(surface.positions[i], before[k]));
            EXPECT_GT(nearest, 0);
            EXPECT_LT(nearest, 0.2);
        }
    }
}

TEST(ManifoldPart, PocketsOfAFewTrianglesGo) {
    BaseSurface surface = doubleCone(40, {0, 0, 0});
    const auto whole = surface.triangles;
    touch(surface, doubleCone(3, {2, 0, 0}), 0, 1);
    partSheets(surface);
    EXPECT_EQ(surface.triangles, whole);
}

TEST(ManifoldPart, BordersStayAndWhatIsNoPinchIsLeftAsItIs) {
    // Open below, so that the edge that is shared has a border of its own.
    BaseSurface open = doubleCone(20, {0, 0, 0});
    std::erase_if(open.triangles, [](const auto& t) { return t[2] == 21; });
    BaseSurface same = open;
    partSheets(same);
    EXPECT_EQ(same.triangles, open.triangles);
    EXPECT_EQ(same.positions, open.positions);
    touch(open, doubleCone(12, {2, 0, 0}), 0, 1);
    const size_t corners = open.positions.size();
    partSheets(open);
    EXPECT_EQ(dropped(open), 0u);
    ASSERT_EQ(open.positions.size(), corners + 2);
    EXPECT_EQ(edgesOf(open)->border, 20u);
    for (size_t i = 0; i < 20; ++i) EXPECT_EQ(open.triangles[i][0], i) << "corners on the border are where they were";
}

}  // namespace
}  // namespace vcp::meso
