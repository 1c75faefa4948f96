// Base surfaces and the shells over them.
#include "mesostructure/shell.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include <gtest/gtest.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace vcp::meso {
namespace {

constexpr glm::dvec3 kTile{1, 1, 0.25};

BaseSurface base(std::string_view name, double tiles = 2) {
    auto made = makeBaseSurface(name, tiles);
    EXPECT_TRUE(made.ok()) << made.error().line();
    return *std::move(made);
}

Shell shellOf(const BaseSurface& surface, double height) {
    auto made = buildShell(surface, height, kTile);
    EXPECT_TRUE(made.ok()) << made.error().line();
    return *std::move(made);
}

/// One tetrahedron as the shaders read it.
struct Piece {
    glm::vec3 v0, r[3], q0, t[3];
    Piece(const Shell& shell, uint32_t i) {
        const glm::vec4* at =
            shell.texels.data() + Shell::kNodeTexels * size_t{shell.nodes} + Shell::kPieceTexels * size_t{i};
        v0 = glm::vec3(at[0]);
        for (int k = 0; k < 3; ++k) r[k] = glm::vec3(at[1 + k]), q0[k] = at[1 + k].w, t[k] = glm::vec3(at[4 + k]);
    }
    /// Least weight of a corner: above 0 inside.
    [[nodiscard]] float least(glm::vec3 p) const {
        const glm::vec3 w(glm::dot(r[0], p - v0), glm::dot(r[1], p - v0), glm::dot(r[2], p - v0));
        return std::min({w.x, w.y, w.z, 1 - w.x - w.y - w.z});
    }
    [[nodiscard]] glm::vec3 tile(glm::vec3 p) const {
        return q0 + glm::vec3(glm::dot(t[0], p - v0), glm::dot(t[1], p - v0), glm::dot(t[2], p - v0));
    }
};

TEST(Shell, BasesFaceOutwardsAndHaveSoundShells) {
    for (const auto name : baseSurfaceNames()) {
        const BaseSurface surface = base(name);
        const double edge = tileEdge(surface);
        EXPECT_GT(edge, 0.15) << name;
        const Shell shell = shellOf(surface, 0.05);
        EXPECT_EQ(shell.inverted, 0u) << name;
        EXPECT_EQ(shell.withoutMap, 0u) << name;
        EXPECT_EQ(shell.withoutArea, 0u) << name;
        // Outside is up, and outwards from the middle.
        glm::dvec3 low(1e9), high(-1e9);
        for (const glm::dvec3 p : surface.positions) low = glm::min(low, p), high = glm::max(high, p);
        EXPECT_NEAR(shell.high.z, high.z + 0.05, name == "tree" || name == "vase" ? 0.07 : 0.01) << name;
        EXPECT_LT(shell.low.x, name == "quad" ? low.x + 1e-3 : low.x - 0.03) << name;
        EXPECT_EQ(shell.texels.size(), Shell::kNodeTexels * size_t{shell.nodes} +
                                           Shell::kPieceTexels * size_t{shell.pieces} + surface.positions.size())
            << name;
    }
}

TEST(Shell, PiecesFillTheShellOnce) {
    // A closed surface: the shell between the boxes of edge 2 and 2.4, without gap and overlap.
    const Shell shell = shellOf(base("box"), 0.2);
    std::mt19937 random(5);
    std::uniform_real_distribution<float> unit(-1.25f, 1.25f);
    for (int i = 0; i < 3000; ++i) {
        const glm::vec3 p(unit(random), unit(random), unit(random));
        const float far = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
        int inside = 0;
        bool onWall = std::abs(far - 1) < 1e-3f || std::abs(far - 1.2f) < 1e-3f;
        for (uint32_t k = 0; k < shell.pieces && !onWall; ++k) {
            const float least = Piece(shell, k).least(p);
            onWall = std::abs(least) < 1e-5f;
            inside += least > 0;
        }
        EXPECT_TRUE(onWall || inside == (far > 1 && far < 1.2f ? 1 : 0)) << "point " << i << " is in " << inside;
    }
}

TEST(Shell, TheTreeHasEachPieceInOneLeafAndFitsTheStack) {
    // Triangles each eleven times as large as the one before: areas part them two by two.
    BaseSurface fan;
    for (int i = 0; i < 36; ++i) {
        const double x = std::exp2(3.5 * i - 100);
        const auto first = uint32_t(fan.positions.size());
        fan.positions.insert(fan.positions.end(), {{x, 0, 0}, {1.01 * x, 0, 0}, {x, 0.01 * x, 0}});
        fan.triangles.push_back({first, first + 1, first + 2});
        fan.uvs.push_back({glm::dvec2(0, 0), glm::dvec2(1, 0), glm::dvec2(0, 1)});
    }
    for (const BaseSurface& surface : {base("torus", 4), base("teapot"), fan}) {
        const auto built = buildShell(surface, 0.01, kTile);
        ASSERT_TRUE(built) << built.error().line();
        const Shell& shell = *built;
        std::vector<int> uses(shell.pieces);
        uint32_t deepest = 0;
        const std::function<void(uint32_t, uint32_t)> visit = [&](uint32_t node, uint32_t depth) {
            deepest = std::max(deepest, depth);
            const auto first = uint32_t(shell.texels[2 * node].w), count = uint32_t(shell.texels[2 * node + 1].w);
            for (uint32_t i = 0; i < count; ++i) ++uses[first + i];
            EXPECT_LE(count, 3u);
            if (count > 0) return;
            visit(first, depth + 1);
            visit(first + 1, depth + 1);
        };
        visit(0, 0);
        EXPECT_EQ(std::ranges::count(uses, 1), std::ptrdiff_t(shell.pieces));
        EXPECT_LT(deepest, Shell::kDepth - 1);
    }
}

TEST(Shell, MapsToTheTile) {
    // Flat: tile space is world space, scaled.
    const Shell shell = shellOf(base("quad", 4), 0.125);
    for (uint32_t k = 0; k < shell.pieces; ++k) {
        const Piece piece(shell, k);
        const glm::vec3 p(0.3f, -0.2f, 0.05f), expected((p.x + 1) * 2, (p.y + 1) * 2, 0.1f), found = piece.tile(p);
        EXPECT_NEAR(found.x - expected.x, std::round(found.x - expected.x), 1e-5);
        EXPECT_NEAR(found.y - expected.y, std::round(found.y - expected.y), 1e-5);
        EXPECT_NEAR(found.z, expected.z, 1e-5);
    }
}

std::array<glm::dvec2, 3> mapped(glm::dvec2 a, glm::dvec2 b, glm::dvec2 c) { return {a, b, c}; }

BaseSurface twoTriangles() {
    return {.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}},
            .triangles = {{0, 1, 2}, {0, 2, 3}},
            .uvs = {mapped({0, 0}, {1, 0}, {1, 1}), mapped({0, 0}, {1, 1}, {0, 1})}};
}

TEST(Shell, CountsWhatMapsAndSurfacesHave) {
    BaseSurface mirrored = twoTriangles();
    for (auto& map : mirrored.uvs)
        for (glm::dvec2& uv : map) uv.x = -uv.x;
    EXPECT_EQ(shellOf(mirrored, 0.1).mirrored, 2u);
    EXPECT_EQ(shellOf(mirrored, 0.1).inverted, 0u);

    BaseSurface flat = twoTriangles();
    flat.uvs[1] = mapped({0, 0}, {1, 1}, {2, 2});
    EXPECT_EQ(shellOf(flat, 0.1).withoutMap, 1u);

    BaseSurface sliver = twoTriangles();
    sliver.triangles.push_back({0, 1, 1}), sliver.uvs.push_back(sliver.uvs[0]);
    EXPECT_EQ(shellOf(sliver, 0.1).withoutArea, 1u);

    // A triangle that is folded back on its neighbour.
    BaseSurface folded = twoTriangles();
    folded.positions[3] = {0.9, 0.2, 0};
    EXPECT_GT(shellOf(folded, 0.1).inverted + shellOf(folded, 0.1).flat, 0u);
}

/// A gutter, whose floor is narrow.
BaseSurface gutter() {
    BaseSurface made = {
        .positions =
            {{-1, 0, 1}, {-1, 4, 1}, {-0.1, 0, 0}, {-0.1, 4, 0}, {0.1, 0, 0}, {0.1, 4, 0}, {1, 0, 1}, {1, 4, 1}},
        .triangles = {},
        .uvs = {}};
    for (uint32_t i = 0; i < 6; i += 2)
        for (const std::array<uint32_t, 3> t : {std::array<uint32_t, 3>{i, i + 2, i + 3}, {i, i + 3, i + 1}})
            made.triangles.push_back(t),
                made.uvs.push_back(mapped(glm::dvec2(t[0], 0), glm::dvec2(t[1], 1), glm::dvec2(t[2], 2)));
    return made;
}

TEST(Shell, IsCutWhereColumnsWouldPassEachOther) {
    const BaseSurface surface = gutter();
    const Shell low = shellOf(surface, 0.05);
    EXPECT_EQ(low.cut, 0u);
    EXPECT_EQ(low.inverted, 0u);
    const double height = 1;
    Shell high;
    const std::vector<ShellPiece> pieces = shellPieces(surface, height, kTile, 0, high);
    EXPECT_GE(high.cut, 4u);
    EXPECT_EQ(high.inverted, 0u);
    // What is cut keeps its measure, and its top shows the cut.
    const std::vector<glm::dvec3> directions = shellDirections(surface);
    int cutTops = 0;
    for (const ShellPiece& piece : pieces) {
        int tops = 0;
        double least = 1;
        for (int k = 0; k < 4; ++k) {
            const double part = piece.tile[k].z / kTile.z;
            tops += part > 0, least = part > 0 ? std::min(least, part) : least;
            double nearest = 1e9;
            for (const uint32_t column : piece.columns)
                nearest =
                    std::min(nearest, glm::distance(piece.corners[k] + high.origin,
                                                    surface.positions[column] + part * height * directions[column]));
            EXPECT_LT(nearest, 1e-9);
        }
        if (tops == 3) {
            EXPECT_EQ((piece.bits & 1) != 0, least < 1);
            cutTops += least < 1;
        }
    }
    EXPECT_GT(cutTops, 0);
    // No place is in two pieces.
    const Shell shell = shellOf(surface, height);
    std::mt19937 random(11);
    std::uniform_real_distribution<float> unit(-1, 1);
    for (int i = 0; i < 5000; ++i) {
        const glm::vec3 p(unit(random), 1.5f * unit(random), unit(random));
        int inside = 0;
        for (uint32_t k = 0; k < shell.pieces; ++k) inside += Piece(shell, k).least(p) > 1e-5f;
        EXPECT_LE(inside, 1) << "point " << i;
    }
}

TEST(Shell, KnowsWhereItIsCut) {
    const auto cutFaces = [](const BaseSurface& surface) {
        const Shell shell = shellOf(surface, 0.1);
        int cut = 0;
        for (uint32_t i = 0; i < shell.pieces; ++i)
            cut += std::popcount(
                uint32_t(shell.texels[Shell::kNodeTexels * size_t{shell.nodes} + Shell::kPieceTexels * size_t{i}].w) &
                15u);
        return cut;
    };
    // Two faces a side: of the four sides on the border, and of the two on a seam.
    BaseSurface surface = twoTriangles();
    EXPECT_EQ(cutFaces(surface), 8);
    for (glm::dvec2& uv : surface.uvs[1]) uv += glm::dvec2(3, -2);
    EXPECT_EQ(cutFaces(surface), 8);
    for (glm::dvec2& uv : surface.uvs[1]) uv.x += 0.25;
    EXPECT_EQ(cutFaces(surface), 12);
    surface = twoTriangles();
    std::ranges::reverse(surface.uvs[1]);
    EXPECT_EQ(cutFaces(surface), 12);
    // Round the torus' ring of 96 and tube of 40 the map ends where it began, or not.
    EXPECT_EQ(cutFaces(base("torus", 2)), 0);
    EXPECT_EQ(cutFaces(base("torus", 1.3)), (96 + 40) * 4);
}

TEST(Shell, RefusesWhatIsNoBase) {
    EXPECT_EQ(makeBaseSurface("plate", 1).error().code, ErrorCode::Usage);
    EXPECT_EQ(makeBaseSurface("quad", 0).error().code, ErrorCode::Usage);
    EXPECT_EQ(buildShell(twoTriangles(), 0, kTile).error().code, ErrorCode::Usage);
    BaseSurface unmapped = twoTriangles();
    unmapped.uvs.clear();
    EXPECT_EQ(buildShell(unmapped, 0.1, kTile).error().code, ErrorCode::Usage);
    BaseSurface infinite = twoTriangles();
    infinite.uvs[0][1].x = std::numeric_limits<double>::infinity();
    EXPECT_EQ(buildShell(infinite, 0.1, kTile).error().code, ErrorCode::InvalidInput);
    BaseSurface point = twoTriangles();
    for (glm::dvec3& p : point.positions) p = {1, 2, 3};
    EXPECT_EQ(buildShell(point, 0.1, kTile).error().code, ErrorCode::InvalidInput);
}

}  // namespace
}  // namespace vcp::meso
