// Binning against a test of every triangle with every page.
#include "builder/page/bin_triangles.h"

#include <algorithm>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "builder/lattice/triangle_geometry.h"
#include "tests/support/lattice_meshes.h"
#include "tests/support/test_meshes.h"

namespace vcp {
namespace {

Triangle3 triangleOf(const LatticeMesh& mesh, size_t k) {
    Triangle3 t;
    for (int i = 0; i < 3; ++i) t[i] = glm::dvec3(mesh.positions[mesh.triangles[k][i]]) / double(kLatticePerCell);
    return t;
}

void expectAllBinned(const LatticeMesh& mesh, uint32_t log2Cells, uint32_t level) {
    const TriangleBins bins = binTriangles(mesh, {log2Cells, level});
    ASSERT_EQ(bins.begin.size(), bins.pages.size() + 1);
    ASSERT_TRUE(std::is_sorted(bins.pages.begin(), bins.pages.end()));
    ASSERT_EQ(std::adjacent_find(bins.pages.begin(), bins.pages.end()), bins.pages.end());
    std::map<uint64_t, std::set<uint32_t>> have;
    for (size_t p = 0; p < bins.pages.size(); ++p) {
        const auto of = bins.of(p);
        ASSERT_FALSE(of.empty());
        ASSERT_TRUE(std::is_sorted(of.begin(), of.end()));
        have[bins.pages[p]].insert(of.begin(), of.end());
        ASSERT_EQ(have[bins.pages[p]].size(), of.size()) << "a triangle twice in one page";
    }
    const double edge = double(1u << log2Cells);
    const uint32_t side = 1u << level;
    Polygon polygon;
    size_t overlaps = 0, extra = 0;
    for (uint32_t k = 0; k < mesh.triangles.size(); ++k)
        for (uint32_t z = 0; z < side; ++z)
            for (uint32_t y = 0; y < side; ++y)
                for (uint32_t x = 0; x < side; ++x) {
                    const auto meets = [&](double margin) {
                        const glm::dvec3 lower = glm::dvec3(x, y, z) * edge - margin;
                        clipToBox(triangleOf(mesh, k), lower, lower + edge + 2 * margin, polygon);
                        return !polygon.empty();
                    };
                    // To touch the widened page is not to overlap it: the margin is wider than what is needed.
                    const bool needed = meets(kBinMarginCells - 1e-6);
                    const auto page = have.find(mortonEncode({x, y, z}));
                    const bool binned = page != have.end() && page->second.contains(k);
                    overlaps += needed;
                    extra += binned && !meets(kBinMarginCells + 1e-6);
                    ASSERT_TRUE(binned || !needed) << "triangle " << k << " page " << x << ' ' << y << ' ' << z;
                }
    EXPECT_GT(overlaps, 0u);
    EXPECT_EQ(extra, 0u) << "more than what overlaps is binned";
}

TEST(BinTriangles, SmallTriangles) {
    expectAllBinned(test::onLattice(test::sphereMesh({32, 32, 32}, 24, 24)), 3, 3);
    expectAllBinned(test::onLattice(test::torusMesh({32, 32, 32}, 20, 8, 40, 20)), 4, 2);
}

TEST(BinTriangles, LongTrianglesAndNeedles) {
    IndexedMesh soup = test::randomTriangles(400, 3, true);
    for (glm::dvec3& p : soup.positions) p = p * 60.0 + 2.0;
    IndexedMesh box = test::boxMesh({2, 2, 2}, {61, 60.5, 59}, 1);
    test::append(soup, box);
    expectAllBinned(test::onLattice(soup), 3, 3);
}

TEST(BinTriangles, TrianglesOnPageWalls) {
    IndexedMesh walls = test::boxMesh({16, 16, 16}, {48, 48, 48}, 4);
    test::append(walls, test::boxMesh({0, 0, 0}, {64, 64, 64}, 2));
    // Ends exactly where a widened page begins.
    test::append(walls, test::boxMesh({2.25, 16 - 2.25, 18.25}, {16 + 2.25, 30, 29.75}, 1));
    expectAllBinned(test::onLattice(walls), 4, 2);
}

TEST(BinTriangles, ARunOfPages) {
    const LatticeMesh mesh = test::onLattice(test::torusMesh({32, 32, 32}, 20, 8, 40, 20));
    const PageGrid grid{3, 3};
    const TriangleBins all = binTriangles(mesh, grid);
    for (const auto& [first, end] :
         {std::pair<uint64_t, uint64_t>{0, 100}, {100, 101}, {77, 400}, {400, 512}, {5, 5}}) {
        const TriangleBins run = binTriangles(mesh, grid, kBinMarginCells, first, end);
        std::vector<uint64_t> expected;
        for (const uint64_t page : all.pages)
            if (page >= first && page < end) expected.push_back(page);
        ASSERT_EQ(run.pages, expected);
        for (size_t i = 0; i < run.pages.size(); ++i) {
            const auto of = run.of(i),
                       want = all.of(
                           size_t(std::find(all.pages.begin(), all.pages.end(), run.pages[i]) - all.pages.begin()));
            ASSERT_TRUE(std::equal(of.begin(), of.end(), want.begin(), want.end()));
        }
    }
}

TEST(BinTriangles, OnePage) { expectAllBinned(test::onLattice(test::sphereMesh({16, 16, 16}, 12, 10)), 5, 0); }

}  // namespace
}  // namespace vcp
