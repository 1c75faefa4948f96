// Turns the octree of a page into a draft of the page (octree/page/page_draft.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "builder/page/page_builder.h"
#include "octree/page/page_draft.h"

namespace vcp {

/// A page, ready for compression.
struct EncodedPage {
    PageDraft draft;
    std::vector<std::byte> colour;  ///< empty when the mesh has no colour
    uint32_t leaves = 0;            ///< leaves of all kinds with surface
    uint32_t slabLeaves = 0;
    uint32_t hardLeaves = 0;
    uint8_t parts = 0;          ///< as PageEntry's
    double certifiedError = 0;  ///< in cells: error of the leaves, stray of the level's mesh, and rounding
};

/// Encodes a page; sets the leaves' wall codes in `tree`. What is open has marks where something is closed.
EncodedPage encodePage(PageTree& tree, const LatticeMesh& mesh);

/// Encodes a page that has slab leaves only.
EncodedPage encodeSlabPage(PageTree& tree, bool withColour);

}  // namespace vcp
