// Walls with images, built: what pictures of images are tested with.
#pragma once

#include <gtest/gtest.h>

#include "tests/support/placed_file.h"
#include "tests/support/textured_walls.h"

namespace vcp::test {

/// Writes the walls into a folder and builds them with their images. A build that fails, fails the test; there is no
/// dataset then.
inline PlacedDataset builtWalls(const std::filesystem::path& folder, const TexelAt& floor, const TexelAt& wall) {
    TexturedWalls::write(folder, floor, wall);
    const auto report = buildOctree(keepingImages(folder / "walls.obj", folder / "walls.vcp", 0.2));
    EXPECT_TRUE(report.ok()) << report.error().line();
    return report ? placedFile(folder / "walls.vcp") : PlacedDataset();
}

}  // namespace vcp::test
