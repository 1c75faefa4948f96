// The frame's page tree, as the shaders read it: the pages of the cut, or octants of those that are drawn in parts, and
// all pages above them, as records of render/shared/frame_layout.h. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "octree/dataset_reader.h"
#include "octree/page/page.h"
#include "render/shared/frame.h"
#include "streaming/page_selection.h"

namespace vcp {

/// Where a resident page is, and what the shader must know of its header.
struct ResidentPage {
    PageHeader header;
    std::array<uint32_t, 8> octants{};  ///< words of the octants' nodes, where the root is an internal node
    uint32_t texel = 0;                 ///< first texel in the page pool
    uint32_t colourTexel = 0;           ///< first texel of its colour in the same pool; 0 without colour
    bool hasPoints = false;             ///< its vertices have points in images
};

/// Returns the records of the table, the root's first. `cut`: numbers of pages, none above another but those that are
/// `partial`; `pageOf(page)`: gives a page of the cut, or one above it if it is resident. An empty cut gives a root
/// without children.
std::vector<frame::TableRecord> pageTable(const Dataset& dataset, std::span<const uint64_t> cut,
                                          std::span<const PartialPage> partial,
                                          const std::function<std::optional<ResidentPage>(uint64_t)>& pageOf);

}  // namespace vcp
