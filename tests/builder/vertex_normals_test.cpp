// Files' own vertex normals, from the file to what is stored: against shapes whose normals are known everywhere, with
// hard edges, and the same bytes however they are built.
#include <cmath>
#include <fstream>
#include <functional>
#include <random>
#include <set>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "builder/build.h"
#include "builder/estimate.h"
#include "octree/reference_caster.h"
#include "octree/surface/leaf_math.h"
#include "octree/surface/leaf_triangles.h"
#include "octree/surface/packing.h"
#include "octree/vcp_verify.h"
#include "tests/support/build_in_parts.h"
#include "tests/support/mesh_files.h"
#include "tests/support/test_folder.h"
#include "tests/support/test_meshes.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;
using Normal = std::function<glm::dvec3(glm::dvec3)>;

/// Writes a PLY with the normal of each vertex; without one, where there is no function.
void writePlyWithNormals(const IndexedMesh& mesh, const fs::path& path, const Normal& normalAt,
                         bool backwards = false) {
    std::ofstream file(path);
    file << "ply\nformat ascii 1.0\nelement vertex " << mesh.positions.size()
         << "\nproperty float x\nproperty float y\nproperty float z\n";
    if (normalAt) file << "property float nx\nproperty float ny\nproperty float nz\n";
    file << "element face " << mesh.triangles.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
    for (const glm::dvec3& p : mesh.positions) {
        file << fmt::format("{} {} {}", float(p.x), float(p.y), float(p.z));
        if (!normalAt) {
            file << '\n';
            continue;
        }
        const glm::dvec3 n = normalAt(p);
        file << fmt::format(" {} {} {}\n", float(n.x), float(n.y), float(n.z));
    }
    for (size_t k = 0; k < mesh.triangles.size(); ++k) {
        const auto& [a, b, c] = mesh.triangles[backwards ? mesh.triangles.size() - 1 - k : k];
        file << fmt::format("3 {} {} {}\n", a, b, c);
    }
}

/// A closed drum about the z axis, radius and half height 1: normals by corner, with hard edges, as models have them.
void writeDrum(const fs::path& path, int sides) {
    std::ofstream file(path);
    const auto at = [&](int i) { return test::kTwoPi * (i % sides) / sides; };
    for (int i = 0; i < sides; ++i)
        for (const int z : {-1, 1}) file << fmt::format("v {:.9f} {:.9f} {}\n", std::cos(at(i)), std::sin(at(i)), z);
    file << "v 0 0 -1\nv 0 0 1\n";
    for (int i = 0; i < sides; ++i) file << fmt::format("vn {:.9f} {:.9f} 0\n", std::cos(at(i)), std::sin(at(i)));
    file << "vn 0 0 -1\nvn 0 0 1\n";
    for (int i = 0; i < sides; ++i) {
        const int j = (i + 1) % sides, a = 2 * i + 1, b = 2 * j + 1, low = 2 * sides + 1;
        file << fmt::format("f {}//{} {}//{} {}//{} {}//{}\n", a, i + 1, b, j + 1, b + 1, j + 1, a + 1, i + 1);
        file << fmt::format("f {0}//{3} {1}//{3} {2}//{3}\n", low, b, a, sides + 1);
        file << fmt::format("f {0}//{3} {1}//{3} {2}//{3}\n", low + 1, a + 1, b + 1, sides + 2);
    }
}

class VertexNormalsBuild : public ::testing::Test {
protected:
    [[nodiscard]] BuildOptions options(const fs::path& input, VertexNormals normals = VertexNormals::Mesh) const {
        BuildOptions o;
        o.inputs = {input};
        o.output = output();
        o.threads = 2;
        o.overwrite = true;
        o.vertexNormals = normals;
        return o;
    }
    [[nodiscard]] fs::path output() const { return folder_ / "mesh.vcp"; }
    std::string built(const BuildOptions& options) const {
        const auto report = buildOctree(options);
        EXPECT_TRUE(report.ok()) << report.error().line();
        return report ? contentOf(output()) : std::string();
    }

    /// Calls visit(corners in the world, normals that they are lit with) for every triangle of the finest level, as
    /// often as it is in pages.
    template <class Visit>
    void forTriangles(Visit&& visit) const {
        const auto file = openFile(output());
        ASSERT_TRUE(verifyFile(**file).ok()) << verifyFile(**file).error().line();
        auto cache = PageCache::open(output());
        ASSERT_TRUE(cache.ok() && cache->loadAll().ok());
        const Dataset& dataset = cache->dataset();
        for (uint64_t page = 0; page < dataset.header.pages; ++page) {
            const PageEntry& entry = dataset.pages[page];
            const PageView& view = *cache->view(page);
            const auto ofNode = [&](uint32_t word) {
                if (nodeType(word) != kNodeHard) return;
                forEachTriangle(view.strips, word, [&](const Index3& t) {
                    glm::dvec3 p[3], n[3];
                    for (size_t i = 0; i < 3; ++i)
                        p[i] =
                            dataset.originOf(entry) + f64::decodeVertex(view.vertices[t[i]].x, view.vertices[t[i]].y) *
                                                          dataset.cellOf(entry.level);
                    const glm::dvec3 flat = glm::normalize(glm::cross(p[1] - p[0], p[2] - p[0]));
                    for (size_t i = 0; i < 3; ++i) n[i] = f64::cornerNormal(view.normals[t[i]], flat);
                    visit(p, n);
                });
            };
            ofNode(view.header.root);
            for (const uint32_t word : view.nodes) ofNode(word);
        }
    }

    /// Returns the mean and the largest angle, in degrees, between the finest level's normals and known ones.
    struct Angles {
        double mean = 0, most = 0;
        uint64_t corners = 0;
    };
    template <class Wanted>
    [[nodiscard]] Angles anglesTo(const Wanted& wanted) const {
        Angles angles;
        forTriangles([&](const glm::dvec3(&p)[3], const glm::dvec3(&n)[3]) {
            for (int i = 0; i < 3; ++i) {
                const double along = std::abs(glm::dot(n[i], glm::normalize(wanted(p, i))));
                const double angle = glm::degrees(std::acos(std::min(along, 1.0)));
                angles.mean += angle;
                angles.most = std::max(angles.most, angle);
                ++angles.corners;
            }
        });
        angles.mean /= double(std::max<uint64_t>(angles.corners, 1));
        return angles;
    }

    TestFolder folder_{"vcp_vertex_normals"};
};

/// An ellipsoid's normal.
glm::dvec3 ellipsoidNormal(glm::dvec3 p) { return glm::normalize(p / glm::dvec3(1, 4, 9)); }

IndexedMesh ellipsoid(uint32_t rings) {
    IndexedMesh mesh = test::sphereMesh({0, 0, 0}, 1, rings);
    for (glm::dvec3& p : mesh.positions) p *= glm::dvec3(1, 2, 3);
    return mesh;
}

TEST_F(VertexNormalsBuild, OfACoarseEllipsoidAreExact) {
    const fs::path input = folder_ / "ellipsoid.ply";
    writePlyWithNormals(ellipsoid(9), input, ellipsoidNormal);
    const auto exact = [](const glm::dvec3(&p)[3], int i) { return ellipsoidNormal(p[i]); };
    built(options(input));
    const Angles own = anglesTo(exact);
    built(options(input, VertexNormals::Computed));
    const Angles computed = anglesTo(exact);
    ASSERT_GT(own.corners, 300u);
    // Those within kSettledDegrees of the computed ones are these; the grid of normals and the lattice take the rest.
    EXPECT_LT(own.most, 0.5);
    EXPECT_GT(computed.most, 5);
    EXPECT_LT(own.mean, computed.mean / 3);
}

TEST_F(VertexNormalsBuild, HardEdgesOfADrumStayHardAndItsSideRound) {
    const fs::path input = folder_ / "drum.obj";
    writeDrum(input, 7);
    const auto exact = [](const glm::dvec3(&p)[3], int i) {
        const bool isCap = std::abs(p[0].z - p[1].z) + std::abs(p[0].z - p[2].z) < 1e-3;
        return isCap ? glm::dvec3(0, 0, 1) : glm::dvec3(p[i].x, p[i].y, 0);
    };
    built(options(input));
    const Angles own = anglesTo(exact);
    ASSERT_GT(own.corners, 80u);
    EXPECT_LT(own.most, 0.5);
    built(options(input, VertexNormals::Computed));
    EXPECT_GT(anglesTo(exact).most, 20) << "the side's normals are those of its seven planes";
    // What is split by its normals is still one surface: all that is drawn has the same corners as without them.
    const auto cornersOf = [&] {
        std::multiset<std::array<double, 3>> corners;
        forTriangles([&](const glm::dvec3(&p)[3], const glm::dvec3(&)[3]) {
            for (const glm::dvec3& each : p) corners.insert({each.x, each.y, each.z});
        });
        return corners;
    };
    const auto computed = cornersOf();
    built(options(input));
    EXPECT_EQ(cornersOf(), computed);
}

TEST_F(VertexNormalsBuild, ComputedAreThoseOfAFileWithoutAny) {
    const fs::path with = folder_ / "with.ply", without = folder_ / "without.ply";
    writePlyWithNormals(ellipsoid(30), with, [](glm::dvec3 p) { return p + glm::dvec3(1, 0, 0); });
    writePlyWithNormals(ellipsoid(30), without, nullptr);
    const std::string plain = built(options(without));
    EXPECT_EQ(built(options(with, VertexNormals::Computed)), plain);
    EXPECT_NE(built(options(with)), plain);
    // Normals near the computed ones cost nothing, whichever side they are on; nor do unknown ones.
    const auto near = [](glm::dvec3 p) { return -ellipsoidNormal(p); };
    writePlyWithNormals(ellipsoid(300), with, near);
    writePlyWithNormals(ellipsoid(300), without, nullptr);
    EXPECT_TRUE(built(options(with)) == built(options(without)));
    writePlyWithNormals(ellipsoid(30), with, [](glm::dvec3) { return glm::dvec3(0); });
    EXPECT_EQ(built(options(with)), plain);
}

TEST_F(VertexNormalsBuild, IsTheSameHoweverItIsBuilt) {
    IndexedMesh mesh = test::torusMesh({0.3, 0.2, 0.1}, 2, 0.7, 400, 200);
    // Long triangles, which are cut, and far from the corners of most bins.
    test::append(mesh, test::boxMesh({-3, -3, -1.2}, {3, 3, -1.1}, 1));
    const auto leaning = [](glm::dvec3 p) {
        return glm::dvec3(std::sin(9 * p.x), std::cos(7 * p.y), 1.5 + std::sin(5 * p.z));
    };
    const fs::path input = folder_ / "mesh.ply", backwards = folder_ / "backwards.ply";
    writePlyWithNormals(mesh, input, leaning);
    writePlyWithNormals(mesh, backwards, leaning, true);
    BuildOptions o = options(input);
    const std::string whole = built(o);
    o.threads = 1;
    EXPECT_EQ(built(o), whole) << "one thread";
    o.threads = 2;
    o.memoryBytes = uint64_t{155} << 20;
    o.checkpointSeconds = 0;
    EXPECT_EQ(built(o), whole) << "several bins";
    EXPECT_EQ(built(options(backwards)), whole) << "triangles in another order";
    EXPECT_NE(built(options(input, VertexNormals::Computed)), whole);
    fs::remove(output());
    o = options(input);
    o.overwrite = false;
    ASSERT_NO_FATAL_FAILURE(test::buildInParts(o, 3));
    EXPECT_EQ(contentOf(output()), whole) << "in parts";
}

TEST_F(VertexNormalsBuild, AnEstimateKnowsOfThem) {
    const fs::path input = folder_ / "mesh.ply";
    writePlyWithNormals(ellipsoid(100), input, [](glm::dvec3 p) { return p + glm::dvec3(1, 0, 0); });
    for (const VertexNormals normals : {VertexNormals::Mesh, VertexNormals::Computed}) {
        const auto estimate = estimateBuild(options(input, normals));
        ASSERT_TRUE(estimate.ok()) << estimate.error().line();
        const double bytes = double(built(options(input, normals)).size());
        EXPECT_NEAR(double(estimate->fileBytes) / bytes, 1, 0.1);
    }
}

}  // namespace
}  // namespace vcp
