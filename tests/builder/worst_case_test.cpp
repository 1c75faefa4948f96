// What a build writes and makes is bounded by its triangles, whatever these are: a search for the worst among dust,
// needles, fans, stacks, clusters, scales and links, alone and together, other ones for each seed.
#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "builder/build.h"
#include "builder/deal.h"
#include "tests/support/mesh_files.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

class Shapes {
public:
    explicit Shapes(uint64_t seed) : random_(seed) {}

    /// Returns some thousand triangles of one to three kinds, some of them stretched.
    IndexedMesh mixture() {
        IndexedMesh mesh;
        const int kinds = 1 + int(below(3));
        for (int i = 0; i < kinds; ++i) {
            const size_t first = mesh.positions.size();
            add(mesh, size_t(tenTo(2, 3.7)), 1 + below(7));
            const glm::dvec3 scale =
                below(3) == 0 ? glm::dvec3(tenTo(-4, 0), tenTo(-4, 0), tenTo(-4, 0)) : glm::dvec3(tenTo(-3, 1));
            for (size_t v = first; v < mesh.positions.size(); ++v) mesh.positions[v] *= scale;
        }
        return mesh;
    }

private:
    uint64_t below(uint64_t most) { return random_() % most; }
    double unit() { return double(random_() >> 11) * 0x1p-53; }
    /// Returns a power of ten whose exponent is anywhere between two.
    double tenTo(double least, double most) { return std::pow(10, least + (most - least) * unit()); }
    glm::dvec3 point() { return {unit(), unit(), unit()}; }
    glm::dvec3 direction() {
        const glm::dvec3 p = point() - 0.5;
        return p / std::max(glm::length(p), 1e-9);
    }

    void add(IndexedMesh& mesh, size_t count, uint64_t kind) {
        const double size = tenTo(-7, 0), other = tenTo(-7, 0);
        const std::vector<glm::dvec3> places = [&] {
            std::vector<glm::dvec3> all(1 + below(200));
            for (glm::dvec3& place : all) place = point();
            return all;
        }();
        const auto somewhere = [&] { return places[below(places.size())]; };
        for (size_t k = 0; k < count; ++k) {
            glm::dvec3 a = point(), b = point(), c = point();
            if (kind == 1) {  // dust
                b = a + size * b;
                c = a + size * c;
            } else if (kind == 2) {  // needles
                b = a + std::sqrt(size) * direction();
                c = (a + b) / 2.0 + other * size * direction();
            } else if (kind == 3) {  // a fan
                a = places[0];
                b = a + direction();
                c = b + size * direction();
            } else if (kind == 4) {  // a stack
                a = {0, 0, other * double(k)};
                b = a + glm::dvec3(1, 0, 0);
                c = a + glm::dvec3(0, size, 0);
            } else if (kind == 5) {  // clusters
                const glm::dvec3 at = somewhere() + size * a;
                a = at;
                b = at + size * other * b;
                c = at + size * other * c;
            } else if (kind == 6) {  // all scales
                const double scale = std::exp2(-60 * unit());
                a *= scale;
                b *= scale;
                c *= scale;
            } else {  // links between few points
                a = somewhere();
                b = somewhere();
                c = somewhere();
            }
            const auto v = uint32_t(mesh.positions.size());
            mesh.positions.insert(mesh.positions.end(), {a, b, c});
            mesh.triangles.push_back({v, v + 1, v + 2});
        }
    }

    std::mt19937_64 random_;
};

TEST(WorstCase, BytesAndPagesAreBoundedByTheTriangles) {
    const TestFolder folder("vcp_worst_case");
    for (uint64_t seed = 0; seed < 60; ++seed) {
        const IndexedMesh mesh = Shapes(seed).mixture();
        test::writePly(mesh, folder / "mesh.ply");
        BuildOptions options;
        options.inputs = {folder / "mesh.ply"};
        options.output = folder / "out.vcp";
        options.overwrite = true;
        options.threads = 2;
        const auto report = buildOctree(options);
        ASSERT_TRUE(report.ok()) << "seed " << seed << ": " << report.error().line();
        const uint64_t triangles = mesh.triangles.size();
        EXPECT_LE(report->fileBytes, 64 * triangles + (64 << 10)) << "seed " << seed;
        // Crowded pages are parted beyond what sparse ones allow.
        EXPECT_LE(report->subvolumes, kFreePages + triangles / kLeastPageTriangles + 64) << "seed " << seed;
        EXPECT_LE(report->leaves, 4 * triangles + 1024) << "seed " << seed;
    }
}

}  // namespace
}  // namespace vcp
