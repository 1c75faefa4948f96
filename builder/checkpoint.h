// What a build can go on from: the files that pass between its stages, and what the journal says about them.
#pragma once

#include <deque>
#include <memory>
#include <string>

#include <nlohmann/json.hpp>

#include "builder/build.h"
#include "builder/ingest.h"
#include "builder/level_step.h"
#include "builder/page_spool.h"
#include "builder/record_bins.h"

namespace vcp {

/// What must be the same for a build to go on where another was.
std::string buildFingerprint(const BuildOptions& options);

nlohmann::json jsonOf(const SoupMeasures& measures);
SoupMeasures measuresFrom(const nlohmann::json& json);

/// The files of a build at one moment; those that are not needed are null. One thread.
struct WorkFiles {
    std::unique_ptr<Soup> soup;
    std::unique_ptr<RecordBins<LatticeTriangle>> current, next;  ///< of the pass that runs and of the one after it
    std::unique_ptr<RecordBins<WaitingTriangle>> waiting;
    std::deque<PageSpool> spools;  ///< finished pages of each level, coarse first

    /// Makes all of them durable. Returns the fields to record. Errors: Io.
    Result<nlohmann::json> sync();
    /// Takes over what was recorded, cut to it, where the files were made as they were then. What else an
    /// interrupted build left in `space` is removed. Errors: Io; InvalidInput (a file is shorter than recorded).
    Result<void> reopen(const nlohmann::json& recorded, TempSpace& space);
};

}  // namespace vcp
