// vcp bench rays: run time against error of ray-casters on the same meshes and cameras, each beside Embree's
// coherent packets measured in the same run (docs/measuring.md).
//
// The methods and their knobs are in viewer/bench/rays/bench_methods.h. Times are the median of the repetitions after a
// warm-up; all methods get the same rays.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <glm/vec2.hpp>

#include "builder/measure/ray_classes.h"
#include "builder/paper/paper_octree.h"
#include "octree/io/result.h"
#include "viewer/bench/rays/bench_stability.h"
#include "viewer/bench/report/work_histogram.h"

namespace vcp {

struct BenchRaysOptions {
    /// Meshes, or .vcp files beside which the mesh of the same name lies; none: viewer/bench/rays/analytic_models.h.
    std::vector<std::filesystem::path> models;
    std::vector<std::string> methods;  ///< empty: all that this build has and isUsualRayMethod() names
    bool sweep = false;                ///< each method at several values of its knob, instead of its default alone
    std::vector<std::string> cameras = {"whole", "half", "close", "cells"};
    glm::ivec2 size{1920, 1200};
    int views = 1;  ///< directions each camera looks from, spread over the sphere; 8 for a survey
    int repetitions = 5;
    unsigned threads = 0;       ///< threads of Embree and the measurement; 0: one a processor
    std::string device;         ///< device of `certified`, as for --device; empty: the best
    std::filesystem::path out;  ///< .vcp files are kept here and used again; empty: a temporary folder
    double cell = 0;            ///< as for vcp build
    PaperOptions paper;         ///< the rules of the method `paper`
    bool stability = false;     ///< also measures what single precision costs (bench_stability.h)
    int judgeEvery = 1;         ///< 1: every ray is compared with the mesh; n: every nth row and column
    /// Called from one thread at a time with what is being done; false cancels. May be empty.
    std::function<bool(const std::string&, double fraction)> progress;
};

/// What became of the rays that were judged: for each hit its distance to the mesh and its error along the ray in
/// cells, and the angle between the normals.
struct RaySummary {
    std::array<double, kRayClassNames.size()> fractions{};
    uint64_t judged = 0, holes = 0, beyondCertified = 0;
    double maxOverCertified = 0;
    Quantiles distanceCells, depthCells, normalDegrees;

    RaySummary() = default;
    RaySummary(const RayClassTable& table, double cell);
    [[nodiscard]] double fraction(RayClass rayClass) const { return fractions[size_t(rayClass)]; }
};

/// One row of the table: field names are those of the JSON (docs/measuring.md).
struct BenchRaysRow {
    std::string model, camera, method, knob, device;
    uint64_t rays = 0;
    double nsPerRay = 0;
    double ratioToEmbree = 0;  ///< rays per second over those of Embree's packets on the same rays; 0 without Embree
    RaySummary classes;
    double cell = 0;     ///< the model's finest edge, world units: the same in all methods' rows
    RaysWork work;       ///< empty where the method does not count
    uint64_t bytes = 0;  ///< bytes of what is traced: pages, a peer's octree, or Embree's tree and buffers
};

struct BenchRaysReport {
    std::vector<BenchRaysRow> rows;
    std::vector<StabilityRow> stability;  ///< empty where it was not asked for
};

/// Whether this build can measure against Embree.
bool benchHasEmbree();

/// Runs the benchmark. Blocks. Errors: Usage (unknown method or camera; a method this build lacks), what loadMesh and
/// buildOctree report, Cancelled.
Result<BenchRaysReport> benchRays(const BenchRaysOptions& options);

/// Returns the models of a report's rows, in their order.
std::vector<std::string> modelsOf(const BenchRaysReport& report);

/// The report as one JSON object {"rows": [...], "stability": [...]}, as CSV with a header line (the rows), and as
/// Markdown: the table, beside the paper's Tables 1 and 2 and its Fig. 1 where the rows for it are there, and
/// stability.
std::string benchRaysJson(const BenchRaysReport& report);
std::string benchRaysCsv(const BenchRaysReport& report);
std::string benchRaysMarkdown(const BenchRaysReport& report);
/// Returns plots as SVG by file name without extension: for each model error quantiles and wrong rays against time and
/// against bytes; a point is a method at one value of its knob, the mean over cameras.
std::vector<std::pair<std::string, std::string>> benchRaysPlots(const BenchRaysReport& report);

}  // namespace vcp
