// The whole build: the same bytes whatever the threads and formats, counts, errors, frames far from zero.
#include "builder/build.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <numeric>
#include <random>
#include <set>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "octree/dataset_reader.h"
#include "octree/reference_caster.h"
#include "octree/surface/packing.h"
#include "octree/vcp_verify.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/mesh_files.h"
#include "tests/support/test_folder.h"
#include "tests/support/test_meshes.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

/// Rounded to float: what a file of floats holds.
void roundToFloat(IndexedMesh& mesh) {
    for (glm::dvec3& p : mesh.positions)
        for (int axis = 0; axis < 3; ++axis) {
            // GCC 12 vectorizes double(float(x)) to x.
            const volatile float rounded = float(p[axis]);
            p[axis] = double(rounded);
        }
}

/// A bumpy torus beside a box with sharp edges: soft and hard leaves, several levels.
IndexedMesh scene() {
    IndexedMesh mesh = test::torusMesh({0.3, 0.2, 0.1}, 2, 0.7, 150, 60);
    for (glm::dvec3& p : mesh.positions) p *= 1 + 0.02 * std::sin(9 * p.x) * std::cos(7 * p.y);
    test::append(mesh, test::boxMesh({3, -1, -1}, {4, 1, 1}, 12));
    roundToFloat(mesh);
    return mesh;
}

class Build : public ::testing::Test {
protected:
    BuildOptions options(std::vector<fs::path> inputs, const std::string& output = "out.vcp") const {
        BuildOptions o;
        o.inputs = std::move(inputs);
        o.output = folder_ / output;
        o.threads = 2;
        return o;
    }
    fs::path ply(const IndexedMesh& mesh, const std::string& name = "mesh.ply") const {
        test::writePly(mesh, folder_ / name);
        return folder_ / name;
    }
    Dataset dataset(const std::string& name = "out.vcp") const {
        auto file = openFile(folder_ / name);
        EXPECT_TRUE(file.ok());
        auto data = readDataset(**file);
        EXPECT_TRUE(data.ok()) << data.error().line();
        return data.ok() ? *data : Dataset{};
    }
    void expectIntact(const std::string& name = "out.vcp") const {
        const auto file = openFile(folder_ / name);
        ASSERT_TRUE(file.ok());
        const auto result = verifyFile(**file);
        EXPECT_TRUE(result.ok()) << result.error().line();
    }
    void expectNothingLeft(const std::string& name = "out.vcp") const {
        EXPECT_FALSE(fs::exists(folder_ / name));
        EXPECT_FALSE(fs::exists(folder_ / (name + ".partial")));
    }
    /// Fails with `code` and a line that has `words`; nothing is left.
    void expectError(const BuildOptions& o, ErrorCode code, const std::string& words) const {
        const auto report = buildOctree(o);
        ASSERT_FALSE(report.ok()) << "should say: " << words;
        EXPECT_EQ(report.error().code, code) << report.error().line();
        EXPECT_NE(report.error().line().find(words), std::string::npos) << report.error().line();
        EXPECT_EQ(report.error().line().find('\n'), std::string::npos);
        expectNothingLeft();
    }

    TestFolder folder_{"vcp_build_test"};
};

/// Two closed parts and an open one, far apart.
IndexedMesh closedAndOpen() {
    IndexedMesh mesh = scene();
    test::append(mesh, test::sphereMesh({-6, 0, 0}, 1.5, 40));
    mesh.triangles.pop_back();
    mesh.triangles.resize(mesh.triangles.size() - 300);
    return mesh;
}

TEST_F(Build, SaysWhichPartsAreClosed) {
    BuildOptions o = options({ply(closedAndOpen())});
    o.cell = 0.04;
    ASSERT_TRUE(buildOctree(o).ok());
    const Dataset built = dataset();
    EXPECT_TRUE(built.hasParts());
    EXPECT_EQ(built.header.parts, 3u);
    EXPECT_EQ(built.header.closedParts, 2u);
    EXPECT_GT(built.header.openEdges, 10u);
    EXPECT_EQ(built.pages[0].parts, kPageHasClosed | kPageHasOpen | kPageHasMarks);
    EXPECT_EQ(built.header.version, kFineSlabsFileVersion);
    EXPECT_EQ(built.header.flags, kFlagCovering | kFlagParts | kFlagMarks | kFlagFineSlabs);
    uint64_t closed = 0, open = 0;
    for (uint64_t i = 0; i < built.header.pages; ++i) {
        const PageEntry& page = built.pages[i];
        if (page.childMask != 0) continue;
        const double low = built.originOf(page).x, high = low + built.edgeOf(page);
        EXPECT_TRUE(high > -4.4 || page.parts == kPageHasOpen) << i;
        EXPECT_TRUE(low < -4.4 || page.parts == kPageHasClosed) << i;
        ++(page.parts == kPageHasOpen ? open : closed);
    }
    EXPECT_GT(closed, 3u);
    EXPECT_GT(open, 0u);
    expectIntact();
}

/// A ball in an open tube: pages hold some of both.
IndexedMesh ballInTube() {
    IndexedMesh mesh = test::sphereMesh({0, 0, 0}, 1, 40);
    test::append(mesh, test::gridSurface(60, 20, false, [](double u, double v) {
                     const double angle = test::kTwoPi * u;
                     return glm::dvec3(1.3 * std::cos(angle), 1.3 * std::sin(angle), 2 * v - 1);
                 }));
    return mesh;
}

struct MarkCounts {
    uint64_t open = 0, closed = 0;
};

/// Calls `visit(word, lower, edge)` for the leaves of a page; world units.
template <class Visit>
void forEachLeaf(const PageView& view, uint32_t word, glm::dvec3 lower, double edge, const Visit& visit) {
    if (nodeType(word) != kNodeInternal) return visit(word, lower, edge);
    for (uint32_t o = 0; o < 8; ++o)
        forEachLeaf(view, view.nodes[8 * size_t{word} + o], lower + edge / 2 * glm::dvec3(o & 1, o >> 1 & 1, o >> 2),
                    edge / 2, visit);
}

// What is nearer to the axis than 1.15 is of the ball, what is farther of the tube.
TEST_F(Build, MarksTellOpenPartsFromClosedOnes) {
    BuildOptions o = options({ply(ballInTube())});
    o.cell = 0.04;
    ASSERT_TRUE(buildOctree(o).ok());
    auto cache = PageCache::open(o.output);
    ASSERT_TRUE(cache.ok()) << cache.error().line();
    ASSERT_TRUE(cache->loadAll().ok());
    const Dataset& built = cache->dataset();
    ASSERT_EQ(built.header.parts, 2u);
    ASSERT_EQ(built.header.closedParts, 1u);
    MarkCounts vertices, slabs;
    const auto fromAxis = [](glm::dvec3 p) { return glm::length(glm::dvec2(p)); };
    for (uint64_t i = 0; i < built.header.pages; ++i) {
        const PageEntry& entry = built.pages[i];
        if (entry.leaves == 0) continue;
        const PageView& view = *cache->view(i);
        const bool hasMarks = (entry.parts & kPageHasMarks) != 0;
        EXPECT_EQ(hasMarks, entry.parts > 2) << i;
        const glm::dvec3 origin = built.originOf(entry);
        const double step = built.cellOf(entry.level) / kLatticePerCell;
        for (const glm::u32vec2 vertex : view.vertices) {
            const glm::dvec3 at = origin + step * (glm::dvec3(unpack21(vertex)) - double(kLatticeBias));
            const bool isOpen = fromAxis(at) > 1.15;
            EXPECT_EQ(isOpenVertex(vertex), isOpen && hasMarks) << i;
            EXPECT_TRUE(hasMarks || entry.parts == (isOpen ? kPageHasOpen : kPageHasClosed)) << i;
            ++(isOpenVertex(vertex) ? vertices.open : vertices.closed);
        }
        forEachLeaf(
            view, view.header.root, origin, built.edgeOf(entry), [&](uint32_t word, glm::dvec3 low, double edge) {
                if (nodeType(word) != kNodeSlab) return;
                // Whether all of its box, and some of it, is nearer than the ball or farther than the tube reaches.
                double nearest = 9, farthest = 0;
                for (int corner = 0; corner < 8; ++corner) {
                    const double r = fromAxis(low + edge * glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2));
                    nearest = std::min(nearest, r);
                    farthest = std::max(farthest, r);
                }
                EXPECT_TRUE(nearest < 1.01 || !hasMarks || isOpenSlab(word)) << i;
                EXPECT_TRUE(farthest > 1.29 || !isOpenSlab(word)) << i;
                ++(isOpenSlab(word) ? slabs.open : slabs.closed);
            });
    }
    for (const MarkCounts& counts : {vertices, slabs}) {
        EXPECT_GT(counts.open, 100u);
        EXPECT_GT(counts.closed, 100u);
    }
    expectIntact();
}

TEST_F(Build, SameBytesForAnyThreads) {
    const fs::path input = ply(scene());
    std::string first;
    for (const unsigned threads : {1u, 2u, 3u, 8u, 0u}) {
        BuildOptions o = options({input});
        o.threads = threads;
        ASSERT_TRUE(buildOctree(o).ok());
        const std::string bytes = contentOf(o.output);
        if (first.empty()) first = bytes;
        EXPECT_TRUE(bytes == first) << threads << " threads";
    }
    expectIntact();
}

/// Large enough that a small cap makes several bins.
IndexedMesh largeScene() {
    IndexedMesh mesh = test::torusMesh({0.3, 0.2, 0.1}, 2, 0.7, 400, 200);
    for (glm::dvec3& p : mesh.positions) p *= 1 + 0.02 * std::sin(9 * p.x) * std::cos(7 * p.y);
    // The hole is in one bin, and the torus in all.
    mesh.triangles.pop_back();
    test::append(mesh, test::boxMesh({3, -1, -1}, {4, 1, 1}, 12));
    // Long triangles, far from the corners of most bins.
    test::append(mesh, test::boxMesh({-3, -3, -1.2}, {3, 3, -1.1}, 1));
    return mesh;
}

TEST_F(Build, SameBytesForAnyMemory) {
    const fs::path input = ply(largeScene());
    std::string first;
    for (const uint64_t megabytes : {4096, 150, 180}) {
        BuildOptions o = options({input});
        o.memoryBytes = megabytes << 20;
        o.checkpointSeconds = megabytes == 150 ? 0 : 1e9;  // through the disk, or in memory
        o.threads = megabytes == 180 ? 1 : 2;
        const auto report = buildOctree(o);
        ASSERT_TRUE(report.ok()) << report.error().line();
        EXPECT_EQ(report->tempBytes > 0, megabytes == 150) << megabytes;
        const std::string bytes = contentOf(o.output);
        if (first.empty()) first = bytes;
        EXPECT_TRUE(bytes == first) << megabytes << " MiB";
        const FileHeader header = dataset().header;
        EXPECT_EQ(header.parts, 3u);
        EXPECT_EQ(header.closedParts, 2u);
        EXPECT_EQ(header.openEdges, 3u);
        EXPECT_FALSE(fs::exists(tempFolderOf(o)));
    }
    BuildOptions o = options({input});
    o.memoryBytes = 140 << 20;
    fs::remove(o.output);
    expectError(o, ErrorCode::Limit, "memory cap");
}

/// A dense ball in a wide box.
IndexedMesh crowdedScene() {
    IndexedMesh mesh = test::boxMesh({0, 0, 0}, {100, 110, 120}, 12);
    test::append(mesh, test::sphereMesh({30, 40, 50}, 0.25, 280));
    roundToFloat(mesh);
    return mesh;
}

TEST_F(Build, CrowdedPlacesHaveFinerPages) {
    const fs::path input = ply(crowdedScene());
    BuildOptions o = options({input});
    ASSERT_TRUE(buildOctree(o).ok());
    const std::string bytes = contentOf(o.output);
    expectIntact();
    auto cache = PageCache::open(o.output);
    ASSERT_TRUE(cache.ok());
    ASSERT_TRUE(cache->loadLevel(cache->dataset().header.levels - 1).ok());
    const Dataset& d = cache->dataset();
    std::set<uint32_t> levels;
    const auto cut = cutAtLevel(d, d.header.levels - 1);
    for (const uint64_t page : cut) {
        levels.insert(d.pages[page].level);
        EXPECT_LT(d.pages[page].pageBytes, 8u << 20);
    }
    EXPECT_GT(levels.size(), 2u) << "the ball is many levels smaller than the box";
    // The ball is as round as if it stood alone, and no ray slips through where pages of different levels meet.
    const auto caster = ReferenceCaster::create(*cache, cut);
    ASSERT_TRUE(caster.ok());
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal;
    const glm::dvec3 ball(30, 40, 50), middle(50, 55, 60);
    for (int i = 0; i < 20000; ++i) {
        const glm::dvec3 direction = glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
        const auto onBall = caster->cast({ball - direction, direction});
        ASSERT_TRUE(onBall.has_value());
        EXPECT_NEAR(onBall->t, 0.75, 1e-4);
        const auto onBox = caster->cast({middle, direction});
        ASSERT_TRUE(onBox.has_value());
        const glm::dvec3 reach = glm::dvec3(50, 55, 60) / glm::abs(direction);
        const double wall = std::min({reach.x, reach.y, reach.z});
        EXPECT_TRUE(onBox->t < wall + 0.1) << onBox->t << ' ' << wall;
    }
    // Nothing depends on threads and memory.
    o.threads = 3;
    o.memoryBytes = 180 << 20;
    ASSERT_TRUE(buildOctree(o).ok());
    EXPECT_TRUE(contentOf(o.output) == bytes);
}

TEST_F(Build, NeedlesInACrowdedPlaceStayWholeAndFitTheMemory) {
    // A bundle of needles, each a thousand times as long as it is wide, beside a box.
    IndexedMesh mesh = test::boxMesh({0, 0, 0}, {1, 1, 1}, 60);
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> in(0, 1);
    for (int k = 0; k < 300'000; ++k) {
        const glm::dvec3 at(0.5 + 0.002 * in(random), 0.5 + 0.002 * in(random), 0.6 + 0.06 * in(random));
        const uint32_t first = uint32_t(mesh.positions.size());
        for (const glm::dvec3 aside : {glm::dvec3(0), glm::dvec3(0, 0, 0.02), glm::dvec3(2e-5, 1e-5, 0)})
            mesh.positions.push_back(at + aside);
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    roundToFloat(mesh);
    BuildOptions o = options({ply(mesh)});
    o.memoryBytes = 320 << 20;
    const auto built = buildOctree(o);
    ASSERT_TRUE(built.ok()) << built.error().line();
    EXPECT_LT(built->fileBytes, 12 * built->triangles);
}

TEST_F(Build, ADensePageFitsTheLeastMemory) {
    // As many triangles as a page may hold, and long: what leaves may name, and pieces, would not fit.
    IndexedMesh mesh = test::torusMesh({0, 0, 0}, 10, 4, 1000, 65);
    test::append(mesh, test::boxMesh({40, 0, 0}, {41, 1, 1}, 1));
    roundToFloat(mesh);
    BuildOptions o = options({ply(mesh)});
    o.cell = 1;
    ASSERT_TRUE(buildOctree(o).ok());
    EXPECT_EQ(dataset().pages.size(), 4u);
    const std::string bytes = contentOf(o.output);
    o.memoryBytes = 150 << 20;
    const auto report = buildOctree(o);
    ASSERT_TRUE(report.ok()) << report.error().line();
    EXPECT_TRUE(contentOf(o.output) == bytes);
}

TEST_F(Build, WhatIsTooSmallForTheFileIsWarnedOf) {
    IndexedMesh mesh = test::sphereMesh({0, 0, 0}, 1000, 60);
    const size_t large = mesh.triangles.size();
    const auto ownReport = buildOctree(options({ply(mesh)}));
    ASSERT_TRUE(ownReport.ok());
    EXPECT_TRUE(ownReport->warnings.empty());
    test::append(mesh, test::sphereMesh({1500, 0, 0}, 1e-3, 30));
    const auto report = buildOctree(options({ply(mesh)}));
    ASSERT_TRUE(report.ok()) << report.error().line();
    ASSERT_EQ(report->warnings.size(), 1u);
    const std::string words = fmt::format("{} of {} triangles", mesh.triangles.size() - large, mesh.triangles.size());
    EXPECT_NE(report->warnings[0].find(words), std::string::npos) << report->warnings[0];
}

TEST_F(Build, OrderOfTheTrianglesDoesNotMatter) {
    IndexedMesh mesh = largeScene();
    std::vector<uint32_t> colours(mesh.positions.size());
    for (size_t v = 0; v < colours.size(); ++v) colours[v] = uint32_t(0xff000000u | (v * 77 & 0xffffff));
    test::writePly(mesh, folder_ / "straight.ply", colours);
    BuildOptions o = options({folder_ / "straight.ply"}, "straight.vcp");
    o.memoryBytes = 150 << 20;
    ASSERT_TRUE(buildOctree(o).ok());
    // Triangles shuffled, their corners turned; vertices renumbered.
    std::mt19937_64 random(3);
    std::vector<uint32_t> names(mesh.positions.size());
    std::iota(names.begin(), names.end(), 0u);
    std::shuffle(names.begin(), names.end(), random);
    IndexedMesh shuffled = mesh;
    std::vector<uint32_t> itsColours = colours;
    for (size_t v = 0; v < names.size(); ++v) {
        shuffled.positions[names[v]] = mesh.positions[v];
        itsColours[names[v]] = colours[v];
    }
    for (auto& t : shuffled.triangles) {
        for (uint32_t& v : t) v = names[v];
        std::rotate(t.begin(), t.begin() + ptrdiff_t(random() % 3), t.end());
    }
    std::shuffle(shuffled.triangles.begin(), shuffled.triangles.end(), random);
    test::writePly(shuffled, folder_ / "shuffled.ply", itsColours);
    for (const uint64_t megabytes : {150, 1024}) {
        BuildOptions other = options({folder_ / "shuffled.ply"}, "shuffled.vcp");
        other.memoryBytes = megabytes << 20;
        ASSERT_TRUE(buildOctree(other).ok());
        EXPECT_TRUE(contentOf(other.output) == contentOf(o.output)) << megabytes << " MiB";
    }
}

TEST_F(Build, ReportMatchesTheFile) {
    const IndexedMesh mesh = scene();
    const auto report = buildOctree(options({ply(mesh)}));
    ASSERT_TRUE(report.ok()) << report.error().line();
    const Dataset d = dataset();
    EXPECT_EQ(report->triangles, mesh.triangles.size());
    EXPECT_EQ(report->vertices, mesh.positions.size());
    EXPECT_EQ(report->degenerateTriangles, 0u);
    EXPECT_EQ(report->fileBytes, fs::file_size(folder_ / "out.vcp"));
    EXPECT_EQ(report->levels, d.header.levels);
    EXPECT_EQ(report->subvolumes, d.pages.size());
    EXPECT_EQ(report->cell, d.header.cell);
    EXPECT_EQ(report->certifiedErrorMax, d.header.certifiedErrorMax);
    EXPECT_LE(report->certifiedErrorMax, report->errorTarget * 1.0001);
    EXPECT_GT(report->peakRssBytes, 0u);
    EXPECT_GT(report->hardLeaves, 0u);
    EXPECT_EQ(report->leaves, report->hardLeaves) << "the finest level is the mesh";
    uint64_t leaves = 0;
    for (const PageEntry& e : d.pages)
        if (e.level + 1u == d.header.levels) leaves += e.leaves;
    EXPECT_EQ(report->leaves, leaves);
    EXPECT_FALSE(d.hasColour());
    for (int axis = 0; axis < 3; ++axis) {
        double low = 1e300, high = -1e300;
        for (const glm::dvec3& p : mesh.positions) {
            low = std::min(low, p[axis]);
            high = std::max(high, p[axis]);
        }
        EXPECT_EQ(d.header.boundsMin[axis], low);
        EXPECT_EQ(d.header.boundsMax[axis], high);
        EXPECT_LT(d.header.origin[axis], low);
        EXPECT_GT(d.header.origin[axis] + d.edgeOf(d.pages[0]), high);
    }
}

TEST_F(Build, LevelsAreLinkedAndTheirErrorsGrow) {
    BuildOptions o = options({ply(scene())});
    o.cell = 0.03;
    const auto report = buildOctree(o);
    ASSERT_TRUE(report.ok());
    const Dataset d = dataset();
    ASSERT_GE(d.header.levels, 3u);
    for (uint32_t l = 0; l + 1 < d.header.levels; ++l) {
        EXPECT_GT(d.header.level[l].certifiedError, d.header.level[l + 1].certifiedError) << "level " << l;
        EXPECT_LE(d.header.level[l].pages, d.header.level[l + 1].pages);
        EXPECT_LT(d.header.level[l].certifiedError, d.cellOf(l)) << "a coarse level is good for less than a cell";
    }
    for (const PageEntry& e : d.pages) {
        EXPECT_LE(double(e.certifiedError), d.header.level[e.level].certifiedError);
        EXPECT_EQ(e.childMask == 0, e.level + 1u == d.header.levels)
            << "all branches reach the finest level of a mesh that is dense";
    }
}

TEST_F(Build, TwoInputsAreJoined) {
    const IndexedMesh torus = test::torusMesh(glm::dvec3(0), 2, 0.7, 60, 30),
                      box = test::boxMesh({3, -1, -1}, {4, 1, 1}, 6);
    IndexedMesh both = torus;
    test::append(both, box);
    ASSERT_TRUE(buildOctree(options({ply(torus, "a.ply"), ply(box, "b.ply")}, "joined.vcp")).ok());
    ASSERT_TRUE(buildOctree(options({ply(both)})).ok());
    EXPECT_TRUE(contentOf(folder_ / "joined.vcp") == contentOf(folder_ / "out.vcp"));
}

TEST_F(Build, SoupEqualsIndexedMesh) {
    IndexedMesh mesh = scene();
    // A soup brings its vertices in the order of the triangles.
    IndexedMesh ordered;
    std::vector<uint32_t> names(mesh.positions.size(), ~0u);
    for (const auto& t : mesh.triangles) {
        std::array<uint32_t, 3> r{};
        for (int i = 0; i < 3; ++i) {
            if (names[t[i]] == ~0u) {
                names[t[i]] = uint32_t(ordered.positions.size());
                ordered.positions.push_back(mesh.positions[t[i]]);
            }
            r[i] = names[t[i]];
        }
        ordered.triangles.push_back(r);
    }
    test::writeStl(mesh, folder_ / "mesh.stl");
    const auto soup = buildOctree(options({folder_ / "mesh.stl"}, "soup.vcp"));
    const auto indexed = buildOctree(options({ply(ordered)}));
    ASSERT_TRUE(soup.ok() && indexed.ok());
    EXPECT_EQ(soup->vertices, 3 * mesh.triangles.size());
    EXPECT_EQ(soup->leaves, indexed->leaves);
    EXPECT_EQ(soup->hardLeaves, indexed->hardLeaves);
    // But for the number of vertices read, the files are the same.
    const Dataset a = dataset("soup.vcp"), b = dataset();
    ASSERT_EQ(a.pages.size(), b.pages.size());
    EXPECT_EQ(a.header.cell, b.header.cell);
    EXPECT_EQ(std::memcmp(a.pages.data(), b.pages.data(), a.pages.size() * sizeof(PageEntry)), 0);
}

TEST_F(Build, DegenerateTrianglesAreCounted) {
    IndexedMesh mesh = test::torusMesh(glm::dvec3(0), 2, 0.7, 40, 20);
    const auto clean = buildOctree(options({ply(mesh)}, "clean.vcp"));
    mesh.triangles.push_back({5, 5, 9});
    mesh.triangles.push_back({7, 7, 7});
    // Two vertices at one place, and three in a line.
    const auto n = uint32_t(mesh.positions.size());
    mesh.positions.push_back(mesh.positions[3]);
    mesh.positions.push_back({1, 0, 0});
    mesh.positions.push_back({1.25, 0, 0});
    mesh.positions.push_back({1.5, 0, 0});
    mesh.triangles.push_back({3, n, 11});
    mesh.triangles.push_back({n + 1, n + 2, n + 3});
    const auto report = buildOctree(options({ply(mesh)}));
    ASSERT_TRUE(clean.ok() && report.ok());
    EXPECT_EQ(clean->degenerateTriangles, 0u);
    EXPECT_EQ(report->degenerateTriangles, 4u);
    EXPECT_EQ(report->triangles, clean->triangles + 4);
    EXPECT_EQ(report->leaves, clean->leaves);
    EXPECT_EQ(report->cell, clean->cell);
    expectIntact();
}

TEST_F(Build, MeshWithoutAreaIsAnError) {
    IndexedMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}};
    mesh.triangles = {{0, 1, 2}, {0, 0, 1}};
    expectError(options({ply(mesh)}), ErrorCode::InvalidInput, "none of its 2 triangles has an area");
    mesh.triangles.clear();
    expectError(options({ply(mesh)}), ErrorCode::InvalidInput, "no faces");
}

TEST_F(Build, SingleTriangle) {
    IndexedMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0.1, 0}, {0.2, 1, 0.3}};
    mesh.triangles = {{0, 1, 2}};
    const auto report = buildOctree(options({ply(mesh)}));
    ASSERT_TRUE(report.ok()) << report.error().line();
    EXPECT_GT(report->leaves, 0u);
    EXPECT_EQ(report->levels, 1u);
    expectIntact();
    // A fine cell: the same triangle is split and has many pages.
    BuildOptions fine = options({folder_ / "mesh.ply"}, "fine.vcp");
    fine.cell = 0.002;
    const auto detailed = buildOctree(fine);
    ASSERT_TRUE(detailed.ok()) << detailed.error().line();
    EXPECT_GT(detailed->levels, 3u);
    expectIntact("fine.vcp");
}

TEST_F(Build, CellLargerThanTheMesh) {
    BuildOptions o = options({ply(test::torusMesh(glm::dvec3(0), 2, 0.7, 60, 30))});
    o.cell = 50;
    const auto report = buildOctree(o);
    ASSERT_TRUE(report.ok()) << report.error().line();
    EXPECT_EQ(report->levels, 1u);
    EXPECT_EQ(report->cell, 50);
    EXPECT_GT(report->leaves, 0u);
    expectIntact();
    // So large that nothing is left of the mesh.
    o.cell = 1e7;
    fs::remove(o.output);
    expectError(o, ErrorCode::InvalidInput, "use a smaller cell edge");
}

TEST_F(Build, CellTooSmall) {
    BuildOptions o = options({ply(test::torusMesh(glm::dvec3(0), 2, 0.7, 60, 30))});
    o.cell = 1e-9;
    expectError(o, ErrorCode::Limit, "let the cell edge be");
    // What the message advises, works in principle: it is within the limit. A cell a little below it is not.
    const auto report = buildOctree(o);
    ASSERT_FALSE(report.ok());
    EXPECT_NE(report.error().line().find("mesh.ply"), std::string::npos) << report.error().line();
}

TEST_F(Build, ErrorTooSmall) {
    BuildOptions o = options({ply(test::torusMesh(glm::dvec3(0), 2, 0.7, 60, 30))});
    o.error = 1e-9;
    expectError(o, ErrorCode::Limit, "finer cell");
}

TEST_F(Build, ErrorOptionIsKept) {
    const fs::path input = ply(test::torusMesh(glm::dvec3(0), 2, 0.7, 120, 60));
    const auto normal = buildOctree(options({input}));
    ASSERT_TRUE(normal.ok());
    for (const double factor : {0.3, 3.0}) {
        BuildOptions o = options({input}, "other.vcp");
        o.error = factor * 0.08 * normal->cell;
        const auto report = buildOctree(o);
        ASSERT_TRUE(report.ok()) << report.error().line();
        EXPECT_NEAR(report->errorTarget, o.error, 1e-12);
        EXPECT_LE(report->certifiedErrorMax, o.error * 1.0001);
        EXPECT_GT(report->leaves, report->hardLeaves);
    }
    BuildOptions relative = options({input}, "relative.vcp");
    relative.error = 0.001;
    relative.errorIsRelative = true;
    const auto report = buildOctree(relative);
    ASSERT_TRUE(report.ok());
    EXPECT_NEAR(report->errorTarget, 0.001 * std::hypot(5.4, 5.4, 1.4), 1e-3);
}

TEST_F(Build, FarOriginsLoseNothing) {
    IndexedMesh mesh = scene();
    // On a grid of 2^-20, so that the translation is exact.
    for (glm::dvec3& p : mesh.positions) p = glm::round(p * 1048576.0) / 1048576.0;
    IndexedMesh far = mesh;
    for (glm::dvec3& p : far.positions) p += glm::dvec3(3.79e6, 5.2e6, -450000);
    const auto here = buildOctree(options({ply(mesh)}));
    const auto there = buildOctree(options({ply(far, "far.ply")}, "far.vcp"));
    ASSERT_TRUE(here.ok() && there.ok());
    EXPECT_EQ(there->leaves, here->leaves);
    EXPECT_EQ(there->hardLeaves, here->hardLeaves);
    EXPECT_EQ(there->subvolumes, here->subvolumes);
    EXPECT_NEAR(there->cell, here->cell, 1e-9 * here->cell);
    EXPECT_NEAR(there->certifiedErrorMax, here->certifiedErrorMax, 1e-3 * here->certifiedErrorMax);
}

TEST_F(Build, ScalesDoNotMatter) {
    const IndexedMesh mesh = scene();
    const auto plain = buildOctree(options({ply(mesh)}));
    ASSERT_TRUE(plain.ok());
    for (const int exponent : {-60, -20, 20, 60}) {
        IndexedMesh scaled = mesh;
        for (glm::dvec3& p : scaled.positions) p *= std::exp2(exponent);
        const auto report = buildOctree(options({ply(scaled, "scaled.ply")}, "scaled.vcp"));
        ASSERT_TRUE(report.ok()) << report.error().line();
        EXPECT_EQ(report->leaves, plain->leaves) << exponent;
        EXPECT_EQ(report->cell, std::ldexp(plain->cell, exponent)) << exponent;
        EXPECT_EQ(report->degenerateTriangles, 0u) << exponent;
    }
}

// Areas of such meshes are beyond the range of doubles: a clear line or a whole file, but never rubbish.
TEST_F(Build, AbsurdScalesEndWell) {
    for (const double scale : {1e-200, 1e-100, 1e100, 1e200, 1e307}) {
        IndexedMesh mesh = test::torusMesh(glm::dvec3(0), 2, 0.7, 20, 10);
        for (glm::dvec3& p : mesh.positions) p *= scale;
        const auto report = buildOctree(options({ply(mesh)}));
        if (report.ok()) {
            EXPECT_TRUE(std::isfinite(report->cell)) << scale;
            EXPECT_TRUE(std::isfinite(report->certifiedErrorMax)) << scale;
            EXPECT_EQ(report->degenerateTriangles, 0u) << scale;
            expectIntact();
            fs::remove(folder_ / "out.vcp");
        } else {
            EXPECT_FALSE(report.error().message.empty());
            expectNothingLeft();
        }
    }
}

TEST_F(Build, ColourFollowsTheOption) {
    const IndexedMesh mesh = test::torusMesh(glm::dvec3(0), 2, 0.7, 40, 20);
    std::vector<uint32_t> colours(mesh.positions.size());
    for (size_t v = 0; v < colours.size(); ++v) colours[v] = uint32_t(0xff000000u | (v * 77 & 0xffffff));
    test::writePly(mesh, folder_ / "colour.ply", colours);
    BuildOptions o = options({folder_ / "colour.ply"});
    ASSERT_TRUE(buildOctree(o).ok());
    EXPECT_TRUE(dataset().hasColour());
    expectIntact();
    o.colour = ColourChoice::None;
    ASSERT_TRUE(buildOctree(o).ok());
    EXPECT_FALSE(dataset().hasColour());
    // Asked for, but not there; and mixed with an input that has some.
    BuildOptions plain = options({ply(mesh)}, "plain.vcp");
    plain.colour = ColourChoice::Vertex;
    const auto none = buildOctree(plain);
    ASSERT_FALSE(none.ok());
    EXPECT_NE(none.error().line().find("no vertex colours"), std::string::npos) << none.error().line();
    plain.inputs = {folder_ / "mesh.ply", folder_ / "colour.ply"};
    ASSERT_TRUE(buildOctree(plain).ok());
    EXPECT_TRUE(dataset("plain.vcp").hasColour());
}

TEST_F(Build, ProgressNeverDecreases) {
    BuildOptions o = options({ply(scene())});
    double last = -1;
    int calls = 0;
    o.progress = [&](const BuildProgress& p) {
        EXPECT_GE(p.fraction, last);
        EXPECT_LE(p.fraction, 1);
        EXPECT_NE(std::string(p.stage), "");
        last = p.fraction;
        ++calls;
        return true;
    };
    ASSERT_TRUE(buildOctree(o).ok());
    EXPECT_EQ(last, 1);
    EXPECT_GE(calls, 2);
}

TEST_F(Build, EveryStageIsToldWholeAndInOrder) {
    BuildOptions o = options({ply(scene())});
    // Kept for longer than the call: the text is the listener's own.
    std::vector<BuildProgress> told;
    o.progress = [&](const BuildProgress& p) { return told.push_back(p), true; };
    const auto report = buildOctree(o);
    ASSERT_TRUE(report) << report.error().line();
    ASSERT_GE(report->levels, 2u);
    std::vector<std::string> stages, wanted{"reading", "sorting"};
    for (const BuildProgress& each : told)
        if (stages.empty() || stages.back() != each.stage) stages.push_back(each.stage);
    for (uint32_t i = 1; i <= report->levels; ++i) wanted.push_back(fmt::format("level {} of {}", i, report->levels));
    wanted.insert(wanted.end(), {"writing", "done"});
    EXPECT_EQ(stages, wanted);
    EXPECT_EQ(told.back().fraction, 1);
    for (size_t i = 1; i < told.size(); ++i) EXPECT_GE(told[i].fraction, told[i - 1].fraction) << told[i].stage;
    EXPECT_LT(told[told.size() - 2].fraction, 1) << "only what is done is told as all of it";
}

TEST_F(Build, WhoCancelledHearsNoMore) {
    BuildOptions o = options({ply(scene())});
    o.threads = 4;
    for (const size_t after : {1, 2, 3, 4, 5}) {
        size_t calls = 0;
        o.progress = [&](const BuildProgress&) { return ++calls < after; };
        const auto report = buildOctree(o);
        ASSERT_FALSE(report);
        EXPECT_EQ(report.error().code, ErrorCode::Cancelled);
        EXPECT_EQ(calls, after);
        expectNothingLeft();
    }
}

TEST_F(Build, CancellationLeavesNothing) {
    BuildOptions o = options({ply(scene())});
    for (const int after : {0, 1, 2, 3}) {
        int calls = 0;
        o.progress = [&](const BuildProgress& p) { return p.fraction >= 1 || calls++ < after; };
        const auto report = buildOctree(o);
        // The build may be done before it is asked so often.
        if (report.ok()) {
            fs::remove(o.output);
            continue;
        }
        EXPECT_EQ(report.error().code, ErrorCode::Cancelled);
        expectNothingLeft();
    }
    o.progress = [](const BuildProgress&) { return false; };
    expectError(o, ErrorCode::Cancelled, "cancelled");
}

TEST_F(Build, FailureKeepsTheOldFile) {
    const fs::path good = ply(test::torusMesh(glm::dvec3(0), 2, 0.7, 40, 20));
    ASSERT_TRUE(buildOctree(options({good})).ok());
    const std::string before = contentOf(folder_ / "out.vcp");
    std::ofstream(folder_ / "bad.ply")
        << "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n";
    BuildOptions cancelled = options({good});
    cancelled.progress = [](const BuildProgress&) { return false; };
    for (const BuildOptions& o : {options({folder_ / "bad.ply"}), options({folder_ / "none.ply"}),
                                  options({good, folder_ / "bad.ply"}), options({}), cancelled}) {
        EXPECT_FALSE(buildOctree(o).ok());
        EXPECT_TRUE(contentOf(folder_ / "out.vcp") == before);
        EXPECT_FALSE(fs::exists(folder_ / "out.vcp.partial"));
    }
}

TEST_F(Build, FullDisk) {
    const fs::path input = ply(scene());
    ASSERT_TRUE(buildOctree(options({input}, "whole.vcp")).ok());
    const auto size = fs::file_size(folder_ / "whole.vcp");
    // In the directory, among the pages, and just before the commit record.
    for (const uint64_t limit : {uint64_t{4200}, uint64_t{size / 2}, uint64_t{size - 1}}) {
        const auto report = [&] {
            const test::FileSizeLimit full(limit);
            return buildOctree(options({input}));
        }();
        ASSERT_FALSE(report.ok()) << limit;
        EXPECT_EQ(report.error().code, ErrorCode::Io);
        EXPECT_NE(report.error().line().find("out.vcp: write failed"), std::string::npos) << report.error().line();
        expectNothingLeft();
    }
}

TEST_F(Build, WrongOutputsAreFoundFirst) {
    // Before the input, which is not there, is looked at.
    BuildOptions o = options({folder_ / "none.ply"});
    o.output = folder_.path();
    const auto folder = buildOctree(o);
    ASSERT_FALSE(folder.ok());
    EXPECT_EQ(folder.error().code, ErrorCode::Io);
    EXPECT_NE(folder.error().line().find("is a folder"), std::string::npos) << folder.error().line();
    o.output = folder_ / "no" / "such" / "out.vcp";
    const auto missing = buildOctree(o);
    ASSERT_FALSE(missing.ok());
    EXPECT_NE(missing.error().line().find("out.vcp"), std::string::npos) << missing.error().line();
}

}  // namespace
}  // namespace vcp
