// Meshes that come back from a dataset: the mesh itself from the finest level, and from others what is certified.
#include <limits>
#include <set>

#include "tests/support/mesh_reading.h"
#include "tests/viewer/export/exported_mesh.h"

namespace vcp::test {
namespace {

/// A torus over several pages.
IndexedMesh torus() { return torusMesh({0.3, -0.2, 0.1}, 1, 0.4, 160, 60); }

const ExportedMesh& builtTorus() {
    static const ExportedMesh built("torus", torus(), {.cell = 0.02});
    return built;
}

/// Expects each level's export and the mesh within the certified distance of each other, and that distance within
/// `factor` of what is certified of the picture: the polygons then stand for the surface about as well as that.
void expectLevelsAreNear(const ExportedMesh& built, double factor = std::numeric_limits<double>::infinity()) {
    const MeshBvh truth(built.mesh());
    for (uint32_t level = 0; level < built.levels(); ++level) {
        SCOPED_TRACE(level);
        const SurfaceCut cut = built.cut(level);
        const MeshExportFigures figures = built.write("level.ply", cut);
        const IndexedMesh out = built.read("level.ply");
        EXPECT_LE(farthestFrom(truth, out), figures.certified);
        EXPECT_LE(farthestFrom(MeshBvh(out), built.mesh()), figures.certified);
        EXPECT_LE(figures.certified, factor * cut.certifiedError() + figures.rounding);
    }
}

TEST(MeshExport, FinestLevelIsTheMeshAndClosed) {
    const ExportedMesh& built = builtTorus();
    ASSERT_GT(built.cut().pages().size(), 8u);
    EXPECT_TRUE(built.cut().isMesh());
    for (const std::string file : {"out.ply", "out.obj", "out.glb"}) {
        SCOPED_TRACE(file);
        const MeshExportFigures figures = built.write(file, built.cut());
        EXPECT_EQ(figures.totals.triangles, built.mesh().triangles.size());
        EXPECT_EQ(figures.totals.vertices, built.mesh().positions.size());
        EXPECT_EQ(figures.fileBytes, std::filesystem::file_size(built / file));
        const IndexedMesh out = built.read(file);
        ASSERT_EQ(out.triangles.size(), built.mesh().triangles.size());
        EXPECT_EQ(out.positions.size(), built.mesh().positions.size());
        EXPECT_TRUE(isClosed(out));
        EXPECT_LE(farthestFrom(MeshBvh(built.mesh()), out), figures.certified);
        EXPECT_LE(farthestFrom(MeshBvh(out), built.mesh()), figures.certified);
    }
}

TEST(MeshExport, FacesKeepTheirSide) {
    const ExportedMesh& built = builtTorus();
    built.write("side.ply", built.cut());
    const IndexedMesh out = built.read("side.ply");
    const auto volume = [](const IndexedMesh& mesh) {
        double sum = 0;
        for (uint64_t k = 0; k < mesh.triangles.size(); ++k) {
            const auto c = mesh.corners(k);
            sum += glm::dot(c[0], glm::cross(c[1], c[2])) / 6;
        }
        return sum;
    };
    EXPECT_NEAR(volume(out), volume(built.mesh()), 1e-4 * std::abs(volume(built.mesh())));
}

TEST(MeshExport, StlHasEachTriangleOnce) {
    const ExportedMesh& built = builtTorus();
    const MeshExportFigures figures = built.write("out.stl", built.cut());
    EXPECT_EQ(figures.totals.triangles, built.mesh().triangles.size());
    EXPECT_EQ(std::filesystem::file_size(built / "out.stl"), 84 + 50 * built.mesh().triangles.size());
    const IndexedMesh out = built.read("out.stl");
    EXPECT_EQ(out.triangles.size(), built.mesh().triangles.size());
    EXPECT_LE(farthestFrom(MeshBvh(built.mesh()), out), figures.certified);
}

TEST(MeshExport, EveryLevelIsAsNearAsItSays) {
    const ExportedMesh& built = builtTorus();
    ASSERT_GE(built.levels(), 3u);
    expectLevelsAreNear(built, 1.5);
}

TEST(MeshExport, SlabsOfThinAndFoldedSheetsAreAsNearAsTheySay) {
    IndexedMesh mesh = boxMesh({-1, -1, -0.005}, {1, 1, 0.005}, 40);
    rotate(mesh, {0, 0, 0}, {1, 2, 3}, 0.7);
    append(mesh, randomTriangles(300, 7, true));
    const ExportedMesh built("thin", mesh, {.cell = 0.03});
    expectLevelsAreNear(built);
}

TEST(MeshExport, SoftLeavesAreAsNearAsTheySay) {
    for (const double error : {0.0, 0.002}) {
        SCOPED_TRACE(error);
        const ExportedMesh built(error > 0 ? "soft" : "clustered", torusMesh({0, 0, 0}, 1, 0.4, 80, 30),
                                 {.cell = 0.05, .error = error, .leaves = CoarseLeaves::Mesh});
        expectLevelsAreNear(built, 1.5);
    }
}

TEST(MeshExport, PartedPagesMeetAndMix) {
    // A small, dense ball in a wide, coarse one: pages of several levels hold the mesh.
    IndexedMesh mesh = sphereMesh({0, 0, 0}, 10, 60);
    append(mesh, sphereMesh({3, 1, 2}, 0.05, 300));
    const ExportedMesh built("parted", mesh, {.cell = 0.4});
    std::set<uint32_t> levels;
    const SurfaceCut finestCut = built.cut();
    for (const uint64_t page : finestCut.pages()) levels.insert(built.dataset().pages[page].level);
    ASSERT_GT(levels.size(), 1u);
    built.write("finest.ply", built.cut());
    const IndexedMesh finest = built.read("finest.ply");
    EXPECT_TRUE(isClosed(finest));
    expectLevelsAreNear(built);
}

TEST(MeshExport, BytesDoNotDependOnThreadsOrTables) {
    const ExportedMesh& built = builtTorus();
    for (const std::string end : {".ply", ".stl"}) {
        built.write("one" + end, built.cut(), {.threads = 1});
        built.write("four" + end, built.cut(), {.threads = 4});
        built.write("small" + end, built.cut(), {.threads = 2, .tableBytes = 1});
        EXPECT_EQ(contentOf(built / ("one" + end)), contentOf(built / ("four" + end)));
        EXPECT_EQ(contentOf(built / ("one" + end)), contentOf(built / ("small" + end)));
    }
}

TEST(MeshExport, BoxesSideBySideShareNothingAndMissNothing) {
    const ExportedMesh& built = builtTorus();
    const auto count = [&](glm::dvec3 low, glm::dvec3 high, uint32_t level) {
        const SurfaceCut cut = built.cut(level, Box{low, high});
        return built.write("box.ply", cut).totals.triangles;
    };
    for (const uint32_t level : {built.levels() - 1, built.levels() - 2}) {
        const uint64_t all = built.write("all.ply", built.cut(level)).totals.triangles;
        EXPECT_EQ(count({-9, -9, -9}, {0.37, 9, 9}, level) + count({0.37, -9, -9}, {9, 9, 9}, level), all);
    }
    built.write("box.ply", built.cut(UINT32_MAX, Box{{0.37, -9, -9}, {9, 9, 9}}));
    const IndexedMesh part = built.read("box.ply");
    std::set<uint32_t> used;
    for (const auto& t : part.triangles) used.insert(t.begin(), t.end());
    EXPECT_EQ(used.size(), part.positions.size()) << "vertices that no triangle has";
}

TEST(MeshExport, NothingInTheBoxIsAnError) {
    const ExportedMesh& built = builtTorus();
    const SurfaceCut cut = built.cut(UINT32_MAX, Box{{50, 50, 50}, {51, 51, 51}});
    const auto figures = exportMesh(built.reader(), cut, {.output = built / "none.ply"});
    ASSERT_FALSE(figures.ok());
    EXPECT_NE(figures.error().line().find("box"), std::string::npos);
    EXPECT_FALSE(std::filesystem::exists(built / "none.ply"));
}

TEST(MeshExport, ReplacesItsOwnKindOnly) {
    const ExportedMesh& built = builtTorus();
    const SurfaceCut cut = built.cut(0);
    for (const std::string end : {".ply", ".obj", ".stl", ".glb"}) {
        SCOPED_TRACE(end);
        built.write("again" + end, cut);
        built.write("again" + end, cut);
        std::ofstream(built / ("again" + end)) << "\x89PNG\r\n\x1a\n" << std::string(600, '\xff');
        const auto refused =
            exportMesh(built.reader(), cut, {.output = built / ("again" + end), .kind = *outputKindOf("x" + end)});
        EXPECT_FALSE(refused.ok());
    }
}

TEST(MeshExport, CancelledLeavesNothing) {
    const ExportedMesh& built = builtTorus();
    for (const double until : {0.0, 0.6}) {
        StreamOptions stream;
        stream.progress = [&](double fraction) { return fraction < until; };
        const auto figures =
            exportMesh(built.reader(), built.cut(), {.output = built / "cancelled.ply", .stream = stream});
        ASSERT_FALSE(figures.ok());
        EXPECT_EQ(figures.error().code, ErrorCode::Cancelled);
        EXPECT_FALSE(std::filesystem::exists(built / "cancelled.ply"));
        EXPECT_FALSE(std::filesystem::exists(built / "cancelled.ply.partial"));
    }
}

TEST(MeshExport, TooCoarseIsSaidAndNotWritten) {
    const ExportedMesh& built = builtTorus();
    const SurfaceCut cut = built.cut(0);
    for (const std::string file : {"coarse.ply", "coarse.stl"}) {
        const auto figures =
            exportMesh(built.reader(), cut, {.output = built / file, .kind = *outputKindOf(file), .mostError = 1e-9});
        ASSERT_TRUE(figures.ok()) << figures.error().line();
        EXPECT_TRUE(figures->isTooCoarse);
        EXPECT_FALSE(std::filesystem::exists(built / file));
    }
}

TEST(MeshExport, HeadersSayWhatIsCertified) {
    const ExportedMesh& built = builtTorus();
    const SurfaceCut cut = built.cut();
    double certified = 0;
    for (const std::string end : {".ply", ".obj", ".stl", ".glb"}) {
        SCOPED_TRACE(end);
        const std::filesystem::path file = built / ("notes" + end);
        const auto figures =
            exportMesh(built.reader(), cut,
                       {.output = file, .kind = *outputKindOf(file), .notes = {{"unit", "mm"}, {"source", "a\nb"}}});
        ASSERT_TRUE(figures.ok()) << figures.error().line();
        certified = figures->certified;
        const std::string start = contentOf(file).substr(0, 4096);
        EXPECT_NE(start.find("certified_distance"), std::string::npos);
        EXPECT_NE(start.find(fmt::format("{:.6g}", certified)), std::string::npos);
        EXPECT_NE(start.find("unit"), std::string::npos);
        EXPECT_EQ(start.find("a\nb"), std::string::npos) << "a note takes one line";
    }
    EXPECT_LT(certified, 0.002 * 0.02);
}

TEST(MeshExport, ColoursComeBack) {
    const IndexedMesh mesh = torus();
    std::vector<uint32_t> colours;
    for (const glm::dvec3& p : mesh.positions)
        colours.push_back(uint32_t(127 + 90 * p.x) | uint32_t(127 + 90 * p.y) << 8 | uint32_t(127 + 200 * p.z) << 16 |
                          0xff000000u);
    const ExportedMesh built("colour", mesh, {.cell = 0.02}, colours);
    const MeshBvh truth(built.mesh());
    std::map<std::tuple<int64_t, int64_t, int64_t>, uint32_t> colourAt;
    const auto place = [](glm::dvec3 p) {
        return std::tuple(std::llround(p.x * 1e3), std::llround(p.y * 1e3), std::llround(p.z * 1e3));
    };
    for (size_t v = 0; v < mesh.positions.size(); ++v) colourAt[place(mesh.positions[v])] = colours[v];
    for (const std::string end : {".ply", ".obj", ".glb"}) {
        SCOPED_TRACE(end);
        built.write("colour" + end, built.cut());
        const ReadMesh out = readAll(openMesh(built / ("colour" + end)));
        ASSERT_TRUE(out.info.hasColour || !out.colours.empty());
        size_t found = 0, wrong = 0;
        for (size_t v = 0; v < out.positions.size(); ++v) {
            const auto at = colourAt.find(place(out.positions[v]));
            if (at == colourAt.end()) continue;
            ++found;
            for (int c = 0; c < 3; ++c)
                wrong += std::abs(int(at->second >> 8 * c & 255) - int(out.colours[v] >> 8 * c & 255)) > 1;
        }
        EXPECT_GT(found, mesh.positions.size() / 2);
        EXPECT_EQ(wrong, 0u);
    }
    built.write("plain.ply", built.cut(), {.colour = false});
    EXPECT_FALSE(readAll(openMesh(built / "plain.ply")).info.hasColour);
    // Coarser levels have colours, too.
    built.write("coarse.ply", built.cut(0));
    EXPECT_TRUE(readAll(openMesh(built / "coarse.ply")).info.hasColour);
}

TEST(MeshExport, FarFromTheOriginNothingIsLost) {
    const IndexedMesh mesh = torusMesh({691000.5, 5335000.25, 520}, 1, 0.4, 100, 40);
    const ExportedMesh built("utm", mesh, {.cell = 0.03});
    const MeshBvh truth(mesh);
    for (const std::string end : {".ply", ".obj", ".glb"}) {
        SCOPED_TRACE(end);
        const MeshExportFigures figures = built.write("utm" + end, built.cut());
        EXPECT_LT(figures.certified, 0.0001);
        EXPECT_EQ(figures.isDouble, end != ".glb");
        const IndexedMesh out = built.read("utm" + end);
        EXPECT_TRUE(isClosed(out));
        EXPECT_LE(farthestFrom(truth, out), figures.certified);
    }
    const MeshExportFigures stl = built.write("utm.stl", built.cut());
    EXPECT_GT(stl.rounding, 0.1) << "an STL has single precision, and says so";
}

}  // namespace
}  // namespace vcp::test
