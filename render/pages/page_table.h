// The frame's page tree, as the shaders read it: the pages of the cut and all pages above them, as
// records of render/shared/frame_layout.h. Pure.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "octree/dataset_reader.h"
#include "octree/page/page.h"
#include "render/shared/frame.h"

namespace vcp {

/// Where a resident page is, and what the shader must know of its header.
struct ResidentPage {
    PageHeader header;
    uint32_t texel = 0;        ///< first texel in the page pool
    uint32_t colourTexel = 0;  ///< first texel of its colour in the same pool; 0 without colour
};

/// Returns the records of the table, the root's first. `cut`: numbers of pages, none above another;
/// `pageOf(page)`: gives a page of the cut, or one above it if it is resident. An empty cut gives a root without
/// children.
std::vector<frame::TableRecord> pageTable(const Dataset& dataset, std::span<const uint64_t> cut,
                                          const std::function<std::optional<ResidentPage>(uint64_t)>& pageOf);

}  // namespace vcp
