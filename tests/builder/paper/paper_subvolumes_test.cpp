// Files of the method `paper` in subvolumes: every page is what one page for the whole dataset has there.
#include "builder/paper/paper_subvolumes.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>

#include "builder/paper/paper_file.h"
#include "octree/surface/morton.h"
#include "octree/vcp_verify.h"
#include "tests/support/mesh_files.h"
#include "tests/support/test_folder.h"
#include "tests/support/test_meshes.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

constexpr double kCell = 0.036;
constexpr int kCubeCells = 16;

/// A bumpy torus, whose triangles come in the order in which subvolumes take them.
IndexedMesh scene() {
    IndexedMesh mesh = test::torusMesh({0.3, 0.2, 0.1}, 2, 0.25, 150, 30);
    for (glm::dvec3& p : mesh.positions) p *= 1 + 0.02 * std::sin(9 * p.x) * std::cos(7 * p.y);
    for (glm::dvec3& p : mesh.positions)
        for (int axis = 0; axis < 3; ++axis) {
            const volatile float rounded = float(p[axis]);
            p[axis] = double(rounded);
        }
    std::ranges::sort(mesh.triangles, [&](const auto& s, const auto& t) {
        const auto key = [&](const std::array<uint32_t, 3>& triangle) {
            std::array<double, 9> all;
            for (int i = 0; i < 9; ++i) all[i] = mesh.positions[triangle[i / 3]][i % 3];
            return all;
        };
        return key(s) < key(t);
    });
    return mesh;
}

std::string contentOf(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

/// A file that is open, and its pages.
struct PaperFileContent {
    explicit PaperFileContent(const fs::path& path) : reader(*openFile(path)), dataset(*readDataset(*reader)) {
        for (uint64_t i = 0; i < dataset.pages.size(); ++i) pages.push_back(*readPage(*reader, dataset, i, true));
    }
    [[nodiscard]] PaperPageView page(uint64_t i) const { return *parsePaperPage(pages[i].geometryBytes(), 20); }

    std::shared_ptr<const ByteReader> reader;
    Dataset dataset;
    std::vector<PageBytes> pages;
};

float distanceOf(const PaperPageView& page, int32_t word) {
    return float(word - paper::kPaperEmpty) * (page.header.cutoff / float(paper::kPaperEmpty - 1));
}

/// Compares a page's nodes with those of the page of the whole. Counts leaves.
struct NodeComparison {
    const PaperPageView& page;
    const PaperPageView& whole;
    float halo;
    uint64_t leaves = 0, differences = 0;

    void compare(int32_t mine, int32_t theirs) {
        const auto kind = [](int32_t word) { return word < 0 ? 0 : word < paper::kPaperEmpty ? 1 : 2; };
        if (kind(mine) != kind(theirs)) {
            ++differences;
        } else if (kind(mine) == 1) {
            for (int k = 0; k < 8; ++k)
                compare(page.nodes[size_t(mine) + size_t(k)], whole.nodes[size_t(theirs) + size_t(k)]);
        } else if (kind(mine) == 0) {
            ++leaves;
            for (int x = 0; x < 2; ++x)
                differences += page.slices[size_t(-(mine + 1) + x)] == whole.slices[size_t(-(theirs + 1) + x)] ? 0 : 1;
        } else if (mine != theirs) {
            // Only the whole one knows what is beyond the halo.
            const bool isFar =
                distanceOf(whole, theirs) >= halo * 0.9999f && std::abs(distanceOf(page, mine) - halo) < 1e-3f;
            differences += isFar ? 0 : 1;
        }
    }
};

class PaperSubvolumes : public testing::Test {
protected:
    PaperSubvolumes() : folder_("vcp_paper_subvolumes_test") { test::writePly(scene(), folder_ / "mesh.ply"); }

    BuildOptions options(const std::string& output) const {
        BuildOptions made;
        made.inputs = {folder_ / "mesh.ply"};
        made.output = folder_ / output;
        made.cell = kCell;
        made.threads = 2;
        return made;
    }
    fs::path build(const std::string& output, const PaperOptions& paper) const {
        const auto built = buildPaperFile(options(output), paper);
        EXPECT_TRUE(built) << built.error().line();
        return folder_ / output;
    }
    void expectRegionsOfTheWhole(PaperOptions paper) const {
        const PaperFileContent one(build("one.vcp", paper));
        paper.subvolumeCells = kCubeCells;
        const PaperFileContent cut(build("cut.vcp", paper));
        EXPECT_TRUE(verifyFile(*cut.reader));
        const PaperPageView whole = one.page(0);
        ASSERT_EQ(1u << whole.header.rootLevel, unsigned(kCubeCells));
        const FileHeader& h = cut.dataset.header;
        EXPECT_EQ(h.leaves, one.dataset.header.leaves);
        EXPECT_EQ(h.triangles, one.dataset.header.triangles);
        for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(h.origin[axis], one.dataset.header.origin[axis]);
        const LevelRow& finest = h.level[h.levels - 1];
        uint64_t leaves = 0, fullest = 0;
        for (uint64_t i = finest.firstEntry; i < finest.firstEntry + finest.pages; ++i) {
            const glm::uvec3 root(mortonDecode(cut.dataset.pages[i].morton));
            const PaperPageView page = cut.page(i);
            ASSERT_EQ(page.header.longest, whole.header.longest);
            ASSERT_EQ(page.header.cutoff, whole.header.cutoff);
            NodeComparison nodes{page, whole, vectorHalo(paper)};
            const auto& roots = whole.header.roots;
            ASSERT_TRUE(root.x < roots[0] && root.y < roots[1] && root.z < roots[2]);
            nodes.compare(page.nodes[0], whole.nodes[(root.z * roots[1] + root.y) * roots[0] + root.x]);
            // Where no triangle is near there is a node for the whole subvolume, whatever it is parted into.
            if (cut.dataset.pages[i].leaves > 0) {
                EXPECT_EQ(nodes.differences, 0u) << "page " << i;
            }
            leaves += nodes.leaves;
            fullest = std::max(fullest, nodes.leaves);
        }
        EXPECT_EQ(leaves, h.leaves);
        EXPECT_GT(leaves, 50000u);
        EXPECT_GT(finest.pages, 100u);
        EXPECT_LT(fullest, leaves / 20);
    }

    TestFolder folder_;
};

TEST_F(PaperSubvolumes, EachIsThatRegionOfTheOnePage) {
    expectRegionsOfTheWhole({});
    PaperOptions exact;
    exact.growRounds = CornerOctreeOptions::kExactPoints;
    exact.packing = PaperPacking::Octahedral;
    exact.safeEmpty = true;
    expectRegionsOfTheWhole(exact);
    PaperOptions few;
    few.growRounds = 2;
    few.mergeThreshold = -1;
    expectRegionsOfTheWhole(few);
}

TEST_F(PaperSubvolumes, AnyThreadsMemoryAndOrderGiveTheSameBytes) {
    PaperOptions paper;
    paper.subvolumeCells = kCubeCells;
    const std::string expected = contentOf(build("cut.vcp", paper));
    BuildOptions small = options("small.vcp");
    small.threads = 1;
    small.memoryBytes = uint64_t{160} << 20;
    ASSERT_TRUE(buildPaperFile(small, paper));
    EXPECT_TRUE(contentOf(folder_ / "small.vcp") == expected);

    IndexedMesh mesh = scene();
    std::ranges::reverse(mesh.triangles);
    test::writePly(mesh, folder_ / "mesh.ply");
    EXPECT_TRUE(contentOf(build("reversed.vcp", paper)) == expected);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), {}), 4) << "nothing else is left";
}

TEST_F(PaperSubvolumes, TheRootHasLargerCellsAndWhatIsBetweenOnlyLeads) {
    PaperOptions paper;
    paper.subvolumeCells = kCubeCells;
    const PaperFileContent cut(build("cut.vcp", paper));
    const FileHeader& h = cut.dataset.header;
    EXPECT_EQ(h.levels, 5u) << "9 subvolumes across";
    const PaperPageView root = cut.page(0);
    EXPECT_EQ(root.header.cellShift, 2u);
    EXPECT_GT(root.header.leaves, 1000u);
    EXPECT_LT(root.header.leaves, h.leaves / 8);
    for (uint64_t i = 1; i < h.level[h.levels - 1].firstEntry; ++i) EXPECT_EQ(cut.dataset.pages[i].leaves, 0u);
    // The octree of the larger cells is what one page of them is.
    BuildOptions large = options("large.vcp");
    large.cell = 4 * kCell;
    ASSERT_TRUE(buildPaperFile(large, {}));
    const PaperFileContent one(folder_ / "large.vcp");
    EXPECT_NEAR(double(root.header.longest), double(one.page(0).header.longest), 1.0);
}

TEST_F(PaperSubvolumes, WhatCannotBeBuiltIsRefusedAndLeavesNothing) {
    const auto refusal = [&](const BuildOptions& asked, int cells) {
        PaperOptions paper;
        paper.subvolumeCells = cells;
        const auto built = buildPaperFile(asked, paper);
        EXPECT_FALSE(built);
        EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), {}), 1) << "the mesh alone";
        return built ? Error{} : built.error();
    };
    EXPECT_EQ(refusal(options("out.vcp"), 24).code, ErrorCode::Usage);
    EXPECT_EQ(refusal(options("out.vcp"), 8).code, ErrorCode::Usage);
    EXPECT_EQ(refusal(options("out.vcp"), 512).code, ErrorCode::Usage);
    BuildOptions asked = options("out.vcp");
    asked.memoryBytes = uint64_t{150} << 20;
    asked.threads = 1;
    const Error tooLarge = refusal(asked, 256);
    EXPECT_EQ(tooLarge.code, ErrorCode::Limit);
    EXPECT_NE(tooLarge.line().find("more memory"), std::string::npos) << tooLarge.line();
    for (const char* stage : {"reading", "sorting", "level 1 of 2", "level 2 of 2", "writing"}) {
        BuildOptions stopped = options("out.vcp");
        bool wasAsked = false;
        stopped.progress = [&](const BuildProgress& at) {
            wasAsked = wasAsked || at.stage == stage;
            return at.stage != stage;
        };
        EXPECT_EQ(refusal(stopped, kCubeCells).code, ErrorCode::Cancelled) << stage;
        EXPECT_TRUE(wasAsked) << stage;
    }
    asked = options("out.vcp");
    asked.cell = 1e-7;
    EXPECT_EQ(refusal(asked, kCubeCells).code, ErrorCode::Limit);
    asked.inputs = {folder_ / "none.ply"};
    EXPECT_EQ(refusal(asked, kCubeCells).code, ErrorCode::Io);
}

}  // namespace
}  // namespace vcp
