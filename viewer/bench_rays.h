// vcp bench rays: run time against error of ray-casters on the same meshes and cameras, each beside Embree's
// coherent packets measured in the same run (docs/measuring.md).
//
// Methods: `certified` (the renderer on a Vulkan device), `reference` (the reference ray-caster in double: the
// surface that `certified` must show), `embree` (packets of 8 coherent rays), `embree-single` (one ray at a
// time). Times are the median of the repetitions after a warm-up; all methods get the same rays.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "builder/ray_classes.h"
#include "octree/result.h"

namespace vcp {

struct BenchRaysOptions {
    std::vector<std::filesystem::path> models;  ///< meshes, or .vcp files beside which the mesh of the same name lies
    std::vector<std::string> methods;           ///< empty: all that this build has
    std::vector<std::string> cameras = {"whole", "half", "close", "cells"};
    glm::ivec2 size{1920, 1200};
    int views = 1;  ///< directions each camera looks from, spread over the sphere; 8 for a survey
    int repetitions = 5;
    unsigned threads = 0;       ///< of Embree and the measurement; 0: one a processor
    std::string device;         ///< of `certified`, as for --device; empty: the best
    std::filesystem::path out;  ///< .vcp files are kept here and used again; empty: a temporary folder
    double cell = 0;            ///< as for vcp build
    int judgeEvery = 1;         ///< 1: every ray is compared with the mesh; n: every nth row and column
    /// Called from one thread at a time with what is being done; false cancels. May be empty.
    std::function<bool(const std::string&, double fraction)> progress;
};

/// One row of the table: field names are those of the JSON (docs/measuring.md).
struct BenchRaysRow {
    std::string model, camera, method, knob, device;
    uint64_t rays = 0;
    double nsPerRay = 0;
    double ratioToEmbree = 0;  ///< rays per second over those of Embree's packets on the same rays; 0 without Embree
    RayClassTable classes;     ///< of `judged` rays
    double cell = 0;           ///< finest edge, world units
    double stepsMean = 0;      ///< nodes visited a ray, where the method counts
    double fetchesMean = 0;    ///< leaves and triangles fetched a ray, where the method counts
    uint64_t bytes = 0;        ///< of what is traced: pages, or Embree's tree and buffers
};

struct BenchRaysReport {
    std::vector<BenchRaysRow> rows;
};

/// Whether this build can measure against Embree.
bool benchHasEmbree();

/// Blocks. Errors: Usage (unknown method or camera; a method this build lacks), what loadMesh and buildOctree
/// report, Cancelled.
Result<BenchRaysReport> benchRays(const BenchRaysOptions& options);

/// The report as one JSON object {"rows": [...]}, as CSV with a header line, and as a Markdown table.
std::string benchRaysJson(const BenchRaysReport& report);
std::string benchRaysCsv(const BenchRaysReport& report);
std::string benchRaysMarkdown(const BenchRaysReport& report);

}  // namespace vcp
