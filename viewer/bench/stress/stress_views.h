// Several views of one dataset that share a pool and a budget, for vcp stress: each flies along the same path from
// another place of it, and all are drawn in turn. Then all stand still; where the budget suffices, each must show what
// it would show alone.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "octree/io/result.h"
#include "render/view/renderer.h"
#include "viewer/scene/scene_opening.h"

namespace vcp {

struct StressViews {
    int views = 0;
    double settledSeconds = 0;  ///< from the last frame until all had settled
    uint64_t residentBytesMax = 0;
    uint64_t loads = 0, pagesWanted = 0;  ///< pages into the pool; the sum over the views of what each wants at the end
    uint64_t pagesResident = 0;
    int relaxed = 0;    ///< views for which the budget was too small at the end
    int identical = 0;  ///< views that show at the end what they show alone
    std::vector<std::string> violations;
};

/// Flies the views. `path`: the frames of one view, at least one. Blocks. Errors: those of Renderer; Cancelled, where
/// `progress` returns false.
Result<StressViews> flyTogether(const OpenDataset& open, const RendererOptions& options,
                                const std::vector<FrameRequest>& path, int views,
                                const std::function<bool(const std::string& what, double fraction)>& progress);

}  // namespace vcp
