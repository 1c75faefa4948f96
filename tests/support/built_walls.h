// Walls with images, built: what pictures of images are tested with.
#pragma once

#include <gtest/gtest.h>

#include "builder/build.h"
#include "render/picture_renderer.h"
#include "tests/support/textured_walls.h"

namespace vcp::test {

/// Writes the walls into a folder and builds them with their images. A build that fails, fails the test; there is no
/// dataset then.
inline PlacedDataset builtWalls(const std::filesystem::path& folder, const TexelAt& floor, const TexelAt& wall) {
    TexturedWalls::write(folder, floor, wall);
    BuildOptions options;
    options.inputs = {folder / "walls.obj"};
    options.output = folder / "walls.vcp";
    options.cell = 0.2;
    options.threads = 2;
    options.overwrite = true;
    options.keepImages = true;
    PlacedDataset placed;
    const auto report = buildOctree(options);
    EXPECT_TRUE(report.ok()) << report.error().line();
    if (!report) return placed;
    const auto reader = openFile(options.output);
    EXPECT_TRUE(reader.ok()) << reader.error().line();
    if (!reader) return placed;
    placed.dataset = std::make_shared<const Dataset>(*readDataset(**reader));
    placed.source = std::make_shared<FilePageSource>(*reader, placed.dataset);
    return placed;
}

}  // namespace vcp::test
