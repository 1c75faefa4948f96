// Small .vcp files for tests of sources.
#pragma once

#include <cstring>
#include <filesystem>

#include <gtest/gtest.h>

#include "octree/vcp_writer.h"
#include "tests/support/analytic_page.h"

namespace vcp::test {

/// A sphere with colour, `levels` levels of pages of 4^3 cells.
inline void writeSphereFile(const std::filesystem::path& path, uint32_t levels = 3, double radius = 1.4) {
    const double edge = 4 * std::exp2(double(levels - 1));
    const auto made =
        analyticDataset(sphere(glm::dvec3(0.5 * edge), 0.25 * radius * edge), {.levels = levels, .log2Cells = 2});
    auto writer = VcpWriter::create(path, made.pages.size());
    ASSERT_TRUE(writer.ok()) << writer.error().line();
    FileHeader header = made.dataset.header;
    header.flags = kFlagColour;
    for (size_t i = 0; i < made.pages.size(); ++i) {
        PageHeader page;
        std::memcpy(&page, made.pages[i].geometryBytes().data(), sizeof page);
        const std::vector<uint4> colour(colourPageBytes(page) / 16, uint4(0xff336699u));
        PageEntry entry = made.dataset.pages[i];
        entry.offset = entry.hash = 0;
        ASSERT_TRUE((*writer)
                        ->append(entry, compressPage(made.pages[i].geometryBytes(), std::as_bytes(std::span(colour))))
                        .ok());
    }
    ASSERT_TRUE((*writer)->commit(header).ok());
}

}  // namespace vcp::test
