// The finest level's pages: each leaf names just the triangles that touch it, and none of them too often.
#include "builder/page/exact_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>

#include <gtest/gtest.h>

#include "builder/page/bin_triangles.h"
#include "builder/page/page_encoder.h"
#include "octree/page/page_codec.h"
#include "octree/surface/leaf_triangles.h"
#include "octree/vcp_writer.h"
#include "tests/support/lattice_meshes.h"
#include "tests/support/test_meshes.h"

namespace vcp {
namespace {

constexpr uint32_t kTreeLog2Cells = 5;
constexpr int kSteps = kLatticePerCell / kSubcells;

struct TreePage {
    LatticeMesh mesh;
    std::vector<uint32_t> numbers;  ///< all triangles of the mesh
    glm::u32vec3 at;

    TreePage(const IndexedMesh& m, glm::u32vec3 position) : mesh(test::onLattice(m)), at(position) {
        numbers.resize(mesh.triangles.size());
        std::iota(numbers.begin(), numbers.end(), 0u);
    }
    [[nodiscard]] PageTree tree() const { return buildExactTree(mesh, numbers, at, kTreeLog2Cells); }
    [[nodiscard]] std::array<glm::i32vec3, 3> corners(uint32_t k, const PageTree& tree) const {
        std::array<glm::i32vec3, 3> t;
        for (size_t i = 0; i < 3; ++i) t[i] = mesh.positions[mesh.triangles[k][i]] - tree.originLattice;
        return t;
    }
    /// Whether a triangle touches a closed cube, lattice steps.
    [[nodiscard]] bool touches(uint32_t k, const PageTree& tree, glm::i32vec3 lower, int edge) const {
        const auto t = corners(k, tree);
        for (int axis = 0; axis < 3; ++axis) {
            const auto [low, high] = std::minmax({t[0][axis], t[1][axis], t[2][axis]});
            if (high < lower[axis] || low > lower[axis] + edge) return false;
        }
        return CubeTest(t).touches(lower, edge);
    }
};

/// Checks a tree against all triangles of the mesh. Returns the largest leaf's number of triangles.
size_t expectSound(const TreePage& page, const PageTree& tree) {
    size_t most = 0, hard = 0;
    for (const TreeNode& n : tree.nodes) {
        if (n.kind == TreeNode::Kind::Internal) continue;
        std::vector<uint32_t> expected;
        for (uint32_t k = 0; k < page.numbers.size(); ++k)
            if (page.touches(k, tree, n.box.lower * kSteps, n.box.edge * kSteps)) expected.push_back(k);
        std::vector<uint32_t> named;
        if (n.kind == TreeNode::Kind::Hard)
            for (const uint32_t local : tree.hard[n.index].triangles) named.push_back(tree.triangles[local]);
        EXPECT_EQ(named, expected) << "leaf at " << n.box.lower.x << ' ' << n.box.lower.y << ' ' << n.box.lower.z;
        hard += n.kind == TreeNode::Kind::Hard;
        most = std::max(most, named.size());
    }
    EXPECT_EQ(hard, tree.hard.size());
    EXPECT_TRUE(tree.soft.empty());
    EXPECT_LE(double(tree.records()), kMostRepetition * double(page.numbers.size()) + 1);
    return most;
}

/// Returns the triangles of each hard leaf, as sorted positions, leaf by leaf in the octree's order.
std::vector<std::vector<std::array<uint64_t, 3>>> trianglesByLeaf(const PageView& page) {
    std::vector<std::vector<std::array<uint64_t, 3>>> leaves;
    const auto visit = [&](const auto& self, uint32_t word) -> void {
        if (nodeType(word) == kNodeInternal)
            for (uint32_t o = 0; o < 8; ++o) self(self, page.nodes[8 * (word & kNodePayloadMask) + o]);
        if (nodeType(word) != kNodeHard) return;
        auto& leaf = leaves.emplace_back();
        forEachTriangle(page.strips, word, [&](const Index3& t) {
            auto& triangle = leaf.emplace_back();
            for (size_t i = 0; i < 3; ++i) triangle[i] = uint64_t{page.vertices[t[i]].y} << 32 | page.vertices[t[i]].x;
            std::sort(triangle.begin(), triangle.end());
        });
        std::sort(leaf.begin(), leaf.end());
    };
    visit(visit, page.header.root);
    return leaves;
}

/// Checks that the tree's bytes are read back as they are.
void expectStored(const TreePage& page, PageTree& tree) {
    const EncodedPage encoded = encodePage(tree, page.mesh);
    const std::vector<std::byte> bytes = pageOf(encoded.draft);
    const auto view = parsePage(bytes);
    ASSERT_TRUE(view.ok()) << view.error().line();
    EXPECT_EQ(view->header.hardLeaves, tree.hard.size());
    const auto stored = compressPage(encoded.draft, {});
    ASSERT_TRUE(stored.ok()) << stored.error().line();
    EXPECT_EQ(stored->geometry[0], std::byte{1}) << "coded";
    const auto back = unpackGeometry(stored->geometry, stored->geometryBytes);
    ASSERT_TRUE(back.ok()) << back.error().line();
    const auto again = parsePage(std::as_bytes(std::span(*back)));
    ASSERT_TRUE(again.ok()) << again.error().line();
    EXPECT_EQ(trianglesByLeaf(*again), trianglesByLeaf(*view));
}

/// A bumpy torus through eight pages.
IndexedMesh bumpyTorus() {
    IndexedMesh mesh = test::torusMesh({30, 31, 32}, 16, 6, 160, 70);
    for (glm::dvec3& p : mesh.positions) p += 0.2 * glm::dvec3(std::sin(9 * p.x), std::cos(7 * p.y), std::sin(8 * p.z));
    return mesh;
}

TEST(ExactTree, LeavesNameWhatTouchesThem) {
    for (const glm::u32vec3 at : {glm::u32vec3(0), glm::u32vec3(1, 0, 0), glm::u32vec3(1, 1, 1)}) {
        const TreePage page(bumpyTorus(), at);
        PageTree tree = page.tree();
        EXPECT_LE(expectSound(page, tree), kExactLeafTriangles);
        EXPECT_GT(tree.hard.size(), 100u);
        expectStored(page, tree);
    }
}

// Needles from wall to wall are named too often on the way down for boxes near a cell; the rest of the page's triangles
// leave room to split those boxes all the same.
TEST(ExactTree, NeedlesBesideASurfaceAreSplitWhileThereIsRoom) {
    IndexedMesh mesh = test::torusMesh({16, 16, 16}, 10, 5, 120, 100);
    constexpr uint32_t kNeedles = 1500;
    for (uint32_t i = 0; i < kNeedles; ++i) {
        const double x = 1 + 2.0 * i / kNeedles;
        const auto first = uint32_t(mesh.positions.size());
        for (const glm::dvec3 p : {glm::dvec3(x, 1, 2.3), glm::dvec3(x + 0.001, 1, 2.3), glm::dvec3(x, 31, 2.3)})
            mesh.positions.push_back(p);
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    const TreePage page(mesh, {0, 0, 0});
    PageTree tree = page.tree();
    EXPECT_LE(expectSound(page, tree), kNeedles / 4);
    expectStored(page, tree);
}

TEST(ExactTree, MarksTheCellsThatAreTouched) {
    IndexedMesh mesh = bumpyTorus();
    test::append(mesh, test::boxMesh({3, 3, 3}, {25, 9, 12}, 2));
    const TreePage page(mesh, {0, 0, 0});
    const PageTree tree = page.tree();
    const int n = tree.cells;
    std::vector<bool> touched(size_t(n) * n * n);
    for (uint32_t k = 0; k < page.numbers.size(); ++k) {
        // A cell beyond a triangle's box does not touch it.
        const auto t = page.corners(k, tree);
        const auto cellOf = [&](const glm::i32vec3& p, int beyond) {
            return glm::clamp(p / kLatticePerCell + beyond, 0, n - 1);
        };
        const glm::i32vec3 low = cellOf(glm::min(t[0], glm::min(t[1], t[2])), -1);
        const glm::i32vec3 high = cellOf(glm::max(t[0], glm::max(t[1], t[2])), 1);
        for (int z = low.z; z <= high.z; ++z)
            for (int y = low.y; y <= high.y; ++y)
                for (int x = low.x; x <= high.x; ++x)
                    if (page.touches(k, tree, glm::i32vec3(x, y, z) * kLatticePerCell, kLatticePerCell))
                        touched[size_t(x + n * (y + n * z))] = true;
    }
    for (size_t cell = 0; cell < touched.size(); ++cell)
        ASSERT_EQ(tree.occupied[cell] != 0, touched[cell]) << cell % n << ' ' << cell / n % n << ' ' << cell / n / n;
}

TEST(ExactTree, WallsOfLargeTrianglesHaveLargeLeaves) {
    const TreePage page(test::boxMesh({3, 3, 3}, {29, 29, 29}, 1), {0, 0, 0});
    PageTree tree = page.tree();
    EXPECT_LE(expectSound(page, tree), kExactLeafTriangles);
    EXPECT_LE(tree.hard.size(), 64u);
    expectStored(page, tree);
}

TEST(ExactTree, SoupsOfNeedlesAreNotRepeatedForEver) {
    for (const bool adversarial : {false, true}) {
        IndexedMesh mesh = test::randomTriangles(400, 7, adversarial);
        for (glm::dvec3& p : mesh.positions) p = glm::dvec3(1) + p * 30.0;
        const TreePage page(mesh, {0, 0, 0});
        PageTree tree = page.tree();
        expectSound(page, tree);
        expectStored(page, tree);
    }
}

TEST(ExactTree, FansAndCrowdsEndAtTheSmallestLeaf) {
    IndexedMesh fan;
    constexpr uint32_t kNeedles = 6000;  // more than are prepared at once
    fan.positions.push_back({16.3, 16.4, 16.2});
    for (uint32_t i = 0; i < kNeedles; ++i) {
        const double a = test::kTwoPi * i / kNeedles;
        fan.positions.push_back(fan.positions[0] + 12.0 * glm::dvec3(std::cos(a), std::sin(a), 0.4 * std::sin(20 * a)));
    }
    for (uint32_t i = 0; i < kNeedles; ++i) fan.triangles.push_back({0, 1 + i, 1 + (i + 1) % kNeedles});
    IndexedMesh crowd = test::randomTriangles(9000, 3, false);
    for (glm::dvec3& p : crowd.positions) p = glm::dvec3(10.01) + p * 0.05;
    for (const IndexedMesh& mesh : {fan, crowd}) {
        const TreePage page(mesh, {0, 0, 0});
        PageTree tree = page.tree();
        EXPECT_GT(expectSound(page, tree), kExactLeafTriangles);
        expectStored(page, tree);
    }
}

TEST(ExactTree, AsManyRecordsAsAPageCanName) {
    const TreePage page(bumpyTorus(), {0, 0, 0});
    const size_t free = page.tree().records(), triangles = [&] {
        const PageTree one = buildExactTree(page.mesh, page.numbers, page.at, kTreeLog2Cells, 0);
        EXPECT_EQ(one.hard.size(), 1u);
        return one.hard[0].triangles.size();
    }();
    for (const size_t most : {free - 1, free / 2, triangles + triangles / 254 + 2}) {
        PageTree tree = buildExactTree(page.mesh, page.numbers, page.at, kTreeLog2Cells, most);
        EXPECT_LE(tree.records(), most);
        expectSound(page, tree);
        expectStored(page, tree);
    }
}

TEST(ExactTree, APageWithoutTrianglesIsEmpty) {
    const TreePage page(test::sphereMesh({12, 12, 12}, 6, 12), {1, 1, 1});
    PageTree tree = page.tree();
    ASSERT_EQ(tree.nodes.size(), 1u);
    EXPECT_EQ(tree.nodes[0].kind, TreeNode::Kind::Empty);
    EXPECT_EQ(encodePage(tree, page.mesh).leaves, 0u);
}

TEST(ExactTree, TrianglesAroundThePageChangeNothing) {
    const IndexedMesh mesh = bumpyTorus();
    const TreePage page(mesh, {0, 0, 0});
    const TriangleBins bins = binTriangles(page.mesh, {kTreeLog2Cells, 1}, kExactMarginCells, 0, 1);
    ASSERT_EQ(bins.pages.size(), 1u);
    ASSERT_LT(bins.triangles.size(), page.numbers.size());
    PageTree few = buildExactTree(page.mesh, bins.of(0), page.at, kTreeLog2Cells), all = page.tree();
    EXPECT_EQ(pageOf(encodePage(few, page.mesh).draft), pageOf(encodePage(all, page.mesh).draft));
}

}  // namespace
}  // namespace vcp
