// A floor whose material has channels, built: what pictures of channels are tested with.
#pragma once

#include <gtest/gtest.h>

#include "tests/support/channelled_floor.h"
#include "tests/support/placed_file.h"

namespace vcp::test {

/// Writes a floor into a folder and builds it. A build that fails or warns fails the test; there is no dataset then.
inline PlacedDataset builtFloor(const ChannelledFloor& floor, const std::filesystem::path& folder) {
    floor.write(folder);
    const auto report = buildOctree(ChannelledFloor::options(folder));
    EXPECT_TRUE(report.ok()) << report.error().line();
    if (!report) return {};
    for (const std::string& warning : report->warnings) ADD_FAILURE() << warning;
    return placedFile(folder / "floor.vcp");
}

}  // namespace vcp::test
