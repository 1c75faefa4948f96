// What is known of the surface in cells holds for every point of it, however coarse the cells, and so do the slabs.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <random>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "builder/measure/mesh_bvh.h"
#include "builder/slab/slab_error.h"
#include "builder/slab/slab_tree.h"
#include "octree/surface/leaf_math.h"
#include "octree/surface/morton.h"
#include "tests/support/lattice_meshes.h"
#include "tests/support/test_meshes.h"

namespace vcp {
namespace {

constexpr uint32_t kSlabLog2Cells = 4;
constexpr double kEdge = 1 << kSlabLog2Cells;

/// A mesh over the eight pages below one, in cells of the finer level.
struct SlabScene {
    const char* name;
    LatticeMesh mesh;
};

std::vector<SlabScene> scenes() {
    std::vector<SlabScene> all;
    all.push_back({"sphere", test::onLattice(test::sphereMesh(glm::dvec3(kEdge * 1.02), kEdge * 0.7, 24))});
    IndexedMesh soup = test::randomTriangles(300, 5, true);
    for (glm::dvec3& p : soup.positions) p = (0.9 * p + 0.05) * 2.0 * kEdge;
    all.push_back({"soup", test::onLattice(soup)});
    IndexedMesh plate = test::boxMesh(glm::dvec3(3, 4, 9.7), glm::dvec3(29, 27, 10.1), 3);
    test::rotate(plate, glm::dvec3(kEdge), glm::normalize(glm::dvec3(1, 2, 3)), 0.4);
    all.push_back({"thin plate", test::onLattice(plate)});
    // All of its sides lie in walls of cells, two of them in walls of pages.
    all.push_back({"box in walls", test::onLattice(test::boxMesh(glm::dvec3(4), glm::dvec3(kEdge, 12, kEdge), 2))});
    return all;
}

std::vector<uint32_t> allOf(const LatticeMesh& mesh) {
    std::vector<uint32_t> numbers(mesh.triangles.size());
    std::iota(numbers.begin(), numbers.end(), 0u);
    return numbers;
}

/// Returns a point of a triangle, in cells.
glm::dvec3 pointOf(const LatticeMesh& mesh, size_t triangle, std::mt19937& random) {
    std::uniform_real_distribution<double> unit(0, 1);
    double u = unit(random), v = unit(random);
    if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
    }
    const auto& t = mesh.triangles[triangle];
    const glm::dvec3 a(mesh.positions[t[0]]), b(mesh.positions[t[1]]), c(mesh.positions[t[2]]);
    return (a + u * (b - a) + v * (c - a)) / double(kLatticePerCell);
}

bool holds(const CellSurface& cell, glm::dvec3 x, double slack) {
    for (int i = 0; i < 3; ++i)
        if (x[i] < double(cell.lower[i]) - slack || x[i] > double(cell.upper[i]) + slack) return false;
    const double along = glm::dot(glm::dvec3(cell.axis), x);
    return along >= double(cell.first) - slack && along <= double(cell.last) + slack;
}

/// Whether a cell with surface that has point `p` (page space, in the list's cells) holds it.
bool holds(const SurfaceCells& list, glm::dvec3 p) {
    for (size_t i = 0; i < list.size(); ++i) {
        const glm::dvec3 centre = glm::dvec3(mortonDecode(list.codes[i])) + 0.5;
        const glm::dvec3 x = p - centre;
        if (std::max({std::abs(x.x), std::abs(x.y), std::abs(x.z)}) <= 0.5 + 1e-9 && holds(list.cells[i], x, 2e-6))
            return true;
    }
    return false;
}

/// Whether a slab leaf of a page holds the point, in its slab and in an octant that is named.
bool holds(const PageTree& tree, glm::dvec3 p) {
    for (const SlabLeaf& leaf : tree.slabs) {
        const glm::dvec3 x = (p - leaf.box.centreCells()) / leaf.box.edgeCells();
        if (std::max({std::abs(x.x), std::abs(x.y), std::abs(x.z)}) > 0.5 + 1e-9) continue;
        const glm::dvec3 n = f64::decodeDirection(leaf.code >> kSlabDirectionShift);
        if (std::abs(glm::dot(n, x) - f64::slabOffset(leaf.code)) > f64::slabHalfThickness(leaf.code)) continue;
        for (uint32_t o = 0; o < 8; ++o) {
            const glm::dvec3 from = x - octantCentre(o);
            if ((leaf.octants >> o & 1) != 0 &&
                std::max({std::abs(from.x), std::abs(from.y), std::abs(from.z)}) <= 0.25 + 1e-5)
                return true;
        }
    }
    return false;
}

/// Whether a quarter of a cell that has point `p` (page space, in quarters) holds it.
bool holds(const SurfaceQuarters& list, glm::dvec3 p) {
    for (size_t i = 0; i < list.size(); ++i) {
        const glm::dvec3 x = p - glm::dvec3(mortonDecode(list.codes[i])) - 0.5;
        bool isIn = std::max({std::abs(x.x), std::abs(x.y), std::abs(x.z)}) <= 0.5 + 1e-9;
        for (int k = 0; k < 3; ++k)
            isIn = isIn && x[k] + 0.5 >= list.boxes[i].lower[k] / 255.0 - 1e-9 &&
                   x[k] + 0.5 <= list.boxes[i].upper[k] / 255.0 + 1e-9;
        if (isIn) return true;
    }
    return false;
}

struct FoldedPages {
    std::vector<PageSurface> finest;  ///< of the eight, in octant order, empty ones left out
    std::vector<uint32_t> octants;
    PageSurface above;
    /// The octrees of the page above them, and of that above it, whose lowest octant it is.
    PageTree tree, coarser;
};

SurfaceBelow handedUp(const PageSurface& surface) { return {surface.halves, slabsOf(surface)}; }

FoldedPages pagesOf(const LatticeMesh& mesh) {
    FoldedPages pages;
    const std::vector<uint32_t> numbers = allOf(mesh);
    PageFold fold(kSlabLog2Cells, 0, 0), coarser(kSlabLog2Cells, 0, 0);
    for (uint32_t o = 0; o < 8; ++o) {
        PageSurface surface = surfaceOf(mesh, numbers, mortonDecode(o), kSlabLog2Cells);
        if (surface.halves.size() == 0) continue;
        fold.add(handedUp(surface), o);
        pages.finest.push_back(std::move(surface));
        pages.octants.push_back(o);
    }
    pages.above = foldSurface(fold.quarters, false);
    coarser.add(handedUp(pages.above), 0);
    pages.tree = slabTree(fold.slabs, kSlabLog2Cells);
    pages.coarser = slabTree(coarser.slabs, kSlabLog2Cells);
    return pages;
}

TEST(Slabs, HoldEveryPointOfTheSurface) {
    for (const auto& [name, mesh] : scenes()) {
        SCOPED_TRACE(name);
        const FoldedPages pages = pagesOf(mesh);
        std::mt19937 random(7);
        for (int i = 0; i < 3000; ++i) {
            const glm::dvec3 p = pointOf(mesh, random() % mesh.triangles.size(), random);
            const glm::dvec3 page = glm::min(glm::floor(p / kEdge), 1.0);
            const auto octant = uint32_t(page.x + 2 * page.y + 4 * page.z);
            const auto at = std::find(pages.octants.begin(), pages.octants.end(), octant);
            ASSERT_NE(at, pages.octants.end());
            const PageSurface& surface = pages.finest[size_t(at - pages.octants.begin())];
            ASSERT_TRUE(holds(surface.quarters, (p - page * kEdge) * 4.0));
            ASSERT_TRUE(holds(surface.halves, (p - page * kEdge) * 2.0));
            ASSERT_TRUE(holds(surface.cells, p - page * kEdge));
            ASSERT_TRUE(holds(pages.above.quarters, p * 2.0));
            ASSERT_TRUE(holds(pages.above.cells, p / 2.0));
            ASSERT_TRUE(holds(pages.tree, p / 2.0));
            ASSERT_TRUE(holds(pages.coarser, p / 4.0));
        }
    }
}

TEST(Slabs, CellsHaveTheAreaOfTheMesh) {
    for (const auto& [name, mesh] : scenes()) {
        if (std::string_view(name) == "box in walls") continue;  // what lies in a wall counts on both sides of it
        SCOPED_TRACE(name);
        double expected = 0;
        for (const auto& t : mesh.triangles) {
            const glm::dvec3 a(mesh.positions[t[0]]), b(mesh.positions[t[1]]), c(mesh.positions[t[2]]);
            expected += glm::length(glm::cross(b - a, c - a)) / 2 / kLatticePerCell / kLatticePerCell;
        }
        const FoldedPages pages = pagesOf(mesh);
        double finest = 0, above = 0;
        for (const PageSurface& surface : pages.finest)
            for (const CellSurface& cell : surface.halves.cells) finest += double(cell.area) / 4;
        for (const CellSurface& cell : pages.above.cells.cells) above += 4 * double(cell.area);
        EXPECT_NEAR(finest, expected, 1e-5 * expected);
        EXPECT_NEAR(above, expected, 1e-5 * expected);
    }
}

/// Returns a random point of what is drawn of a leaf, page space, or nothing where the one tried is not drawn.
std::optional<glm::dvec3> drawnPoint(const SlabLeaf& leaf, std::mt19937& random) {
    std::uniform_real_distribution<double> unit(-0.5, 0.5);
    const glm::dvec3 n = f64::decodeDirection(leaf.code >> kSlabDirectionShift);
    glm::dvec3 x(unit(random), unit(random), unit(random));
    const double middle = f64::slabOffset(leaf.code), half = f64::slabHalfThickness(leaf.code);
    x += (middle + 2 * half * unit(random) - glm::dot(n, x)) * n;
    if (std::max({std::abs(x.x), std::abs(x.y), std::abs(x.z)}) > 0.5) return std::nullopt;
    const uint32_t octant = (x.x > 0 ? 1u : 0u) | (x.y > 0 ? 2u : 0u) | (x.z > 0 ? 4u : 0u);
    if ((leaf.octants >> octant & 1) == 0) return std::nullopt;
    return leaf.box.centreCells() + leaf.box.edgeCells() * x;
}

/// Compares what is drawn of a page of slabs with the mesh, in the page's cells. Returns how many leaves are cells of
/// the level below.
int expectWithinCertified(const PageTree& tree, const IndexedMesh& inCells) {
    EXPECT_LE(tree.certifiedError(), std::max(kMostSlabError, kAnySlabError / 2) / 2);
    EXPECT_TRUE(tree.hard.empty() && tree.soft.empty());
    const MeshBvh bvh(inCells);
    std::mt19937 random(3);
    int drawn = 0, whole = 0;
    double most = 0;
    for (const SlabLeaf& leaf : tree.slabs) {
        whole += leaf.box.edge == kSubcells / 2;
        for (int i = 0; i < 20; ++i) {
            const auto p = drawnPoint(leaf, random);
            if (!p) continue;
            const double distance = bvh.nearestPoint(*p)->distance;
            EXPECT_LE(distance, leaf.error * leaf.box.edgeCells() + 1e-9);
            most = std::max(most, distance);
            ++drawn;
        }
    }
    EXPECT_GT(drawn, 1000);
    EXPECT_GT(most, tree.certifiedError() / 8) << "the bound says nothing";
    return whole;
}

TEST(Slabs, WhatIsDrawnIsWithinTheCertifiedErrorOfTheMesh) {
    for (const auto& [name, mesh] : scenes()) {
        SCOPED_TRACE(name);
        const FoldedPages pages = pagesOf(mesh);
        const int whole = expectWithinCertified(pages.tree, test::inCells(mesh, 0.5));
        EXPECT_GT(whole, std::string_view(name) == "sphere" ? 1000 : -1) << "flat enough for whole cells";
        expectWithinCertified(pages.coarser, test::inCells(mesh, 0.25));
    }
}

TEST(Slabs, AFlatSurfaceHasThinSlabsAlongItsNormal) {
    const glm::dvec3 normal = glm::normalize(glm::dvec3(1, -2, 4));
    const glm::dvec3 u = glm::normalize(glm::cross(normal, glm::dvec3(1, 0, 0))), v = glm::cross(normal, u);
    IndexedMesh mesh;
    for (int i = 0; i < 4; ++i)
        mesh.positions.push_back(glm::dvec3(kEdge) + 12.0 * ((i & 1) != 0 ? u : -u) + 12.0 * ((i & 2) != 0 ? v : -v));
    mesh.triangles = {{0, 1, 2}, {1, 3, 2}};
    const PageTree tree = pagesOf(test::onLattice(mesh)).tree;
    ASSERT_GT(tree.slabs.size(), 100u);
    for (const SlabLeaf& leaf : tree.slabs) {
        EXPECT_GT(std::abs(glm::dot(f64::decodeDirection(leaf.code >> kSlabDirectionShift), normal)), std::cos(0.01));
        EXPECT_LT(f64::slabHalfThickness(leaf.code), 0.03) << "half of the thickness, in leaf edges";
    }
}

TEST(Slabs, ExtentsAreThoseOfTheBoxCutByTheSlab) {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> unit(-0.5, 0.5);
    const auto direction = [&] {
        glm::dvec3 d(0);
        while (glm::length(d) < 0.1) d = {unit(random), unit(random), unit(random)};
        return glm::normalize(d);
    };
    for (int round = 0; round < 200; ++round) {
        CellSurface cell;
        for (int i = 0; i < 3; ++i) {
            const double a = unit(random), b = unit(random);
            cell.lower[i] = float(std::min(a, b));
            cell.upper[i] = float(std::max(a, b));
        }
        cell.axis = glm::vec3(direction());
        const double middle = glm::dot(glm::dvec3(cell.axis), (glm::dvec3(cell.lower) + glm::dvec3(cell.upper)) / 2.0);
        cell.first = float(middle - 0.05);
        cell.last = float(middle + 0.05);
        const glm::dvec3 n = direction();
        const Extent extent = extentAlong(cell, n);
        double first = 1e9, last = -1e9;
        for (int i = 0; i < 20000; ++i) {
            // Points in the corners and edges of what the box and the slab share are the ones that count.
            glm::dvec3 x;
            for (int k = 0; k < 3; ++k) {
                const double t = std::clamp(1.5 * unit(random) + 0.5, 0.0, 1.0);
                x[k] = double(cell.lower[k]) + t * (double(cell.upper[k]) - double(cell.lower[k]));
            }
            const double along = glm::dot(glm::dvec3(cell.axis), x);
            if (along < double(cell.first) || along > double(cell.last)) continue;
            first = std::min(first, glm::dot(n, x));
            last = std::max(last, glm::dot(n, x));
        }
        EXPECT_GE(first, extent.first - 1e-6);
        EXPECT_LE(last, extent.last + 1e-6);
        EXPECT_LT(extent.last - extent.first, last - first + 0.12) << "the bound is far from what there is";
    }
}

TEST(Slabs, APageCutPartByPartIsTheSame) {
    for (const SlabScene& scene : scenes()) {
        SCOPED_TRACE(scene.name);
        for (uint32_t octant = 0; octant < 8; ++octant) {
            const glm::u32vec3 page(octant & 1, octant >> 1 & 1, octant >> 2);
            const PageSurface surface = surfaceOf(scene.mesh, allOf(scene.mesh), page, kSlabLog2Cells);
            EXPECT_GE(halvesTouched(scene.mesh, allOf(scene.mesh), page, kSlabLog2Cells), surface.halves.size());
            const StoredPage whole = storedSurface(handedUp(surface), false);
            for (const size_t pieces : {size_t{0}, size_t{20}}) {
                const StoredPage parts = storedSurface(
                    handedUp(surfaceOf(scene.mesh, allOf(scene.mesh), page, kSlabLog2Cells, pieces)), false);
                ASSERT_EQ(whole.geometry, parts.geometry) << octant << ", " << pieces << " pieces";
                ASSERT_EQ(whole.colour, parts.colour) << octant << ", " << pieces << " pieces";
            }
        }
    }
}

TEST(Slabs, SurfacesComeBackFromTheirBytes) {
    IndexedMesh mesh = test::sphereMesh(glm::dvec3(kEdge / 2), kEdge * 0.45, 24);
    const LatticeMesh onLattice = test::onLattice(mesh);
    const SurfaceBelow surface = handedUp(surfaceOf(onLattice, allOf(onLattice), {0, 0, 0}, kSlabLog2Cells));
    const SurfaceCells& halves = surface.halves;
    const StoredPage plain = storedSurface(surface, false), coded = storedSurface(surface, true);
    EXPECT_LT(coded.geometry.size(), plain.geometry.size() * 2 / 3);
    EXPECT_LT(coded.colour.size(), plain.colour.size());
    for (const StoredPage& stored : {plain, coded}) {
        EXPECT_EQ(storedCells(stored.geometryBytes), halves.size());
        EXPECT_EQ(storedSlabs(stored.colourBytes), surface.slabs.size());
        const auto again = surfaceFrom(stored);
        ASSERT_TRUE(again);
        EXPECT_EQ(again->halves.codes, halves.codes);
        EXPECT_EQ(storedSurface(*again, false).geometry, plain.geometry);
        EXPECT_EQ(storedSurface(*again, false).colour, plain.colour);
        for (size_t i = 0; i < halves.size(); ++i) ASSERT_EQ(again->halves.cells[i].axis, halves.cells[i].axis);
        StoredPage cut = stored;
        cut.geometry.pop_back();
        EXPECT_FALSE(surfaceFrom(cut));
        cut = stored;
        cut.colour.pop_back();
        EXPECT_FALSE(surfaceFrom(cut));
    }
    EXPECT_EQ(storedSurface({}, true).geometry.size(), 0u);
}

}  // namespace
}  // namespace vcp
