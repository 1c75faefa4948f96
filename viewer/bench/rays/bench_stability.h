// Part of vcp bench rays: what single precision costs, on the processor and on the device, against double, for cells
// from 1e-6 to 1e6 world units and origins up to 1e7 cells away. The same rays through the finest level of the same
// shape (a torus about a box whose faces lie on planes of the grid), built anew for each cell and origin.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "builder/measure/ray_classes.h"
#include "octree/io/result.h"

namespace vcp {

/// One caster beside the reference in double.
struct PrecisionRow {
    uint64_t hits = 0;
    uint64_t otherOutcome = 0;  ///< rays where one hits and the other does not, or their hits are over 2 cells apart
    Quantiles depthCells;       ///< along the ray, between the two hits
    uint64_t holes = 0;         ///< against the mesh (ray_classes.h)
    Quantiles distanceCells;    ///< from the hits to the mesh
};

struct StabilityRow {
    double cell = 0;         ///< world units
    double originCells = 0;  ///< largest coordinate of the mesh's middle
    uint64_t rays = 0;
    double certifiedCells = 0;
    PrecisionRow doubles, floats, device;
};

struct StabilityOptions {
    std::vector<double> cells = {1e-6, 1e-3, 1, 1e3, 1e6};
    std::vector<double> originCells = {0, 1e3, 1e5, 1e7};
    int width = 192, height = 120;
    std::string device;  ///< as for --device
    unsigned threads = 0;
    std::filesystem::path folder;                                       ///< for what is built; removed afterwards
    std::function<bool(const std::string&, double fraction)> progress;  ///< false cancels; may be empty
};

/// Runs the comparison. Blocks. Errors: what buildOctree and the renderer say, Cancelled.
Result<std::vector<StabilityRow>> benchStability(const StabilityOptions& options);

/// Returns a section of the report; empty without rows.
std::string stabilityMarkdown(const std::vector<StabilityRow>& rows);

}  // namespace vcp
