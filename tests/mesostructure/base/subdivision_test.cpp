#include "mesostructure/base/subdivision.h"

#include <algorithm>
#include <map>
#include <set>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "mesostructure/base/surface_edges.h"
#include "mesostructure/shell.h"
#include "tests/mesostructure/base/surfaces.h"

namespace vcp::meso {
namespace {

using namespace test;
using glm::dvec3;

BaseSurface finer(const BaseSurface& surface, int times = 1) {
    auto made = subdivided(surface, times);
    EXPECT_TRUE(made) << made.error().line();
    return made ? *std::move(made) : BaseSurface();
}

/// Which corners are beside each corner, and how many triangles each edge has.
struct Neighbours {
    explicit Neighbours(const BaseSurface& surface) : of(surface.positions.size()) {
        for (const auto& t : surface.triangles)
            for (int k = 0; k < 3; ++k) {
                const uint32_t a = t[k], b = t[(k + 1) % 3];
                of[a].insert(b), of[b].insert(a);
                opposite[std::minmax(a, b)].push_back(t[(k + 2) % 3]);
            }
    }
    [[nodiscard]] std::vector<uint32_t> alongBorder(uint32_t corner) const {
        std::vector<uint32_t> found;
        for (const uint32_t other : of[corner])
            if (opposite.at(std::minmax(corner, other)).size() == 1) found.push_back(other);
        return found;
    }
    std::vector<std::set<uint32_t>> of;
    std::map<std::pair<uint32_t, uint32_t>, std::vector<uint32_t>> opposite;
};

/// Loop's weight of each neighbour of a corner that has n.
double beta(double n) {
    const double c = 3.0 / 8 + std::cos(2 * std::numbers::pi / n) / 4;
    return (5.0 / 8 - c * c) / n;
}

/// Loop's rules as they are written, corner by corner and edge by edge: all new positions, in any order.
std::vector<dvec3> expected(const BaseSurface& surface) {
    const Neighbours beside(surface);
    const auto& p = surface.positions;
    std::vector<dvec3> all;
    for (uint32_t i = 0; i < p.size(); ++i) {
        const auto border = beside.alongBorder(i);
        const double b = beta(double(beside.of[i].size()));
        dvec3 sum(0);
        for (const uint32_t other : beside.of[i]) sum += p[other];
        all.push_back(border.empty() ? (1 - b * double(beside.of[i].size())) * p[i] + b * sum
                                     : (6.0 * p[i] + p[border.at(0)] + p[border.at(1)]) / 8.0);
    }
    for (const auto& [edge, opposite] : beside.opposite)
        all.push_back(opposite.size() == 1
                          ? (p[edge.first] + p[edge.second]) / 2.0
                          : (3.0 * (p[edge.first] + p[edge.second]) + p[opposite[0]] + p[opposite[1]]) / 8.0);
    return all;
}

/// How far the positions of `made` are from those of the list, each from the nearest that is left.
double farthest(std::vector<dvec3> list, const BaseSurface& made) {
    double most = 0;
    for (const dvec3 p : made.positions) {
        const auto nearest = std::ranges::min_element(list, {}, [&](dvec3 q) { return glm::distance(p, q); });
        most = std::max(most, glm::distance(p, *nearest));
        *nearest = list.back();
        list.pop_back();
    }
    return most;
}

/// The place that Loop's limit surface has at a corner within (the eigenvector of the eigenvalue 1).
dvec3 limitAt(const BaseSurface& surface, const Neighbours& beside, uint32_t corner) {
    const double n = double(beside.of[corner].size()), own = 3 / (8 * beta(n));
    dvec3 sum = own * surface.positions[corner];
    for (const uint32_t other : beside.of[corner]) sum += surface.positions[other];
    return sum / (own + n);
}

TEST(Subdivision, FollowsLoopsRules) {
    BaseSurface box = shape("box");
    box.positions.resize(box.positions.size());
    for (const BaseSurface& surface : {tetrahedron(), doubleCone(3), doubleCone(7), doubleCone(120), square(1),
                                       square(5, 0.3), both(square(2, 1), tetrahedron(), {0, 0, 4})}) {
        BaseSurface bare = surface;
        bare.uvs.clear();
        const BaseSurface made = finer(bare);
        ASSERT_EQ(made.positions.size(), expected(bare).size());
        EXPECT_EQ(made.triangles.size(), 4 * bare.triangles.size());
        EXPECT_LT(farthest(expected(bare), made), 1e-14);
    }
}

TEST(Subdivision, ComesToLoopsLimitSurface) {
    for (BaseSurface surface : {tetrahedron(), doubleCone(5), doubleCone(60), shape("box")}) {
        surface.uvs.clear();
        const Neighbours coarse(surface);
        for (int times = 1; times <= 3; ++times) {
            const BaseSurface made = finer(surface, times);
            const Neighbours fine(made);
            // Corners keep their numbers; the limit is the same from every level.
            for (uint32_t i = 0; i < surface.positions.size(); ++i)
                EXPECT_LT(glm::distance(limitAt(surface, coarse, i), limitAt(made, fine, i)), 1e-13) << i;
        }
    }
    // An octahedron's corners have four neighbours, which sum to 0: the limit is a multiple of the corner.
    const BaseSurface made = finer(doubleCone(4), 6);
    const double own = 3 / (8 * beta(4)), limit = own / (own + 4);
    double top = 0;
    for (const dvec3 p : made.positions) top = std::max(top, p.z);
    EXPECT_NEAR(top, limit, 1e-3);
}

TEST(Subdivision, KeepsWhatIsClosedAndCountsAsEulerSays) {
    for (const char* name : {"box", "sphere", "torus", "cylinder", "quad", "teapot"}) {
        const BaseSurface surface = shape(name), made = finer(surface, 2);
        const SurfaceEdges before = *edgesOf(surface), after = *edgesOf(made);
        EXPECT_EQ(after.triangles, 16 * before.triangles) << name;
        EXPECT_EQ(after.border, 4 * before.border) << name;
        EXPECT_EQ(after.parts, before.parts) << name;
        EXPECT_EQ(after.seams, 4 * before.seams) << name;
        EXPECT_EQ(after.all, 2 * (2 * before.all + 3 * before.triangles) + 12 * before.triangles) << name;
        EXPECT_TRUE(buildShell(made, 0.01, {1, 1, 0.1})) << name;
    }
}

TEST(Subdivision, KeepsTheMapOfEachTriangle) {
    const BaseSurface surface = shape("box"), made = finer(surface);
    ASSERT_EQ(made.uvs.size(), made.triangles.size());
    const auto area = [](const std::array<glm::dvec2, 3>& m) {
        return (m[1].x - m[0].x) * (m[2].y - m[0].y) - (m[2].x - m[0].x) * (m[1].y - m[0].y);
    };
    for (size_t i = 0; i < made.uvs.size(); ++i) EXPECT_NEAR(area(made.uvs[i]), area(surface.uvs[i / 4]) / 4, 1e-15);
    // The corners of triangle i are corners of 4 i, 4 i + 1 and 4 i + 2; the middle one has their middles.
    for (size_t i = 0; i < surface.uvs.size(); ++i)
        for (int k = 0; k < 3; ++k) {
            EXPECT_EQ(made.uvs[4 * i + size_t(k)][k], surface.uvs[i][k]);
            EXPECT_EQ(made.uvs[4 * i + 3][k], 0.5 * (surface.uvs[i][k] + surface.uvs[i][(k + 1) % 3]));
        }
}

TEST(Subdivision, AFlatSquareStaysFlatAndItsSidesStraight) {
    const BaseSurface made = finer(square(4), 3);
    size_t atSide = 0;
    for (const dvec3 p : made.positions) {
        EXPECT_EQ(p.z, 0);
        EXPECT_GE(std::min({p.x, p.y, 1 - p.x, 1 - p.y}), 0);
        atSide += p.x == 0;
    }
    EXPECT_GT(atSide, 16u);
}

TEST(Subdivision, SaysWhatItRefuses) {
    EXPECT_EQ(subdivided(square(1), 9).error().code, ErrorCode::Usage);
    EXPECT_EQ(subdivided(square(1), -1).error().code, ErrorCode::Usage);
    EXPECT_EQ(subdivided(shape("sphere"), 6).error().code, ErrorCode::Limit);
    EXPECT_EQ(subdivided({}, 1).error().code, ErrorCode::InvalidInput);
    EXPECT_EQ(subdivided({{{0, 0, 0}}, {{0, 0, 0}}, {}}, 3).error().code, ErrorCode::InvalidInput);
    BaseSurface fin = tetrahedron();
    fin.triangles.push_back({0, 1, 2});
    EXPECT_NE(subdivided(fin, 1).error().line().find("triangles meet"), std::string::npos);
    // Within two triangles back to back, all new edges would have four triangles.
    const BaseSurface twins{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}}, {}};
    EXPECT_NE(subdivided(twins, 1).error().line().find("back to back"), std::string::npos);
    const BaseSurface same = finer(square(2), 0);
    EXPECT_EQ(same.positions, square(2).positions);
}

TEST(Subdivision, LeavesOutWhatHasNoTriangle) {
    BaseSurface surface = tetrahedron();
    surface.positions.insert(surface.positions.begin(), {1e30, 1e30, 1e30});
    for (auto& t : surface.triangles)
        for (uint32_t& corner : t) ++corner;
    surface.triangles.insert(surface.triangles.begin(), {1, 1, 2});
    EXPECT_EQ(finer(surface).positions, finer(tetrahedron()).positions);
    EXPECT_EQ(finer(surface).triangles, finer(tetrahedron()).triangles);
}

}  // namespace
}  // namespace vcp::meso
