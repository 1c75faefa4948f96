// The pages that the renderer would draw of a file, settled.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "render/frame_setup.h"
#include "render/host/host_scene.h"

namespace vcp {

/// Chooses the pages, loads them and places them. `cache` must outlive the scene. Errors: those of PageCache::load and
/// HostScene::create.
inline Result<HostScene> loadDrawnScene(PageCache& cache, const FrameRequest& request) {
    const Dataset& dataset = cache.dataset();
    const std::vector<uint64_t> ones(dataset.pages.size(), 1);
    const std::vector<uint8_t> all(ones.size(), 1), available(ones.size(), kAvailable);
    const Selection selection =
        selectPages(dataset, selectionView(request), std::numeric_limits<uint64_t>::max(), ones, all, available);
    VCP_TRY(cache.load(selection.cut));
    std::vector<uint8_t> octants(selection.cut.size(), 0);
    for (const PartialPage& partial : selection.partial)
        octants[size_t(std::ranges::lower_bound(selection.cut, partial.page) - selection.cut.begin())] =
            partial.octants;
    return HostScene::create(cache, selection.cut, octants);
}

}  // namespace vcp
