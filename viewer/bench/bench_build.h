// vcp bench build: the build, end to end, beside Embree building its tree over the same mesh in memory
// (docs/measuring.md). Every build runs in a child process, so that its peak of memory is its own.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "builder/measure/surface_distance.h"
#include "octree/io/result.h"

namespace vcp {

struct BenchBuildOptions {
    std::vector<std::filesystem::path> models;
    std::vector<uint64_t> generated;  ///< scans of so many triangles beside the models, made by `makeScan`
    std::vector<double> errors;       ///< tolerances in cells; each model is built with each, beside the default
    int repetitions = 3;              ///< repetitions of build and of Embree; the medians count
    unsigned threads = 0;             ///< 0: one a processor
    uint64_t memoryBytes = 0;         ///< as for vcp build
    std::filesystem::path temp;       ///< as for vcp build; generated scans lie here too
    std::filesystem::path out;        ///< .vcp files are left here; empty: a temporary folder
    double cell = 0;                  ///< as for vcp build
    uint64_t samples = 50'000;        ///< samples of the distance between a model and its surface; 0: not measured
    std::filesystem::path makeScan;   ///< the program make_scan
    /// Called from one thread at a time with what is being done; false cancels. May be empty.
    std::function<bool(const std::string&, double fraction)> progress;
};

struct BenchBuildRow {
    std::string model;
    bool isGenerated = false;
    uint64_t triangles = 0;
    double seconds = 0;  ///< mesh file to .vcp file
    double trianglesPerSecond = 0;
    uint64_t peakRssBytes = 0;  ///< largest peak over the repetitions, of the process that builds
    uint64_t fileBytes = 0;
    double embreeBvhSeconds = 0;  ///< the mesh in memory to its tree, without reading; 0 where it was not measured
    double ratioToEmbree = 0;     ///< embreeBvhSeconds / seconds
    double cpuSeconds = 0;        ///< user and system time of all threads
    uint64_t memoryBytes = 0;     ///< the cap; 0: the default
    uint64_t tempBytes = 0;
    uint64_t leaves = 0, hardLeaves = 0;      ///< leaves of the finest level
    double cell = 0;                          ///< world units
    double errorCells = 0;                    ///< tolerated error in cells
    double certifiedCells = 0;                ///< certified error in cells
    std::optional<SurfaceDistance> distance;  ///< measured; world units

    [[nodiscard]] double bytesPerTriangle() const { return double(fileBytes) / double(triangles > 0 ? triangles : 1); }
    /// Returns the larger of the two directions, in cells. Precondition: `distance` is there.
    [[nodiscard]] Quantiles distanceCells() const;
};

struct BenchBuildReport {
    std::vector<BenchBuildRow> rows;
    std::vector<Error> failures;  ///< errors of models that have no rows; the others were measured nevertheless
};

/// Returns "1M", "250k" or "1234567" for a scan of so many triangles.
std::string scanSizeName(uint64_t triangles);

/// Runs the benchmark. Blocks; no other thread of this process may run. Embree and the distance are left out where the
/// mesh would not fit half of the memory. Errors of loadMesh, buildOctree and make_scan, or Limit (a child was killed),
/// become a failure. Errors: Usage (nothing to measure), Io (the folder cannot be made), Cancelled.
Result<BenchBuildReport> benchBuild(const BenchBuildOptions& options);

/// The report as one JSON object {"rows": [...]}, as CSV with a header line, and as a Markdown table.
std::string benchBuildJson(const BenchBuildReport& report);
std::string benchBuildCsv(const BenchBuildReport& report);
std::string benchBuildMarkdown(const BenchBuildReport& report);

/// Returns plots by file name without extension: cost and memory against triangles, and, where the distance was
/// measured, bytes against it.
std::vector<std::pair<std::string, std::string>> benchBuildPlots(const BenchBuildReport& report);

}  // namespace vcp
