// Stepping between levels: the same soup for any partition, and strays that bound the distance both ways.
#include "builder/level/level_step.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

#include <gtest/gtest.h>

#include "builder/level/vertex_step.h"
#include "builder/measure/mesh_bvh.h"
#include "octree/surface/vertex_normal.h"
#include "tests/support/lattice_meshes.h"
#include "tests/support/test_folder.h"
#include "tests/support/test_meshes.h"

namespace vcp {

bool operator<(const LatticeTriangle& a, const LatticeTriangle& b) { return std::memcmp(&a, &b, sizeof a) < 0; }
bool operator==(const LatticeTriangle& a, const LatticeTriangle& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

namespace {

using Soup = std::vector<LatticeTriangle>;

constexpr uint32_t kLog2Cells = 3;

/// Every page a bin.
PagePartition allPages(uint32_t level) {
    std::vector<uint64_t> first(size_t{1} << 3 * level);
    for (size_t i = 0; i < first.size(); ++i) first[i] = i;
    return PagePartition(first);
}

PagePartition randomPartition(uint32_t level, uint64_t seed) {
    std::mt19937_64 random(seed);
    std::vector<uint64_t> first{0};
    const uint64_t mean = 2 + random() % 60;
    for (uint64_t page = 1; page < uint64_t{1} << 3 * level; ++page)
        if (random() % mean == 0) first.push_back(page);
    return PagePartition(first);
}

/// The levels of a mesh, bin by bin, as the builder makes them.
class Levels {
public:
    /// `soup`: as it comes from the snapper; `finest`: partition of the finest level.
    Levels(const Soup& soup, uint32_t levels, PagePartition finest)
        : space_(folder_.path() / "temp", uint64_t{1} << 30), partition_(std::move(finest)), level_(levels - 1) {
        const PageGrid grid{kLog2Cells, level_};
        bins_ = newBins("snapped", partition_);
        for (const LatticeTriangle& t : soup) {
            std::vector<size_t> bins;
            for (const glm::i32vec3 p : t.corner) bins.push_back(partition_.binOf(grid.pageOf(p)));
            std::sort(bins.begin(), bins.end());
            bins.erase(std::unique(bins.begin(), bins.end()), bins.end());
            for (const size_t bin : bins) EXPECT_TRUE(bins_->append(bin, std::span(&t, 1)).ok());
        }
        findNormals();
    }

    void coarsen() {
        step(level_ - 1);
        --level_;
    }

    [[nodiscard]] uint32_t level() const { return level_; }
    [[nodiscard]] const PagePartition& partition() const { return partition_; }
    /// Ascending.
    [[nodiscard]] Soup bin(size_t bin) const {
        auto soup = bins_->load(bin);
        EXPECT_TRUE(soup.ok());
        std::sort(soup->begin(), soup->end());
        return *soup;
    }
    /// Triangles of all bins, each once.
    [[nodiscard]] Soup all() const {
        Soup soup;
        for (size_t b = 0; b < partition_.bins(); ++b) {
            const Soup part = bin(b);
            soup.insert(soup.end(), part.begin(), part.end());
        }
        std::sort(soup.begin(), soup.end());
        soup.erase(std::unique(soup.begin(), soup.end()), soup.end());
        return soup;
    }

private:
    std::unique_ptr<RecordBins<LatticeTriangle>> newBins(const std::string& name, const PagePartition& partition) {
        return std::make_unique<RecordBins<LatticeTriangle>>(space_, name, partition.bins(), 1 << 20);
    }

    /// Brings the triangles to the finest level, the last bin first and the first one last.
    void findNormals() {
        const PageGrid grid{kLog2Cells, level_};
        auto made = newBins("level", partition_);
        RecordBins<VertexImage> vertices(space_, "vertices", partition_.bins(), 1 << 16);
        LevelSink sink(FinestPages(grid), partition_, *made);
        VertexStep step(grid, partition_, vertices, sink);
        EXPECT_TRUE(bins_->raw().flush().ok());
        for (size_t bin = partition_.bins(); bin-- > 0;) {
            const auto soup = bins_->load(bin);
            ASSERT_TRUE(soup.ok());
            if (soup->empty()) continue;
            LatticeMesh mesh = meshOf(*soup, true);
            computeNormals(mesh);
            ASSERT_TRUE(step.run(bin, mesh).ok());
        }
        EXPECT_TRUE(made->raw().flush().ok() && vertices.raw().flush().ok());
        bins_ = newBins("joined", partition_);
        for (size_t bin = 0; bin < partition_.bins(); ++bin) {
            auto soup = made->load(bin);
            auto known = vertices.load(bin);
            ASSERT_TRUE(soup.ok() && known.ok());
            EXPECT_TRUE(joinVertices(*soup, *known));
            EXPECT_TRUE(bins_->append(bin, *soup).ok());
        }
        EXPECT_TRUE(bins_->raw().flush().ok());
    }

    void step(uint32_t to) {
        const PageGrid from{kLog2Cells, level_}, coarser{kLog2Cells, to};
        const PagePartition next = partition_.coarser();
        auto made = newBins("level" + std::to_string(to), next);
        RecordBins<WaitingTriangle> waiting(space_, "waiting", partition_.bins(), 1 << 16);
        LevelSink sink(FinestPages(coarser), next, *made);
        LevelStep step(from, partition_, waiting, sink);
        for (size_t bin = 0; bin < partition_.bins(); ++bin) {
            EXPECT_TRUE(bins_->raw().flush().ok());
            const auto soup = bins_->load(bin);
            ASSERT_TRUE(soup.ok());
            if (soup->empty()) continue;
            ASSERT_TRUE(step.run(bin, meshOf(*soup, true)).ok());
        }
        EXPECT_TRUE(made->raw().flush().ok());
        bins_ = std::move(made);
        partition_ = next;
    }

    TestFolder folder_{"vcp_level_step_test"};
    TempSpace space_;
    PagePartition partition_;
    uint32_t level_;
    std::unique_ptr<RecordBins<LatticeTriangle>> bins_;
};

/// Each bin of `many` has what it needs of `one`, no more and no less.
void expectSame(const Levels& one, const Levels& many, const std::string& what) {
    const Soup all = one.all();
    ASSERT_FALSE(all.empty());
    std::vector<Soup> want(many.partition().bins());
    const PageGrid grid{kLog2Cells, one.level()};
    for (const LatticeTriangle& t : one.bin(0)) {
        std::vector<uint8_t> seen(want.size(), 0);
        grid.forPagesNear(t.corner, kStepMarginCells, [&](uint64_t page) { seen[many.partition().binOf(page)] = 1; });
        for (size_t bin = 0; bin < want.size(); ++bin)
            if (seen[bin]) want[bin].push_back(t);
    }
    for (size_t bin = 0; bin < want.size(); ++bin) {
        std::sort(want[bin].begin(), want[bin].end());
        ASSERT_TRUE(many.bin(bin) == want[bin])
            << what << ", level " << one.level() << ", bin " << bin << " of " << want.size() << ": "
            << many.bin(bin).size() << " triangles, not " << want[bin].size();
    }
    ASSERT_TRUE(many.all() == all) << what;
}

/// Pages of 8 cells, 8 an axis: 64 cells.
constexpr uint32_t kLevels = 4;

IndexedMesh randomMesh(uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    const double radius = 12 + 12 * unit(random), noise = 0.5 * unit(random);
    IndexedMesh mesh = seed % 2 ? test::torusMesh({31, 33, 30}, radius, radius / 4, 60, 30)
                                : test::sphereMesh({32, 31, 33}, radius, uint32_t(10 + seed % 30));
    for (glm::dvec3& p : mesh.positions) p += noise * (glm::dvec3(unit(random), unit(random), unit(random)) - 0.5);
    return mesh;
}

/// Triangles as long as the dataset, needles, and small ones.
IndexedMesh longMesh(uint64_t seed) {
    IndexedMesh mesh = test::randomTriangles(300, seed, true);
    for (size_t i = 0; i < mesh.positions.size(); ++i) mesh.positions[i] = mesh.positions[i] * 60.0 + 2.0;
    for (size_t i = 0; i + 3 <= mesh.positions.size(); i += 9)
        mesh.triangles.push_back({uint32_t(i), uint32_t((i * 7 + 1) % mesh.positions.size()),
                                  uint32_t((i * 13 + 2) % mesh.positions.size())});
    test::append(mesh, test::boxMesh({3, 3, 3}, {61, 60, 62}, 1));
    test::append(mesh, test::sphereMesh({20, 20, 20}, 8, 20));
    return mesh;
}

std::vector<uint32_t> randomColours(const IndexedMesh& mesh, uint64_t seed) {
    std::mt19937 random{uint32_t(seed)};
    std::vector<uint32_t> colours(mesh.positions.size());
    for (uint32_t& c : colours) c = uint32_t(random());
    return colours;
}

void expectPartitionsAgree(const IndexedMesh& mesh, uint64_t seed) {
    Soup soup = test::soupOf(mesh, randomColours(mesh, seed));
    Levels one(soup, kLevels, PagePartition());
    // The others get the triangles in another order, too.
    std::mt19937_64 random(seed);
    std::shuffle(soup.begin(), soup.end(), random);
    Levels some(soup, kLevels, randomPartition(kLevels - 1, seed)), all(soup, kLevels, allPages(kLevels - 1));
    for (;;) {
        expectSame(one, some, "random bins, seed " + std::to_string(seed));
        expectSame(one, all, "a bin a page, seed " + std::to_string(seed));
        if (one.level() == 0 || testing::Test::HasFatalFailure()) return;
        one.coarsen();
        some.coarsen();
        all.coarsen();
    }
}

TEST(LevelStep, SameSoupForAnyPartition) {
    for (uint64_t seed = 0; seed < 6; ++seed) ASSERT_NO_FATAL_FAILURE(expectPartitionsAgree(randomMesh(seed), seed));
}

TEST(LevelStep, LongTrianglesAcrossManyBins) {
    for (uint64_t seed = 0; seed < 3; ++seed) ASSERT_NO_FATAL_FAILURE(expectPartitionsAgree(longMesh(seed), seed));
}

TEST(LevelStep, VerticesOnPageWalls) {
    IndexedMesh mesh = test::boxMesh({8, 8, 8}, {56, 56, 56}, 12);
    test::append(mesh, test::boxMesh({0, 0, 0}, {64, 64, 64}, 8));
    expectPartitionsAgree(mesh, 1);
}

TEST(LevelSink, BinsOfATriangleAreThoseOfThePagesNearIt) {
    const PageGrid base{kLog2Cells, 2};
    size_t several = 0;
    for (uint64_t seed = 0; seed < 60; ++seed) {
        std::mt19937_64 random(seed);
        std::vector<std::vector<uint64_t>> parted(seed % 3);
        for (size_t depth = 0; depth < parted.size(); ++depth)
            for (int i = 0; i < 6; ++i) parted[depth].push_back(random() % (uint64_t{64} << 3 * depth));
        const FinestPages pages(base, parted);
        const PagePartition partition = randomPartition(pages.deepest(), seed);
        const TestFolder folder("vcp_level_sink_test");
        TempSpace space(folder.path() / "temp", uint64_t{1} << 20);
        RecordBins<LatticeTriangle> bins(space, "level", partition.bins(), 1 << 20);
        const double margin = seed % 5 == 0 ? 0.5 : kStepMarginCells / double(1 + seed % 7);
        LevelSink sink(pages, partition, bins, margin);
        LevelSink::Batch batch(sink);
        const int edge = 1 << (kLog2Cells + PageGrid::kLog2LatticePerCell + pages.deepest());
        LatticeTriangle t{};
        for (int k = 0; k < 2000; ++k) {
            // Some beside the one before, some on walls of pages, a few long.
            const bool isBeside = random() % 4 != 0;
            const int reach = random() % 50 == 0 ? edge / 2 : edge >> (5 + random() % 6);
            glm::i32vec3 at = t.corner[0];
            for (int i = 0; i < 3 && !isBeside; ++i) {
                at[i] = int(random() % uint64_t(edge + 1));
                if (random() % 4 == 0) at[i] = at[i] / (edge / 16) * (edge / 16);
            }
            for (glm::i32vec3& corner : t.corner)
                for (int i = 0; i < 3; ++i)
                    corner[i] = std::clamp(at[i] + int(random() % uint64_t(2 * reach + 1)) - reach, 0, edge);
            std::vector<size_t> want;
            pages.forPagesNear(t.corner, margin, [&](uint32_t level, uint64_t page) {
                want.push_back(partition.binOf(pages.firstCode(level, page)));
            });
            std::sort(want.begin(), want.end());
            want.erase(std::unique(want.begin(), want.end()), want.end());
            std::vector<size_t> have = batch.binsOf(t);
            std::sort(have.begin(), have.end());
            ASSERT_EQ(have, want) << "seed " << seed << ", triangle " << k;
            several += want.size() > 1 ? 1 : 0;
        }
    }
    EXPECT_GT(several, 10000u);
    EXPECT_LT(several, 110000u);
}

TEST(VertexStep, KeepsPositionsAndBringsNormals) {
    const Soup soup = test::soupOf(test::torusMesh({31, 33, 30}, 20, 6, 60, 30));
    LatticeMesh want = meshOf(soup, true);
    computeNormals(want);
    const LatticeMesh have = meshOf(Levels(soup, kLevels, allPages(kLevels - 1)).all(), true);
    EXPECT_EQ(have.positions, want.positions);
    EXPECT_EQ(have.triangles, want.triangles);
    EXPECT_EQ(have.normals, want.normals);
    EXPECT_EQ(have.stray, want.stray);
}

TEST(VertexStep, NoNormalIsCalledUnknown) {
    NormalGridPoint point{};
    EXPECT_FALSE(gridPointOf(kUnknownNormal, point));
}

TEST(VertexStep, SaysThatAVertexIsMissing) {
    std::vector<LatticeTriangle> triangles(1);
    triangles[0] = {{{0, 0, 0}, {9, 0, 0}, {0, 9, 0}}, {1, 2, 3}, {4, kUnknownNormal, 6}, 0};
    EXPECT_FALSE(joinVertices(triangles, {{{9, 0, 1}, 7, 8}}));
    EXPECT_TRUE(joinVertices(triangles, {{{9, 0, 1}, 7, 8}, {{9, 0, 0}, 10, 11}}));
    EXPECT_EQ(triangles[0].colour[1], 10u);
    EXPECT_EQ(triangles[0].normal[1], 11u);
    EXPECT_EQ(triangles[0].normal[2], 6u);
}

/// Corners, edge middles and points inside.
template <class Visit>
void forStraySamples(const LatticeMesh& mesh, const Visit& visit) {
    constexpr double weights[7][3] = {{1, 0, 0},     {0, 1, 0},         {0, 0, 1},        {0.5, 0.5, 0},
                                      {0, 0.5, 0.5}, {0.25, 0.25, 0.5}, {0.4, 0.35, 0.25}};
    for (size_t k = 0; k < mesh.triangles.size(); ++k)
        for (const auto& w : weights) {
            glm::dvec3 p(0);
            for (int i = 0; i < 3; ++i) p += w[i] * glm::dvec3(mesh.positions[mesh.triangles[k][i]]);
            visit(p / double(kLatticePerCell), double(mesh.stray[k]));
        }
}

TEST(LevelStep, StraysBoundTheDistanceBothWays) {
    for (uint64_t seed = 0; seed < 10; ++seed) {
        const IndexedMesh mesh = randomMesh(seed);
        const MeshBvh finest(mesh);
        Levels levels(test::soupOf(mesh), kLevels, randomPartition(kLevels - 1, seed));
        for (double scale = 2; levels.level() > 0; scale *= 2) {
            levels.coarsen();
            const LatticeMesh coarse = meshOf(levels.all(), false);
            double most = 0, moved = 0;
            forStraySamples(coarse, [&](glm::dvec3 p, double stray) {
                const double distance = finest.nearestPoint(p * scale)->distance / scale;
                most = std::max(most, stray);
                moved = std::max(moved, distance);
                ASSERT_LE(distance, stray + 1e-9) << "seed " << seed << ", level " << levels.level();
            });
            EXPECT_GT(moved, 0);
            // A bound that is never reached would be worth nothing.
            EXPECT_LT(most, 20 * moved);
            const IndexedMesh coarseMesh = test::inCells(coarse);
            const MeshBvh bvh(coarseMesh);
            forStraySamples(meshOf(test::soupOf(mesh), false), [&](glm::dvec3 p, double) {
                ASSERT_LE(bvh.nearestPoint(p / scale)->distance, most + 1e-9)
                    << "seed " << seed << ", level " << levels.level();
            });
        }
    }
}

}  // namespace
}  // namespace vcp
