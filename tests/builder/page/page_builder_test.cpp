// Pages: exact corners, the tree that covers every occupied cell, honest clearances, and the bytes of it all.
#include "builder/page/page_builder.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include "builder/page/bin_triangles.h"
#include "builder/page/page_encoder.h"
#include "octree/page/page.h"
#include "octree/surface/packing.h"
#include "octree/vcp_writer.h"
#include "tests/support/lattice_meshes.h"
#include "tests/support/test_meshes.h"

namespace vcp {
namespace {

constexpr uint32_t kPageLog2Cells = 5;
constexpr int kCells = 1 << kPageLog2Cells;
constexpr double kTolerance = 0.08;

/// A mesh and one page of it, of two levels of pages (64 cells).
struct MeshPage {
    LatticeMesh mesh;
    TriangleBins bins;
    glm::u32vec3 at;
    std::optional<PageGeometry> geometry;

    MeshPage(LatticeMesh m, glm::u32vec3 position, uint32_t level = 1)
        : mesh(std::move(m)), bins(binTriangles(mesh, {kPageLog2Cells, level})), at(position) {
        const auto page = std::find(bins.pages.begin(), bins.pages.end(), mortonEncode(at));
        const auto triangles =
            page == bins.pages.end() ? std::span<const uint32_t>() : bins.of(size_t(page - bins.pages.begin()));
        geometry.emplace(mesh, triangles, at, kPageLog2Cells);
    }
    [[nodiscard]] Triangle3 triangle(size_t k) const {
        Triangle3 t;
        for (int i = 0; i < 3; ++i)
            t[i] =
                glm::dvec3(mesh.positions[mesh.triangles[k][i]] - geometry->originLattice()) / double(kLatticePerCell);
        return t;
    }
};

/// Smooth and crumpled parts, needles, a plate on grid planes.
LatticeMesh mixedMesh(uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    const auto point = [&](double low, double high) {
        return low + (high - low) * glm::dvec3(unit(random), unit(random), unit(random));
    };
    IndexedMesh mesh = test::sphereMesh(point(20, 44), 6 + 10 * unit(random), 20 + uint32_t(random() % 30));
    IndexedMesh torus = test::torusMesh(glm::dvec3(32), 12 + 8 * unit(random), 2 + 3 * unit(random), 80, 30);
    test::rotate(torus, glm::dvec3(32), point(-1, 1), 6 * unit(random));
    test::append(mesh, torus);
    IndexedMesh soup = test::randomTriangles(60, seed, true);
    const glm::dvec3 where = point(4, 40);
    for (glm::dvec3& p : soup.positions) p = where + p * 20.0;
    test::append(mesh, soup);
    test::append(mesh, test::boxMesh({30, 31, 5}, {34, 33, 9}, 2));
    return test::onLattice(mesh);
}

TEST(PageGeometry, CornersOfOccupiedCellsAreExact) {
    size_t compared = 0;
    for (uint64_t seed = 0; seed < 4; ++seed) {
        const LatticeMesh mesh = mixedMesh(seed);
        for (const glm::u32vec3 at : {glm::u32vec3(0, 0, 0), glm::u32vec3(1, 0, 1)}) {
            MeshPage page(mesh, at);
            std::mt19937 random{uint32_t(seed)};
            for (int z = 0; z < kCells; ++z)
                for (int y = 0; y < kCells; ++y)
                    for (int x = 0; x < kCells; ++x) {
                        if (!page.geometry->occupied({x, y, z}) || random() % 4 != 0) continue;
                        // Corners of the cell and points of its subcells.
                        const glm::ivec3 part = random() % 2
                                                    ? glm::ivec3(random() % 2, random() % 2, random() % 2) * kSubcells
                                                    : glm::ivec3(random() % 9, random() % 9, random() % 9);
                        const glm::ivec3 subcells = glm::ivec3(x, y, z) * kSubcells + part;
                        const glm::dvec3 p = glm::dvec3(subcells) / double(kSubcells);
                        const CornerVector& corner = page.geometry->corner(subcells);
                        ClosestPoint best;
                        best.squared = 1e300;
                        for (size_t k = 0; k < mesh.triangles.size(); ++k) {
                            const ClosestPoint c = closestOnTriangle(p, page.triangle(k));
                            if (c.squared < best.squared) best = c;
                        }
                        ++compared;
                        ASSERT_EQ(corner.distance, std::sqrt(best.squared))
                            << "seed " << seed << " cell " << x << ' ' << y << ' ' << z;
                        ASSERT_NEAR(glm::length(corner.direction), 1, 1e-12);
                        if (best.squared > 1e-12) {
                            ASSERT_EQ(corner.direction, -best.offset / corner.distance) << seed;
                        }
                    }
        }
    }
    EXPECT_GT(compared, 800u);
}

// What two pages say of a corner that they share is the same: no crack between them.
TEST(PageGeometry, NeighbouringPagesAgreeOnCorners) {
    const LatticeMesh mesh = mixedMesh(3);
    MeshPage left(mesh, {0, 0, 0}), right(mesh, {1, 0, 0});
    int compared = 0;
    for (int z = 0; z < kCells; ++z)
        for (int y = 0; y < kCells; ++y) {
            if (!left.geometry->occupied({kCells - 1, y, z}) || !right.geometry->occupied({0, y, z})) continue;
            for (int c = 0; c < 4; ++c) {
                const CornerVector a = left.geometry->corner(glm::ivec3(kCells, y + (c & 1), z + (c >> 1)) * kSubcells);
                const CornerVector b = right.geometry->corner(glm::ivec3(0, y + (c & 1), z + (c >> 1)) * kSubcells);
                ASSERT_EQ(packVector(a.distance, a.direction, false), packVector(b.distance, b.direction, false));
                ++compared;
            }
        }
    EXPECT_GT(compared, 20);
}

TEST(PageGeometry, OccupancyIsTouch) {
    MeshPage page(mixedMesh(2), {0, 0, 0});
    std::vector<uint8_t> touched(kCells * kCells * kCells, 0), near(touched);
    Polygon polygon;
    for (size_t k = 0; k < page.mesh.triangles.size(); ++k) {
        const Triangle3 t = page.triangle(k);
        const BoxOverlap bounds(t);
        const glm::ivec3 low = glm::max(glm::ivec3(glm::floor(bounds.lower())) - 1, 0),
                         high = glm::min(glm::ivec3(glm::floor(bounds.upper())) + 1, kCells - 1);
        for (int z = low.z; z <= high.z; ++z)
            for (int y = low.y; y <= high.y; ++y)
                for (int x = low.x; x <= high.x; ++x) {
                    const glm::dvec3 cell(x, y, z);
                    clipToBox(t, cell, cell + 1.0, polygon);
                    if (!polygon.empty()) touched[x + kCells * (y + kCells * z)] = 1;
                    clipToBox(t, cell - 1e-8, cell + 1.0 + 1e-8, polygon);
                    if (!polygon.empty()) near[x + kCells * (y + kCells * z)] = 1;
                }
    }
    size_t occupied = 0;
    for (int z = 0; z < kCells; ++z)
        for (int y = 0; y < kCells; ++y)
            for (int x = 0; x < kCells; ++x) {
                const bool is = page.geometry->occupied({x, y, z});
                const size_t i = size_t(x + kCells * (y + kCells * z));
                occupied += is;
                ASSERT_TRUE(is || !touched[i]) << x << ' ' << y << ' ' << z;
                ASSERT_TRUE(!is || near[i]) << x << ' ' << y << ' ' << z;
            }
    EXPECT_GT(occupied, 100u);
}

TEST(PageGeometry, TrianglesOnCellWallsAreInBothCells) {
    // A plate in the plane x = 10: the cells on both sides have it.
    IndexedMesh plate;
    plate.positions = {{10, 4, 4}, {10, 8, 4}, {10, 4, 8}};
    plate.triangles = {{0, 1, 2}};
    MeshPage page(test::onLattice(plate), {0, 0, 0});
    EXPECT_TRUE(page.geometry->occupied({9, 4, 4}));
    EXPECT_TRUE(page.geometry->occupied({10, 4, 4}));
    EXPECT_TRUE(page.geometry->occupied({10, 3, 4})) << "it touches the wall between them, too";
    EXPECT_FALSE(page.geometry->occupied({11, 4, 4}));
    EXPECT_FALSE(page.geometry->occupied({8, 4, 4}));
    std::vector<uint32_t> around, inside;
    for (const int x : {9, 10}) {
        page.geometry->trianglesOf({glm::ivec3(x, 4, 4) * kSubcells, kSubcells}, around, inside);
        EXPECT_EQ(inside, (std::vector<uint32_t>{0})) << x;
    }
}

TEST(PageGeometry, TrianglesOfBoxesAndFiltersAgree) {
    MeshPage page(mixedMesh(1), {0, 0, 0});
    std::mt19937 random(1);
    std::vector<uint32_t> around, inside, filteredAround, filteredInside, all(page.bins.triangles.size());
    for (int i = 0; i < 300; ++i) {
        const int edge = 1 << random() % 4;
        const NodeBox box{
            glm::ivec3(random() % (kCells / edge), random() % (kCells / edge), random() % (kCells / edge)) * edge *
                kSubcells,
            edge * kSubcells};
        page.geometry->trianglesOf(box, around, inside);
        std::vector<uint32_t> candidates;
        for (uint32_t k = 0; k < page.bins.of(0).size(); ++k) candidates.push_back(k);
        page.geometry->filter(box, candidates, filteredAround, filteredInside);
        ASSERT_EQ(inside, filteredInside);
        // Cell by cell a little more may be near than of the box as a whole.
        ASSERT_TRUE(std::includes(around.begin(), around.end(), filteredAround.begin(), filteredAround.end()));
        ASSERT_TRUE(std::includes(around.begin(), around.end(), inside.begin(), inside.end()));
    }
}

/// What every tree must be.
void expectSound(MeshPage& page, const PageTree& tree) {
    using Kind = TreeNode::Kind;
    std::vector<int> parents(tree.nodes.size(), 0);
    std::vector<uint8_t> covered(kCells * kCells * kCells, 0);
    size_t soft = 0, hard = 0;
    for (const TreeNode& n : tree.nodes) {
        if (n.kind == Kind::Internal) {
            ASSERT_LE(n.index + 8, tree.nodes.size());
            for (int i = 0; i < 8; ++i) {
                ++parents[n.index + i];
                ASSERT_EQ(tree.nodes[n.index + i].box.lower, n.box.child(i).lower);
                ASSERT_EQ(tree.nodes[n.index + i].box.edge, n.box.edge / 2);
            }
            continue;
        }
        if (n.kind == Kind::Soft) {
            ++soft;
            ASSERT_EQ(tree.soft[n.index].box.lower, n.box.lower);
        }
        if (n.kind == Kind::Hard) {
            ++hard;
            ASSERT_EQ(tree.hard[n.index].box.lower, n.box.lower);
        }
        if (n.kind == Kind::Empty) {
            // No triangle touches it.
            std::vector<uint32_t> around, inside, candidates;
            if (n.box.edge >= kSubcells) {
                page.geometry->trianglesOf(n.box, around, inside);
                ASSERT_TRUE(inside.empty()) << "surface in an empty node";
            }
            continue;
        }
        const glm::ivec3 low = n.box.lower / kSubcells, high = (n.box.lower + n.box.edge - 1) / kSubcells;
        for (int z = low.z; z <= high.z; ++z)
            for (int y = low.y; y <= high.y; ++y)
                for (int x = low.x; x <= high.x; ++x) covered[size_t(x + kCells * (y + kCells * z))] = 1;
    }
    ASSERT_EQ(soft, tree.soft.size());
    ASSERT_EQ(hard, tree.hard.size());
    ASSERT_EQ(parents[0], 0);
    for (size_t i = 1; i < parents.size(); ++i) ASSERT_EQ(parents[i], 1) << "node " << i;
    for (int z = 0; z < kCells; ++z)
        for (int y = 0; y < kCells; ++y)
            for (int x = 0; x < kCells; ++x) {
                if (!page.geometry->occupied({x, y, z})) continue;
                ASSERT_TRUE(covered[size_t(x + kCells * (y + kCells * z))])
                    << "occupied cell without a leaf " << x << ' ' << y << ' ' << z;
            }
    for (const HardLeaf& leaf : tree.hard) {
        ASSERT_FALSE(leaf.triangles.empty());
        ASSERT_TRUE(std::is_sorted(leaf.triangles.begin(), leaf.triangles.end()));
    }
    ASSERT_LE(tree.certifiedError(), kTolerance + 1e-9);
}

/// Every triangle of a hard leaf's box is in its list.
void expectHardLeavesComplete(MeshPage& page, const PageTree& tree, std::span<const uint32_t> binned) {
    Polygon polygon;
    for (const HardLeaf& leaf : tree.hard) {
        const std::set<uint32_t> listed(leaf.triangles.begin(), leaf.triangles.end());
        const glm::dvec3 lower = leaf.box.lowerCells();
        for (uint32_t k = 0; k < binned.size(); ++k) {
            clipToBox(page.triangle(binned[k]), lower, lower + leaf.box.edgeCells(), polygon);
            ASSERT_TRUE(polygon.empty() || listed.contains(k));
        }
    }
}

/// Empty nodes of the bytes: the grown box holds no occupied cell.
void expectClearances(const PageGeometry& geometry, const PageView& view, uint32_t node, glm::ivec3 lower, int edge,
                      size_t& seen) {
    if (nodeType(node) == kNodeInternal && edge > 1) {
        for (int i = 0; i < 8; ++i)
            expectClearances(geometry, view, view.nodes[8 * uint64_t{node & kNodePayloadMask} + i],
                             lower + edge / 2 * glm::ivec3(i & 1, i >> 1 & 1, i >> 2), edge / 2, seen);
        return;
    }
    if (nodeType(node) != kNodeEmpty) return;
    ++seen;
    const double clear = nodeClearance(node);
    const glm::ivec3 low = glm::max(glm::ivec3(glm::floor(glm::dvec3(lower) - clear)), 0);
    const glm::ivec3 high = glm::min(glm::ivec3(glm::ceil(glm::dvec3(lower) + double(edge) + clear)), kCells);
    bool free = true;
    for (int z = low.z; z < high.z; ++z)
        for (int y = low.y; y < high.y; ++y)
            for (int x = low.x; x < high.x; ++x) free = free && !geometry.occupied({x, y, z});
    ASSERT_TRUE(free) << lower.x << ' ' << lower.y << ' ' << lower.z << " edge " << edge << " clearance " << clear;
    // And no idle zero: one cell more on each side would meet one, where the page is not empty.
    bool freeBeyond = true;
    for (int z = std::max(low.z - 1, 0); z < std::min(high.z + 1, kCells); ++z)
        for (int y = std::max(low.y - 1, 0); y < std::min(high.y + 1, kCells); ++y)
            for (int x = std::max(low.x - 1, 0); x < std::min(high.x + 1, kCells); ++x)
                freeBeyond = freeBeyond && !geometry.occupied({x, y, z});
    ASSERT_FALSE(freeBeyond) << "clearance " << clear << " could be larger";
}

TEST(PageBuilder, MixedMeshes) {
    size_t soft = 0, hard = 0, empty = 0;
    for (uint64_t seed = 0; seed < 6; ++seed) {
        const LatticeMesh mesh = mixedMesh(seed);
        for (uint32_t octant = 0; octant < 8; ++octant) {
            SCOPED_TRACE(testing::Message() << "seed " << seed << " page " << octant);
            const glm::u32vec3 at(octant & 1, octant >> 1 & 1, octant >> 2);
            MeshPage page(mesh, at);
            PageTree tree = buildPageTree(*page.geometry, kTolerance);
            ASSERT_NO_FATAL_FAILURE(expectSound(page, tree));
            const auto number = std::find(page.bins.pages.begin(), page.bins.pages.end(), mortonEncode(at));
            if (number == page.bins.pages.end()) continue;
            ASSERT_NO_FATAL_FAILURE(
                expectHardLeavesComplete(page, tree, page.bins.of(size_t(number - page.bins.pages.begin()))));
            soft += tree.soft.size();
            hard += tree.hard.size();

            const EncodedPage encoded = encodePage(tree, page.mesh);
            ASSERT_EQ(encoded.leaves, tree.soft.size() + tree.hard.size());
            const std::vector<std::byte> bytes = pageOf(encoded.draft);
            const auto view = parsePage(bytes);
            ASSERT_TRUE(view.ok()) << view.error().line();
            ASSERT_EQ(view->header.softLeaves, tree.soft.size());
            ASSERT_EQ(view->header.hardLeaves, tree.hard.size());
            ASSERT_GE(double(view->header.certifiedError), tree.certifiedError() + page.geometry->stray());
            if (encoded.leaves > 0)
                expectClearances(*page.geometry, *view, view->header.root, glm::ivec3(0), kCells, empty);
        }
    }
    EXPECT_GT(soft, 1000u);
    EXPECT_GT(hard, 200u);
    EXPECT_GT(empty, 1000u);
}

/// The encoded leaf at a box, by descending.
uint32_t nodeAt(const PageView& view, const NodeBox& box) {
    uint32_t node = view.header.root;
    glm::ivec3 lower(0);
    for (int edge = kCells * kSubcells; edge > box.edge; edge /= 2) {
        EXPECT_EQ(nodeType(node), kNodeInternal);
        const glm::ivec3 o = (box.lower - lower) / (edge / 2);
        node = view.nodes[8 * uint64_t{node & kNodePayloadMask} + uint64_t(o.x + 2 * o.y + 4 * o.z)];
        lower += o * (edge / 2);
    }
    return node;
}

/// A vertex of a triangle, with all that belongs to it.
using Corner = std::tuple<double, double, double, uint32_t, uint32_t>;

TEST(PageEncoder, LeavesComeBack) {
    for (uint64_t seed = 0; seed < 3; ++seed) {
        MeshPage page(mixedMesh(seed), {0, 0, 0});
        page.mesh.colours.resize(page.mesh.positions.size());
        for (size_t v = 0; v < page.mesh.colours.size(); ++v) page.mesh.colours[v] = uint32_t(v * 2654435761u);
        PageTree tree = buildPageTree(*page.geometry, kTolerance);
        const EncodedPage encoded = encodePage(tree, page.mesh);
        const std::vector<std::byte> bytes = pageOf(encoded.draft);
        const auto view = parsePage(bytes, encoded.colour);
        ASSERT_TRUE(view.ok()) << view.error().line();
        for (const SoftLeaf& leaf : tree.soft) {
            const uint32_t node = nodeAt(*view, leaf.box);
            ASSERT_EQ(nodeType(node), kNodeSoft);
            const uint32_t axis = node >> kSoftAxisShift & 3u, face = node & kLeafIndexMask;
            // The faces are the leaf's codes; a run may have turned all signs over.
            int same = 0, flipped = 0;
            for (uint32_t end = 0; end < 2; ++end)
                for (uint32_t c = 0; c < 4; ++c) {
                    const uint32_t want =
                        leaf.certificate.codes[end << axis | (c & 1) << (axis + 1) % 3 | (c >> 1) << (axis + 2) % 3];
                    same += view->faces[face + end][c] == want;
                    flipped += view->faces[face + end][c] == flipSide(want);
                }
            ASSERT_TRUE(same == 8 || flipped == 8) << same << ' ' << flipped;
            ASSERT_EQ(node >> kSoftWallShift & kSoftWallMask, leaf.wall);
        }
        for (const HardLeaf& leaf : tree.hard) {
            // The same triangles with the same fronts, whatever their order and which vertex comes first.
            std::vector<std::array<Corner, 3>> want, got;
            for (const uint32_t t : leaf.triangles) {
                std::array<Corner, 3>& corners = want.emplace_back();
                for (size_t k = 0; k < 3; ++k) {
                    const uint32_t global = page.geometry->vertices(t)[k];
                    const glm::dvec3 p = page.geometry->triangle(t).corners[k];
                    corners[k] = {p.x, p.y, p.z, page.mesh.normals[global], page.mesh.colours[global]};
                }
            }
            forEachTriangle(view->strips, nodeAt(*view, leaf.box), [&](const Index3& v) {
                std::array<Corner, 3>& corners = got.emplace_back();
                for (size_t k = 0; k < 3; ++k) {
                    const glm::dvec3 p = f64::decodeVertex(view->vertices[v[k]].x, view->vertices[v[k]].y);
                    corners[k] = {p.x, p.y, p.z, view->normals[v[k]], view->vertexColours[v[k]]};
                }
            });
            for (auto* triangles : {&want, &got}) {
                for (auto& t : *triangles) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
                std::sort(triangles->begin(), triangles->end());
            }
            ASSERT_EQ(got, want);
        }
    }
}

// What the codec derives must be what the builder found: else pages are stored plainly, several times as large.
TEST(PageBuilder, PagesAreStoredCoded) {
    IndexedMesh soup = test::randomTriangles(300, 8, true);
    const double scale = 8 / std::abs(soup.positions[0].x + 1e-3);
    for (glm::dvec3& p : soup.positions) p = glm::clamp(glm::dvec3(16) + scale * p, 2.0, 30.0);
    const std::pair<IndexedMesh, size_t> scenes[] = {{test::sphereMesh({16, 16, 16}, 11, 60), 4},
                                                     {test::sphereMesh({16, 16, 16}, 3, 90), 4},
                                                     {test::boxMesh({5, 6, 7}, {20, 21, 24}, 12), 4},
                                                     {soup, 2}};
    for (const auto& [mesh, factor] : scenes) {
        MeshPage page(test::onLattice(mesh), {0, 0, 0});
        PageTree tree = buildPageTree(*page.geometry, kTolerance);
        const EncodedPage encoded = encodePage(tree, page.mesh);
        ASSERT_GT(encoded.leaves, 100u);
        const auto stored = compressPage(encoded.draft, {});
        ASSERT_TRUE(stored.ok()) << stored.error().line();
        EXPECT_EQ(stored->geometry[0], std::byte{1}) << "coded";
        EXPECT_LT(stored->geometry.size() * factor, pageOf(encoded.draft).size());
    }
}

TEST(PageBuilder, LongTrianglesStayWithinWhatAPageCanName) {
    // Each crosses the whole page.
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(1, 31);
    IndexedMesh mesh;
    for (uint32_t k = 0; k < 300; ++k) {
        const double x = unit(random), y = unit(random);
        for (const glm::dvec3 p :
             {glm::dvec3(x, y, 1), glm::dvec3(unit(random), unit(random), 31), glm::dvec3(x + 0.01, y, 1)})
            mesh.positions.push_back(p);
        mesh.triangles.push_back({3 * k, 3 * k + 1, 3 * k + 2});
    }
    MeshPage page(test::onLattice(mesh), {0, 0, 0});
    const size_t free = buildPageTree(*page.geometry, kTolerance).records();
    for (const size_t most : {free, free - 1, free / 4, size_t{600}, size_t{301}}) {
        const PageTree tree = buildPageTree(*page.geometry, kTolerance, most);
        EXPECT_LE(tree.records(), most);
        std::vector<bool> seen(300);
        for (const HardLeaf& leaf : tree.hard)
            for (const uint32_t t : leaf.triangles) seen[t] = true;
        EXPECT_EQ(std::count(seen.begin(), seen.end(), true), 300) << most;
    }
}

TEST(PageBuilder, WorkGrowsWithTheTriangles) {
    EXPECT_LT(pageWorkBytes(0, 0), 16u << 20);
    EXPECT_GE(pageWorkBytes(1000000, 2000000), 400u * 1000000);
}

TEST(PageBuilder, EmptyPage) {
    MeshPage page(test::onLattice(test::sphereMesh({12, 12, 12}, 6, 12)), {1, 1, 1});
    PageTree tree = buildPageTree(*page.geometry, kTolerance);
    EXPECT_EQ(tree.nodes.size(), 1u);
    EXPECT_EQ(tree.nodes[0].kind, TreeNode::Kind::Empty);
    EXPECT_EQ(encodePage(tree, page.mesh).leaves, 0u);
}

TEST(PageBuilder, FlatWallCostsFewLeaves) {
    // A plane through the whole page and its surroundings; merged leaves are 8 cells wide.
    IndexedMesh mesh;
    mesh.positions = {{-20, -20, 13.3}, {90, -20, 13.3}, {90, 90, 13.3}, {-20, 90, 13.3}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    for (glm::dvec3& p : mesh.positions) p += glm::dvec3(64, 64, 64);
    MeshPage page(test::onLattice(mesh), {2, 2, 2}, 2);
    PageTree tree = buildPageTree(*page.geometry, kTolerance);
    expectSound(page, tree);
    EXPECT_EQ(tree.hard.size(), 0u);
    EXPECT_EQ(tree.soft.size(), 16u);
    for (const SoftLeaf& leaf : tree.soft) EXPECT_EQ(leaf.box.edge, kMaxSoftCells * kSubcells);
}

TEST(PageBuilder, DenseFanDoesNotExplode) {
    // Many needles that meet in one point: splitting helps nobody.
    IndexedMesh fan;
    constexpr uint32_t kNeedles = 3000;
    fan.positions.push_back({16.3, 16.4, 16.2});
    for (uint32_t i = 0; i < kNeedles; ++i) {
        const double a = test::kTwoPi * i / kNeedles;
        fan.positions.push_back(glm::dvec3(16.3, 16.4, 16.2) +
                                12.0 * glm::dvec3(std::cos(a), std::sin(a), 0.4 * std::sin(20 * a)));
    }
    for (uint32_t i = 0; i < kNeedles; ++i) fan.triangles.push_back({0, 1 + i, 1 + (i + 1) % kNeedles});
    MeshPage page(test::onLattice(fan), {0, 0, 0});
    PageTree tree = buildPageTree(*page.geometry, kTolerance);
    expectSound(page, tree);
    size_t records = 0, centre = 0;
    for (const HardLeaf& leaf : tree.hard) {
        records += leaf.triangles.size();
        centre = std::max(centre, leaf.triangles.size());
    }
    // A needle crosses about 17 cells, and 5 leaves in each where they were split; without a stop it would be 500.
    EXPECT_LT(records, 120u * kNeedles);
    EXPECT_EQ(centre, kNeedles) << "the leaf with the centre has all of them: the long form";
    const EncodedPage encoded = encodePage(tree, page.mesh);
    const std::vector<std::byte> bytes = pageOf(encoded.draft);
    const auto view = parsePage(bytes);
    ASSERT_TRUE(view.ok()) << view.error().line();
    for (const HardLeaf& leaf : tree.hard)
        EXPECT_EQ(StripWalk(view->strips, nodeAt(*view, leaf.box)).count(), leaf.triangles.size());
}

TEST(PageBuilder, CrowdedCellsAreSplit) {
    // A crumpled sheet with far more triangles than cells.
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> unit(-1, 1);
    IndexedMesh mesh = test::boxMesh(glm::dvec3(13), glm::dvec3(19), 30);
    for (glm::dvec3& p : mesh.positions) p += 0.04 * glm::dvec3(unit(random), unit(random), unit(random));
    MeshPage page(test::onLattice(mesh), {0, 0, 0}, 0);
    PageTree tree = buildPageTree(*page.geometry, 0.002);
    size_t crowded = 0, small = 0;
    for (const HardLeaf& leaf : tree.hard) {
        crowded += leaf.triangles.size() > 4 * kHardLeafTriangles;
        small += leaf.box.edge < kSubcells;
        EXPECT_GE(leaf.box.edge, 1);
    }
    EXPECT_GT(small, 0u);
    EXPECT_EQ(crowded, 0u);
}

TEST(PageBuilder, IsDeterministic) {
    const LatticeMesh mesh = mixedMesh(4);
    MeshPage a(mesh, {0, 1, 0}), b(mesh, {0, 1, 0});
    PageTree ta = buildPageTree(*a.geometry, kTolerance), tb = buildPageTree(*b.geometry, kTolerance);
    EXPECT_EQ(pageOf(encodePage(ta, a.mesh).draft), pageOf(encodePage(tb, b.mesh).draft));
}

}  // namespace
}  // namespace vcp
