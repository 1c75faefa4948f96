#include "builder/lattice/finest_pages.h"

#include <algorithm>
#include <map>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "builder/lattice_soup.h"
#include "builder/measure/mesh_bvh.h"
#include "tests/support/lattice_meshes.h"
#include "tests/support/test_meshes.h"

namespace vcp {
namespace {

constexpr PageGrid kBase{6, 2};  // 4 pages of 64 cells an axis

/// Pages that are parted at random, here and there several times over.
FinestPages randomPages(uint64_t seed) {
    std::mt19937_64 random(seed);
    std::vector<std::vector<uint64_t>> parted(4);
    for (int i = 0; i < 6; ++i) {
        const uint32_t depth = uint32_t(random() % parted.size());
        parted[depth].push_back(random() % (uint64_t{64} << 3 * depth));
    }
    return FinestPages(kBase, parted);
}

bool isParted(const FinestPages& pages, uint32_t level, uint64_t code) {
    const size_t i = level - pages.base();
    return i < pages.parted().size() && std::ranges::binary_search(pages.parted()[i], code);
}

template <class Visit>
void forAllPages(const FinestPages& pages, uint32_t level, uint64_t code, const Visit& visit) {
    if (!isParted(pages, level, code)) return visit(level, code);
    for (uint64_t i = 0; i < 8; ++i) forAllPages(pages, level + 1, code << 3 | i, visit);
}

TEST(FinestPages, ThePagesAboveAPartedPageAreParted) {
    const FinestPages pages(kBase, {{}, {8 * 5 + 3}, {8 * (8 * 5 + 3) + 7}, {}});
    EXPECT_EQ(pages.deepest(), kBase.level + 3);
    const std::vector<std::vector<uint64_t>> parted{{5}, {43}, {351}};
    EXPECT_EQ(pages.parted(), parted);
    EXPECT_EQ(FinestPages(kBase, pages.parted()).parted(), pages.parted());
    EXPECT_TRUE(FinestPages(kBase, {{}, {}}).isUniform());
}

TEST(FinestPages, NearPagesAreThoseThatTheTriangleOverlaps) {
    for (uint64_t seed = 0; seed < 10; ++seed) {
        const FinestPages pages = randomPages(seed);
        std::mt19937_64 random(seed);
        const double perCell = std::ldexp(double(kLatticePerCell), int(pages.deepest() - pages.base()));
        std::uniform_real_distribution<double> at(0, 256), aside(-20, 20);
        for (int k = 0; k < 40; ++k) {
            const glm::dvec3 middle(at(random), at(random), at(random));
            glm::i32vec3 corner[3];
            for (glm::i32vec3& c : corner)
                c = glm::i32vec3(perCell * glm::clamp(middle + glm::dvec3(aside(random), aside(random), aside(random)),
                                                      glm::dvec3(0), glm::dvec3(256)));
            std::set<std::pair<uint32_t, uint64_t>> found, expected;
            pages.forPagesNear(corner, 2, [&](uint32_t level, uint64_t code) {
                EXPECT_TRUE(found.insert({level, code}).second);
            });
            const BoxOverlap overlap(
                {glm::dvec3(corner[0]) / perCell, glm::dvec3(corner[1]) / perCell, glm::dvec3(corner[2]) / perCell});
            for (uint64_t base = 0; base < 64; ++base)
                forAllPages(pages, kBase.level, base, [&](uint32_t level, uint64_t code) {
                    const double edge = std::ldexp(64.0, int(kBase.level) - int(level)), margin = 2 * edge / 64;
                    if (overlap.test((glm::dvec3(mortonDecode(code)) + 0.5) * edge, edge / 2 + margin))
                        expected.insert({level, code});
                });
            EXPECT_EQ(found, expected) << seed << ' ' << k;
        }
    }
}

/// Snaps a mesh, in cells of the base level, to suit the pages.
std::vector<LatticeTriangle> snapped(const IndexedMesh& mesh, const FinestPages& pages) {
    const GridFrame base{.cell = 1, .levels = kBase.level + 1, .log2Cells = kBase.log2Cells};
    const LatticeSnapper snapper(base.withLevelsBelow(pages.deepest() - pages.base()), nullptr, true, pages);
    std::vector<LatticeTriangle> soup;
    for (size_t k = 0; k < mesh.triangles.size(); ++k) {
        WorldTriangle<double> t{};
        for (int i = 0; i < 3; ++i) t.corner[i] = mesh.positions[mesh.triangles[k][i]];
        snapper.add(t, [&](const LatticeTriangle& piece) {
            if (hasArea(piece.corner[0], piece.corner[1], piece.corner[2])) soup.push_back(piece);
        });
    }
    return soup;
}

TEST(FinestPages, CornersLieOnTheLatticeOfEveryPageThatTheirTriangleTouches) {
    for (uint64_t seed = 0; seed < 12; ++seed) {
        const FinestPages pages = randomPages(seed);
        // Long triangles around short ones.
        IndexedMesh mesh = test::torusMesh({128, 128, 128}, 80, 30, 9, 5);
        test::append(mesh, test::torusMesh({120, 130, 125}, 60, 25, 200, 90));
        std::map<uint32_t, int> touched;
        const std::vector<LatticeTriangle> soup = snapped(mesh, pages);
        for (const LatticeTriangle& t : soup)
            pages.forPagesNear(t.corner, 1.0 / kLatticePerCell, [&](uint32_t level, uint64_t) {
                const int coarser = int(pages.deepest() - level);
                ++touched[level];
                for (int i = 0; i < 3; ++i) {
                    for (int axis = 0; axis < 3; ++axis) ASSERT_EQ(t.corner[i][axis] & ((1 << coarser) - 1), 0);
                    const glm::dvec3 edge(t.corner[i] - t.corner[(i + 1) % 3]);
                    ASSERT_LE(glm::length(edge) / std::ldexp(double(kLatticePerCell), coarser), kMaxEdgeCells);
                }
            });
        EXPECT_GT(touched.size(), 1u) << seed;
        const LatticeMesh lattice = meshOf(soup, false);
        EXPECT_EQ(test::edgeUses(lattice.triangles), (std::map<int, int>{{2, int(lattice.triangles.size() * 3 / 2)}}))
            << "a crack opens between pages";
    }
}

TEST(FinestPages, OnlyEdgesBesidePartedPagesAreCut) {
    // One page of 64 cells, from 64 to 128 along each axis, is parted twice at its lowest corner.
    const FinestPages pages(kBase, {{}, {8 * 7}});
    const int cell = kLatticePerCell << (pages.deepest() - pages.base());
    const auto edge = [&](glm::ivec3 from, glm::ivec3 to) { return pages.isTooLong(from * cell, to * cell); };
    EXPECT_FALSE(edge({140, 70, 70}, {180, 70, 70})) << "beside it, farther than a fourth of its length";
    EXPECT_TRUE(edge({66, 66, 66}, {106, 66, 66})) << "an end is in it";
    EXPECT_TRUE(edge({40, 66, 66}, {90, 66, 66})) << "it goes through";
    EXPECT_FALSE(edge({66, 66, 66}, {69, 66, 66})) << "no longer than 16 of its cells";
}

TEST(FinestPages, NoCornerIsFartherFromTheMeshThanItsStray) {
    const FinestPages pages = randomPages(5);
    const IndexedMesh mesh = test::torusMesh({128, 128, 128}, 80, 30, 9, 5);
    const MeshBvh bvh(mesh);
    const double perCell = std::ldexp(double(kLatticePerCell), int(pages.deepest() - pages.base()));
    for (const LatticeTriangle& t : snapped(mesh, pages))
        for (const glm::i32vec3 corner : t.corner)
            ASSERT_LE(bvh.nearestPoint(glm::dvec3(corner) / perCell)->distance,
                      double(t.stray) * kLatticePerCell / perCell + 1e-9);
}

}  // namespace
}  // namespace vcp
