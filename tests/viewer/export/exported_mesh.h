// A mesh, built and exported again, for tests of exporting.
#pragma once

#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "builder/build.h"
#include "builder/measure/mesh_bvh.h"
#include "octree/dataset_reader.h"
#include "tests/support/mesh_files.h"
#include "tests/support/test_folder.h"
#include "tests/support/test_meshes.h"
#include "viewer/export/mesh_export.h"

namespace vcp::test {

/// How it is built.
struct BuildChoice {
    double cell = 0;
    double error = 0;
    CoarseLeaves leaves = CoarseLeaves::Slabs;
};

/// A dataset in a folder of its own.
class ExportedMesh {
public:
    ExportedMesh(const std::string& name, const IndexedMesh& mesh, BuildChoice how,
                 const std::vector<uint32_t>& colours = {})
        : folder_("vcp_export_" + name), mesh_(mesh) {
        writePly(mesh, folder_ / "mesh.ply", colours);
        BuildOptions options;
        options.cell = how.cell;
        options.error = how.error;
        options.coarseLeaves = how.leaves;
        options.inputs = {folder_ / "mesh.ply"};
        options.output = folder_ / "mesh.vcp";
        options.threads = 2;
        const auto report = buildOctree(options);
        EXPECT_TRUE(report.ok()) << report.error().line();
        auto reader = openFile(options.output);
        EXPECT_TRUE(reader.ok());
        reader_ = *reader;
        auto dataset = readDataset(*reader_);
        EXPECT_TRUE(dataset.ok());
        dataset_ = *dataset;
    }

    [[nodiscard]] const IndexedMesh& mesh() const { return mesh_; }
    [[nodiscard]] const Dataset& dataset() const { return dataset_; }
    [[nodiscard]] const ByteReader& reader() const { return *reader_; }
    [[nodiscard]] uint32_t levels() const { return dataset_.header.levels; }
    [[nodiscard]] std::filesystem::path operator/(const std::string& file) const { return folder_ / file; }

    [[nodiscard]] SurfaceCut cut(uint32_t level = UINT32_MAX, const std::optional<Box>& box = {},
                                 const std::optional<CutPlane>& plane = {}) const {
        auto cut = SurfaceCut::create(dataset_, "mesh.vcp", level, box, plane);
        EXPECT_TRUE(cut.ok());
        return *cut;
    }

    /// Exports to a file of this folder.
    MeshExportFigures write(const std::string& file, const SurfaceCut& cut, StreamOptions stream = {}) const {
        const auto figures = exportMesh(
            *reader_, cut, {.output = folder_ / file, .kind = *outputKindOf(file), .stream = std::move(stream)});
        EXPECT_TRUE(figures.ok()) << figures.error().line();
        return figures.ok() ? *figures : MeshExportFigures{};
    }
    [[nodiscard]] IndexedMesh read(const std::string& file) const {
        const auto mesh = loadMesh(folder_ / file);
        EXPECT_TRUE(mesh.ok()) << mesh.error().line();
        return mesh.ok() ? *mesh : IndexedMesh{};
    }

private:
    TestFolder folder_;
    IndexedMesh mesh_;
    std::shared_ptr<const ByteReader> reader_;
    Dataset dataset_;
};

/// Whether each edge has one triangle on either side, which turn the same way.
inline bool isClosed(const IndexedMesh& mesh) {
    std::map<std::pair<uint32_t, uint32_t>, int> sides;
    for (const auto& t : mesh.triangles)
        for (int i = 0; i < 3; ++i) ++sides[{t[i], t[(i + 1) % 3]}];
    return std::ranges::all_of(sides, [&](const auto& side) {
        const auto other = sides.find({side.first.second, side.first.first});
        return side.second == 1 && other != sides.end() && other->second == 1;
    });
}

/// Returns the largest distance of corners, middles of edges and middles of triangles from the other mesh, of some
/// 10,000 triangles; those without area are no surface.
inline double farthestFrom(const MeshBvh& other, const IndexedMesh& mesh) {
    double most = 0;
    const uint64_t step = std::max<uint64_t>(mesh.triangles.size() / 10'000, 1);
    for (uint64_t k = 0; k < mesh.triangles.size(); k += step) {
        const auto c = mesh.corners(k);
        if (!(glm::length(glm::cross(c[1] - c[0], c[2] - c[0])) > 0)) continue;
        for (const glm::dvec3& p : {c[0], c[1], c[2], (c[0] + c[1]) / 2.0, (c[1] + c[2]) / 2.0, (c[2] + c[0]) / 2.0,
                                    (c[0] + c[1] + c[2]) / 3.0})
            most = std::max(most, other.nearestPoint(p)->distance);
    }
    return most;
}

}  // namespace vcp::test
