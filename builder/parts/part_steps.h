// What each stage of a build in parts does (build_parts.h).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <oneapi/tbb/task_arena.h>

#include "builder/bin_passes.h"
#include "builder/build_until_dealt.h"
#include "builder/checkpoint.h"
#include "builder/memory_plan.h"
#include "builder/parts/part_folder.h"
#include "builder/parts/part_plan.h"
#include "builder/progress_meter.h"

namespace vcp {

/// What the parts after `deal` know of the build.
struct PartContext {
    std::filesystem::path folder;
    PartPlan plan;
    DonePart dealt;
    Recorded recorded;
    LevelPlan levels;
    MemoryPlan memory;
    bool hasColour = false;
    std::vector<size_t> firstBins;  ///< of each part, and the number of bins
    std::string bins;               ///< names the pages, the bins and whose they are; recorded by each part
    unsigned threads = 1;
    const std::function<bool(double)>* progress = nullptr;

    [[nodiscard]] PartName part(const std::string& stage, unsigned number) const { return {folder, stage, number}; }
    /// Opens a part of a later stage. Errors: openPart's; Usage (it was made when `deal` had chosen other bins).
    [[nodiscard]] Result<DonePart> open(const std::string& stage, unsigned number) const;
    /// Returns the first code of the deepest level that belongs to a part, or to those after all.
    [[nodiscard]] uint64_t firstCode(unsigned part) const;
    /// Returns a level's settings; `space` has the temporary files that can make room.
    [[nodiscard]] LevelSettings settingsOf(int level, bool isFinest, TempSpace& space) const;
};

/// Opens what `deal` left, without what a part needs to run. Errors: those of openPart, InvalidInput (damaged).
Result<PartContext> openDealt(const std::filesystem::path& folder, const PartPlan& plan);
/// Opens what `deal` left. Errors: those of openDealt, Limit (too little memory).
Result<PartContext> openContext(const std::filesystem::path& folder, const PartPlan& plan);

/// Uses the calling arena's threads, as do those below. Errors: runPart's.
Result<void> runVertices(const PartContext& context, unsigned number, NewPart& made);
Result<void> runPages(const PartContext& context, unsigned number, NewPart& made);
/// Writes the dataset; what `made` holds meanwhile is not needed afterwards.
Result<BuildFigures> runMerge(const PartContext& context, NewPart& made);

}  // namespace vcp
