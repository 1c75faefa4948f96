// vcp bench rays --frames: whole frames of the host beside Embree's, with the same rays, light and threads
// (docs/measuring.md).
//
// Frames are drawn in turn, the host's and Embree's, so that what else the machine does disturbs both alike; times are
// medians over the repetitions after a warm-up.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "octree/io/result.h"

namespace vcp {

struct BenchFramesOptions {
    std::vector<std::filesystem::path> models;  ///< as those of BenchRaysOptions
    std::vector<std::string> cameras = {"whole", "half", "close", "cells"};
    glm::ivec2 size{1920, 1200};
    int repetitions = 5;
    unsigned threads = 0;       ///< of both; 0: one a processor
    std::filesystem::path out;  ///< .vcp files are kept here and used again; empty: a temporary folder
    double cell = 0;            ///< as for vcp build
    /// Called with what is being done; false cancels. May be empty.
    std::function<bool(const std::string&, double fraction)> progress;
};

/// What one side's frame took: medians.
struct FrameCost {
    double wallMs = 0, cpuMs = 0;  ///< cpuMs: of all threads
};

/// One row: field names are those of the JSON.
struct BenchFramesRow {
    std::string model, camera;
    std::string frame;  ///< "trace": hits alone; "light"; "shadows"; "occlusion": 8 rays a pixel, without shadows
    uint64_t rays = 0, lightRays = 0;  ///< from the eye; of light, as many as hits ask for
    uint64_t hits = 0, otherHits = 0;  ///< pixels that the host hits, and that one side alone does
    FrameCost host{}, embree{};
    /// Mean difference of the two pictures' light where both hit, of 255; 0 for "trace".
    double differenceMean = 0;

    /// Frames of the host in the time of one of Embree's.
    [[nodiscard]] double wallRatio() const { return host.wallMs > 0 ? embree.wallMs / host.wallMs : 0; }
    [[nodiscard]] double cpuRatio() const { return host.cpuMs > 0 ? embree.cpuMs / host.cpuMs : 0; }
};

/// Runs the benchmark. Blocks. Errors: Usage (an unknown camera; no Embree), those of loadBenchModel, Cancelled.
Result<std::vector<BenchFramesRow>> benchFrames(const BenchFramesOptions& options);

/// The rows as one JSON object {"rows": [...]}, as CSV with a header line, and as a table; the table also says what
/// rays of light alone cost: what the frame with them takes above the one with light.
std::string benchFramesJson(const std::vector<BenchFramesRow>& rows);
std::string benchFramesCsv(const std::vector<BenchFramesRow>& rows);
std::string benchFramesMarkdown(const std::vector<BenchFramesRow>& rows);

}  // namespace vcp
