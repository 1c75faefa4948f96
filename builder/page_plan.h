// Which pages hold the mesh, on which grid, and the bins that these are worked on in: of a whole build, and of one in
// parts (parts/build_parts.h).
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "builder/ingest.h"
#include "builder/level_plan.h"
#include "builder/memory_plan.h"

namespace vcp {

struct PagePlanning {
    const BuildOptions& options;
    const SoupMeasures& measures;
    std::span<const SoupShare> soups;
    const MemoryPlan& memory;
    bool mayKeepImages = false;
    unsigned parts = 0;                    ///< how many parts will work on the bins; 0: it is a build of its own
    std::function<bool(double)> progress;  ///< as Dealing's
};

struct PagePlan {
    LevelPlan levels;
    uint32_t levelsLess = 0;  ///< as chooseFrame took it
    uint64_t pages = 0;       ///< that hold the mesh; 0 where these are so few that they were not counted
    /// The first bin of each part, and the number of bins: runs with about as many triangles each.
    std::vector<size_t> firstBins;
};

/// Chooses the pages, their grid once more where these would be too sparse, and the bins. Uses the calling arena's
/// threads. Errors: those of planLevels and choosePages.
Result<PagePlan> planPagesOf(const PagePlanning& planning);

}  // namespace vcp
