// A file of the method `paper` in subvolumes.
#pragma once

#include <filesystem>

#include <gtest/gtest.h>

#include "builder/paper/paper_file.h"
#include "tests/support/mesh_files.h"
#include "tests/support/test_folder.h"

namespace vcp::test {

/// Writes a mesh as mesh.ply and builds it as mesh.vcp, whose name is returned, in subvolumes of 16 cells.
inline std::filesystem::path buildSubvolumes(const TestFolder& folder, const IndexedMesh& mesh, double cell) {
    BuildOptions build;
    build.inputs = {folder / "mesh.ply"};
    build.output = folder / "mesh.vcp";
    build.cell = cell;
    writePly(mesh, build.inputs.front());
    PaperOptions paper;
    paper.subvolumeCells = 16;
    EXPECT_TRUE(buildPaperFile(build, paper));
    return build.output;
}

}  // namespace vcp::test
