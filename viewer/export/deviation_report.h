// The figures of a comparison as files have them: `vcp compare` and the window write the same JSON and CSV.
#pragma once

#include <string>
#include <utility>

#include <nlohmann/json_fwd.hpp>

#include "builder/measure/mesh_deviation.h"

namespace vcp {

/// What was compared, beside the distances.
struct ComparedSurfaces {
    std::string a, b;  ///< names
    std::string unit;  ///< the world's; empty: not known
    double certifiedA = 0, certifiedB = 0;
    /// The distance at the ends of histogram and colours, world units, above 0.
    double range = 1;
};

/// The parts whose signed distances are listed, with their names, ascending.
inline constexpr std::pair<const char*, double> kDeviationQuantiles[] = {
    {"p1", 0.01}, {"p5", 0.05}, {"p25", 0.25}, {"p50", 0.5}, {"p75", 0.75}, {"p95", 0.95}, {"p99", 0.99}};

/// Returns the range where none is chosen: the size that 99 % of the distances do not exceed; where they are all 0,
/// a millionth of the diagonal.
double usualRange(const Deviation& deviation, double diagonal);

/// Returns one object: what was compared, and under `direction` ("a_to_b") the figures and a histogram.
nlohmann::ordered_json deviationJson(const Deviation& deviation, const ComparedSurfaces& compared,
                                     const std::string& direction);

/// Returns a row for each figure and each bin: what it is, the bin's ends, the value. `range` as above.
std::string deviationCsv(const Deviation& deviation, double range);

}  // namespace vcp
