// A .vcp file as a renderer takes it.
#pragma once

#include <gtest/gtest.h>

#include "render/picture_renderer.h"

namespace vcp::test {

/// A file that cannot be opened fails the test; there is no dataset then.
inline PlacedDataset placedFile(const std::filesystem::path& path) {
    PlacedDataset placed;
    const auto reader = openFile(path);
    EXPECT_TRUE(reader.ok()) << reader.error().line();
    if (!reader) return placed;
    placed.dataset = std::make_shared<const Dataset>(*readDataset(**reader));
    placed.source = std::make_shared<FilePageSource>(*reader, placed.dataset);
    return placed;
}

}  // namespace vcp::test
