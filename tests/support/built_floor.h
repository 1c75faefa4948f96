// A floor whose material has channels, built: what pictures of channels are tested with.
#pragma once

#include <gtest/gtest.h>

#include "render/picture_renderer.h"
#include "tests/support/channelled_floor.h"

namespace vcp::test {

/// Writes a floor into a folder and builds it. A build that fails or warns fails the test; there is no dataset then.
inline PlacedDataset builtFloor(const ChannelledFloor& floor, const std::filesystem::path& folder) {
    floor.write(folder);
    PlacedDataset placed;
    const auto report = buildOctree(ChannelledFloor::options(folder));
    EXPECT_TRUE(report.ok()) << report.error().line();
    if (!report) return placed;
    for (const std::string& warning : report->warnings) ADD_FAILURE() << warning;
    const auto reader = openFile(folder / "floor.vcp");
    EXPECT_TRUE(reader.ok()) << reader.error().line();
    if (!reader) return placed;
    placed.dataset = std::make_shared<const Dataset>(*readDataset(**reader));
    placed.source = std::make_shared<FilePageSource>(*reader, placed.dataset);
    return placed;
}

}  // namespace vcp::test
