// vcp bench build: the build, end to end, beside Embree building its tree over the same mesh in memory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "octree/result.h"

namespace vcp {

struct BenchBuildOptions {
    std::vector<std::filesystem::path> models;
    int repetitions = 3;        ///< of both; the median counts
    unsigned threads = 0;       ///< 0: one a processor
    std::filesystem::path out;  ///< .vcp files are left here; empty: a temporary folder
    double cell = 0;            ///< as for vcp build
    /// Called from one thread at a time with what is being done; false cancels. May be empty.
    std::function<bool(const std::string&, double fraction)> progress;
};

struct BenchBuildRow {
    std::string model;
    uint64_t triangles = 0;
    double seconds = 0;  ///< mesh file to .vcp file
    double trianglesPerSecond = 0;
    uint64_t peakRssBytes = 0;
    uint64_t fileBytes = 0;
    double embreeBvhSeconds = 0;  ///< the mesh in memory to its tree, without reading; 0 without Embree
    double ratioToEmbree = 0;     ///< embreeBvhSeconds / seconds
};

struct BenchBuildReport {
    std::vector<BenchBuildRow> rows;
};

/// Blocks. Errors: what loadMesh and buildOctree report; Cancelled.
Result<BenchBuildReport> benchBuild(const BenchBuildOptions& options);

/// The report as one JSON object {"rows": [...]}, as CSV with a header line, and as a Markdown table.
std::string benchBuildJson(const BenchBuildReport& report);
std::string benchBuildCsv(const BenchBuildReport& report);
std::string benchBuildMarkdown(const BenchBuildReport& report);

}  // namespace vcp
