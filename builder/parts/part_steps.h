// What each stage of a build in parts does (build_parts.h).
#pragma once

#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include <oneapi/tbb/task_arena.h>

#include "builder/bin_passes.h"
#include "builder/checkpoint.h"
#include "builder/memory_plan.h"
#include "builder/parts/part_folder.h"
#include "builder/parts/part_plan.h"
#include "builder/progress_meter.h"

namespace vcp {

/// What all parts know.
struct PartSetting {
    std::filesystem::path folder;
    PartPlan plan;
    const std::function<bool(double)>* progress = nullptr;

    [[nodiscard]] PartName part(const std::string& stage, unsigned number) const { return {folder, stage, number}; }
};

/// What the parts after `count` know of the build.
struct PartContext : PartSetting {
    DonePart counted;
    Recorded recorded;
    LevelPlan levels;
    MemoryPlan memory;
    bool hasColour = false;
    std::vector<size_t> firstBins;  ///< of each part, and the number of bins
    std::string bins;               ///< names the pages, the bins and whose they are; recorded by each part

    /// Opens a part of a later stage. Errors: openPart's; Usage (it was made when `count` had chosen other bins).
    [[nodiscard]] Result<DonePart> open(const std::string& stage, unsigned number) const;
    /// Returns the first code of the deepest level that belongs to a part, or to those after all.
    [[nodiscard]] uint64_t firstCode(unsigned part) const;
    /// Returns a level's settings; `space` has the temporary files that can make room.
    [[nodiscard]] LevelSettings settingsOf(int level, bool isFinest, TempSpace& space) const;
};

/// Opens what `count` left, without what a part needs to run. Errors: those of openPart, InvalidInput (damaged).
Result<PartContext> openCounted(const PartSetting& setting);
/// Opens what `count` left. Errors: those of openCounted, Limit (too little memory).
Result<PartContext> openContext(const PartSetting& setting);

/// Makes bins durable and notes in `files` where they are. Errors: Io.
Result<void> recordBins(RawBins& bins, const std::string& name, nlohmann::json& files);
/// Opens bins of a part that is done, as they were recorded in its `fields`. Errors: Io; InvalidInput (damaged).
Result<void> reopenBins(const nlohmann::json& fields, const std::string& name, RawBins& bins);
/// Returns the parts of the later stages whose bins have anything of these.
std::vector<unsigned> partsWith(const PartContext& context, std::initializer_list<const RawBins*> bins);

/// Uses the calling arena's threads, as do those below. Errors: runPart's.
Result<void> runVertices(const PartContext& context, unsigned number, NewPart& made);
Result<void> runPages(const PartContext& context, unsigned number, NewPart& made);
/// Writes the dataset; what `made` holds meanwhile is not needed afterwards.
Result<BuildFigures> runMerge(const PartContext& context, NewPart& made);

}  // namespace vcp
