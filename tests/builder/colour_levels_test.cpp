// What slabs show is the mean light of the finest surface that they stand for, whatever the level.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <random>
#include <set>
#include <vector>

#include <gtest/gtest.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include "builder/build.h"
#include "builder/stream/colour_difference.h"
#include "builder/stream/colour_encoding.h"
#include "octree/page/page_draft.h"
#include "octree/page_reader.h"
#include "octree/surface/morton.h"
#include "octree/surface/packing.h"
#include "tests/support/mesh_files.h"
#include "tests/support/test_folder.h"
#include "tests/support/test_meshes.h"

namespace vcp {
namespace {

struct Box {
    glm::dvec3 lower;
    double edge;

    [[nodiscard]] bool holds(glm::dvec3 p) const {
        for (int i = 0; i < 3; ++i)
            if (p[i] < lower[i] || p[i] >= lower[i] + edge) return false;
        return true;
    }
};

/// A small part of the finest surface, in the middle of which it has this light.
struct Part {
    glm::dvec3 at;  ///< in finest cells
    double area;
    glm::dvec4 light;  ///< linear RGB, alpha
};

/// A slab leaf and where it is, in finest cells.
struct PlacedSlab {
    Box box;
    uint32_t level;
    uint32_t colour;
    uint64_t page = 0;
};

/// What there is to see in a file: the triangles of the finest level in small parts, and all slabs.
class Shown {
public:
    Shown(const std::filesystem::path& path, int partsACell) : partsACell_(partsACell) {
        const auto file = openFile(path);
        const auto data = readDataset(**file);
        EXPECT_TRUE(data.ok());
        if (!data.ok()) return;
        data_ = *data;
        for (uint64_t i = 0; i < data_.header.pages; ++i) {
            const auto bytes = readPage(**file, data_, i, true);
            EXPECT_TRUE(bytes.ok());
            if (!bytes.ok()) return;
            const auto view = parsePage(bytes->geometryBytes(), bytes->colourBytes());
            EXPECT_TRUE(view.ok());
            const PageEntry& entry = data_.pages[i];
            const double cell = std::ldexp(1.0, int(data_.header.levels - 1 - entry.level));
            const double edge = cell * double(1u << view->header.log2Cells);
            const Box box{glm::dvec3(mortonDecode(entry.morton)) * edge, edge};
            if (entry.childMask == 0) {
                addTriangles(*view, box, cell);
            } else {
                const size_t first = slabs.size();
                addSlabs(*view, view->header.root, box, entry.level);
                for (size_t k = first; k < slabs.size(); ++k) slabs[k].page = i;
            }
        }
    }

    /// Returns the numbers of the parts in each slab's box.
    [[nodiscard]] std::vector<std::vector<size_t>> partsInSlabs() const {
        const auto keyOf = [](glm::dvec3 lower, double edge) {
            return std::array{lower.x / edge, lower.y / edge, lower.z / edge, edge};
        };
        std::map<std::array<double, 4>, size_t> slabAt;
        std::set<double> edges;
        for (size_t i = 0; i < slabs.size(); ++i) {
            slabAt[keyOf(slabs[i].box.lower, slabs[i].box.edge)] = i;
            edges.insert(slabs[i].box.edge);
        }
        std::vector<std::vector<size_t>> in(slabs.size());
        for (size_t i = 0; i < parts.size(); ++i)
            for (const double edge : edges) {
                const auto at = slabAt.find(keyOf(glm::floor(parts[i].at / edge) * edge, edge));
                if (at != slabAt.end()) in[at->second].push_back(i);
            }
        return in;
    }

    [[nodiscard]] const Dataset& data() const { return data_; }

    std::vector<Part> parts;
    std::vector<PlacedSlab> slabs;

private:
    /// Pages hold all triangles that touch them: of each, what lies in the page counts.
    void addTriangles(const PageView& view, const Box& page, double cell) {
        for (const Index3& t : draftOf(view).triangles) {
            std::array<glm::dvec3, 3> p;
            std::array<glm::dvec4, 3> c;
            for (size_t i = 0; i < 3; ++i) {
                const glm::dvec3 local = glm::dvec3(unpack21(view.vertices[t[i]])) - double(kLatticeBias);
                p[i] = page.lower + local * (cell / kLatticePerCell);
                for (int k = 0; k < 4; ++k) c[i][k] = double(view.vertexColours[t[i]] >> 8 * k & 255u) / 255;
            }
            const double longest =
                std::max({glm::distance(p[0], p[1]), glm::distance(p[1], p[2]), glm::distance(p[2], p[0])});
            const int n = std::max(4, int(std::ceil(longest * partsACell_)));
            const double area = glm::length(glm::cross(p[1] - p[0], p[2] - p[0])) / 2 / n / n;
            for (int a = 0; a < n; ++a)
                for (int b = 0; a + b < n; ++b)
                    for (int turned = 0; turned < (a + b + 1 < n ? 2 : 1); ++turned) {
                        const double u = (a + (turned != 0 ? 2.0 : 1.0) / 3) / n,
                                     v = (b + (turned != 0 ? 2.0 : 1.0) / 3) / n;
                        const glm::dvec3 at = p[0] + u * (p[1] - p[0]) + v * (p[2] - p[0]);
                        if (!page.holds(at)) continue;
                        const glm::dvec4 stored = c[0] + u * (c[1] - c[0]) + v * (c[2] - c[0]);
                        parts.push_back(
                            {at,
                             area,
                             {srgbToLinear(stored.r), srgbToLinear(stored.g), srgbToLinear(stored.b), stored.a}});
                    }
        }
    }

    void addSlabs(const PageView& view, uint32_t node, const Box& box, uint32_t level) {
        if (nodeType(node) == kNodeSlab) slabs.push_back({box, level, vectorWord(view.faceColours, slabVector(node))});
        if (nodeType(node) != kNodeInternal) return;
        for (uint32_t o = 0; o < 8; ++o)
            addSlabs(view, view.nodes[8 * uint64_t{node & kNodePayloadMask} + o],
                     {box.lower + box.edge / 2 * glm::dvec3(o & 1, o >> 1 & 1, o >> 2), box.edge / 2}, level);
    }

    int partsACell_;
    Dataset data_;
};

/// A mesh with a colour at each vertex.
struct PaintedMesh {
    IndexedMesh mesh;
    std::vector<uint32_t> colours;
};

/// Squares of black and white in turn that share no vertices, so that each keeps its colour to its border.
PaintedMesh checkerboard(int squares, double edge) {
    PaintedMesh made;
    for (int y = 0; y < squares; ++y)
        for (int x = 0; x < squares; ++x) {
            const auto first = uint32_t(made.mesh.positions.size());
            for (int i = 0; i < 4; ++i) {
                made.mesh.positions.push_back(edge * glm::dvec3(x + (i & 1) * 0.999, y + (i >> 1) * 0.999, 0));
                made.colours.push_back((x + y) % 2 == 0 ? 0xff000000u : 0xffffffffu);
            }
            made.mesh.triangles.push_back({first, first + 1, first + 3});
            made.mesh.triangles.push_back({first, first + 3, first + 2});
        }
    return made;
}

class ColourLevels : public ::testing::Test {
protected:
    void build(const PaintedMesh& painted, double cell, const std::string& name = "out.vcp") {
        test::writePly(painted.mesh, folder_ / "mesh.ply", painted.colours);
        BuildOptions o;
        o.inputs = {folder_ / "mesh.ply"};
        o.output = folder_ / name;
        o.threads = 2;
        o.cell = cell;
        const auto built = buildOctree(o);
        ASSERT_TRUE(built.ok()) << built.error().line();
    }

    /// Compares each slab that has enough of the finest surface with its mean light. Returns those.
    static std::vector<PlacedSlab> compare(const Shown& shown) {
        std::vector<PlacedSlab> compared;
        const auto inSlabs = shown.partsInSlabs();
        for (size_t i = 0; i < shown.slabs.size(); ++i) {
            const PlacedSlab& slab = shown.slabs[i];
            glm::dvec4 sum(0);
            double area = 0;
            for (const size_t part : inSlabs[i]) {
                sum += shown.parts[part].area * shown.parts[part].light;
                area += shown.parts[part].area;
            }
            if (area < 0.5 * slab.box.edge * slab.box.edge) continue;
            compared.push_back(slab);
            for (int k = 0; k < 4; ++k) {
                const double stored = double(slab.colour >> 8 * k & 255u) / 255;
                EXPECT_NEAR(k < 3 ? srgbToLinear(stored) : stored, sum[k] / area, 0.03)
                    << "level " << slab.level << ", " << k;
            }
        }
        return compared;
    }

    struct Difference {
        double deltaE, area;
    };
    /// Returns how far a slab's colour is from the mean light in its eighths, and the area in it.
    static Difference differenceOf(const Shown& shown, const PlacedSlab& slab, const std::vector<size_t>& parts) {
        std::map<std::array<double, 3>, std::pair<glm::dvec3, double>> eighths;
        for (const size_t number : parts) {
            const Part& part = shown.parts[number];
            const glm::dvec3 at = glm::floor(part.at / (slab.box.edge / 2));
            auto& [light, area] = eighths[{at.x, at.y, at.z}];
            light += part.area * glm::dvec3(part.light);
            area += part.area;
        }
        glm::dvec3 light;
        for (int k = 0; k < 3; ++k) light[k] = srgbToLinear(double(slab.colour >> 8 * k & 255u) / 255);
        double squares = 0, all = 0;
        for (const auto& [at, sum] : eighths) {
            squares += sum.second * std::pow(colourDifference(sum.first / sum.second, light), 2);
            all += sum.second;
        }
        return {all > 0 ? std::sqrt(squares / all) : 0, all};
    }

    /// Compares the colour errors of pages with what follows from the finest surface in their slabs. Returns how many
    /// pages it compared.
    static int compareErrors(const Shown& shown) {
        std::map<uint64_t, std::vector<Difference>> byPage;
        const auto inSlabs = shown.partsInSlabs();
        for (size_t i = 0; i < shown.slabs.size(); ++i) {
            const Difference difference = differenceOf(shown, shown.slabs[i], inSlabs[i]);
            if (difference.area > 0) byPage[shown.slabs[i].page].push_back(difference);
        }
        int compared = 0;
        for (auto& [page, slabs] : byPage) {
            if (slabs.size() < 30) continue;
            ++compared;
            std::ranges::sort(slabs, {}, &Difference::deltaE);
            double all = 0, above = 0, p90 = 0, p99 = 0, whole = 0;
            for (const Difference& each : slabs) all += each.area;
            for (auto each = slabs.rbegin(); each != slabs.rend(); ++each) {
                above += each->area;
                if (p99 == 0 && above > 0.01 * all) p99 = each->deltaE;
                if (p90 == 0 && above > 0.1 * all) p90 = each->deltaE;
                if (each->area > 0.5 / double(slabs.size()) * all) whole = std::max(whole, each->deltaE);
            }
            const PageEntry& entry = shown.data().pages[page];
            EXPECT_GE(colourErrorOf(entry.colourErrorP95), 0.9 * p90 - 0.5) << page;
            EXPECT_LE(colourErrorOf(entry.colourErrorP95), 1.1 * p99 + 1) << page;
            EXPECT_GE(colourErrorOf(entry.colourErrorMax), 0.7 * whole - 0.5) << page;
            EXPECT_GE(entry.colourErrorMax, entry.colourErrorP95) << page;
        }
        return compared;
    }

    /// Returns how many levels have at least 20 of the slabs.
    static size_t levelsOf(const std::vector<PlacedSlab>& slabs) {
        std::map<uint32_t, int> count;
        for (const PlacedSlab& slab : slabs) ++count[slab.level];
        return size_t(std::ranges::count_if(count, [](const auto& level) { return level.second >= 20; }));
    }

    TestFolder folder_{"vcp_colour_levels_test"};
};

TEST_F(ColourLevels, ACheckerboardKeepsItsLight) {
    PaintedMesh board = checkerboard(160, 1);
    test::rotate(board.mesh, {0, 0, 0}, glm::normalize(glm::dvec3(3, 2, 1)), 0.4);
    build(board, 0.8);
    const Shown shown(folder_ / "out.vcp", 10);
    const auto compared = compare(shown);
    EXPECT_GE(levelsOf(compared), 3u);
    // Cells that hold many squares have half of the light left. Half of the stored values would be 0.21 of it.
    int mixed = 0;
    for (const PlacedSlab& slab : compared) {
        if (slab.box.edge < 4) continue;
        ++mixed;
        EXPECT_NEAR(srgbToLinear(double(slab.colour & 255u) / 255), 0.5, 0.1);
    }
    EXPECT_GT(mixed, 20);
    EXPECT_GE(compareErrors(shown), 5);
    EXPECT_EQ(shown.data().header.version, kFineSlabsFileVersion);
    EXPECT_TRUE(shown.data().hasColourErrors());
    // Where halves of cells are as large as squares, slabs are far off; where they hold many, grey is what there is.
    const FileHeader& header = shown.data().header;
    EXPECT_GT(colourErrorOf(shown.data().pages[header.level[header.levels - 2].firstEntry].colourErrorP95), 30);
    EXPECT_LT(colourErrorOf(shown.data().pages[0].colourErrorP95), 20);
}

TEST_F(ColourLevels, SurfacesOfAnyColourKeepTheirLight) {
    std::mt19937 random(5);
    for (const uint32_t rings : {12u, 60u}) {  // triangles of several cells, and some of half a cell
        SCOPED_TRACE(rings);
        PaintedMesh ball{test::sphereMesh({0, 0, 0}, 10, rings), {}};
        for (size_t v = 0; v < ball.mesh.positions.size(); ++v) ball.colours.push_back(uint32_t(random()));
        build(ball, 0.12);
        const Shown shown(folder_ / "out.vcp", 6);
        EXPECT_GE(levelsOf(compare(shown)), 3u);
        EXPECT_GE(compareErrors(shown), 3);
    }
}

TEST_F(ColourLevels, OneColourIsNowhereOff) {
    PaintedMesh ball{test::sphereMesh({0, 0, 0}, 10, 40), {}};
    ball.colours.assign(ball.mesh.positions.size(), 0xff20a0c0u);
    build(ball, 0.3);
    const Shown shown(folder_ / "out.vcp", 6);
    EXPECT_GT(shown.slabs.size(), 100u);
    // But for the rounding of single precision.
    for (const PageEntry& page : shown.data().pages) EXPECT_LE(colourErrorOf(page.colourErrorMax), 0.01);
}

}  // namespace
}  // namespace vcp
