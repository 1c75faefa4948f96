// vcp bench stream: `vcp stress` on datasets, camera paths and budgets side by side, every run from nothing
// (docs/streaming.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "viewer/bench/stress/stress.h"

namespace vcp {

struct BenchStreamOptions {
    /// .vcp files, their http(s) addresses, or meshes, which are built into the cache first; none:
    /// viewer/bench/rays/analytic_models.h.
    std::vector<std::string> models;
    std::vector<std::string> paths = {"fly"};
    std::vector<uint64_t> budgets = {64ull << 20, 256ull << 20, 1ull << 30};
    StressOptions run;  ///< options of each run; name, path and budget are set for each
    SourceAccess access;
    std::filesystem::path out;  ///< the analytic models' datasets are left here; empty: a temporary folder
};

/// Returns a row for each model, path and budget, in this order. A local file is dropped from the system's cache before
/// each run, where the system allows it. Blocks. Errors: those of openDataset, of the build and of runStress.
/// Violations are no errors.
Result<std::vector<StressReport>> benchStream(const BenchStreamOptions& options);

/// The rows as one JSON object {"rows": [...]}, as CSV with a header line, and as a Markdown table.
std::string benchStreamJson(const std::vector<StressReport>& rows);
std::string benchStreamCsv(const std::vector<StressReport>& rows);
std::string benchStreamMarkdown(const std::vector<StressReport>& rows);

/// Returns plots by file name without extension, over the budget: frame times with loads over those without, bytes read
/// over bytes needed.
std::vector<std::pair<std::string, std::string>> benchStreamPlots(const std::vector<StressReport>& rows);

}  // namespace vcp
