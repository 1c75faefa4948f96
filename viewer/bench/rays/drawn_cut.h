// The pages that the renderer would draw of a file, settled.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "octree/reference_caster.h"
#include "render/frame_setup.h"

namespace vcp {

/// Chooses the pages and loads them. Errors: those of PageCache::load.
inline Result<std::vector<uint64_t>> loadDrawnCut(PageCache& cache, const FrameRequest& request) {
    const Dataset& dataset = cache.dataset();
    const std::vector<uint64_t> ones(dataset.pages.size(), 1);
    const std::vector<uint8_t> all(ones.size(), 1), available(ones.size(), kAvailable);
    Selection selection =
        selectPages(dataset, selectionView(request), std::numeric_limits<uint64_t>::max(), ones, all, available);
    VCP_TRY(cache.load(selection.cut));
    return std::move(selection.cut);
}

}  // namespace vcp
