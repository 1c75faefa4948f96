// The value that a part of many numbers does not exceed, as measurements report it.
#pragma once

#include <vector>

namespace vcp {

/// The nearest rank: the least of the values that at least `part` of them do not exceed. 0.5 is the median, the lower
/// of two; 1 the greatest. 0 where there are none.
double quantile(std::vector<double> values, double part);

/// The value before which `part` of them stand in order: 0.5 is the median, the upper of two; 1 the greatest. 0 where
/// there are none.
double upperQuantile(std::vector<double> values, double part);

/// p50, p95, p99 and max of a set of numbers; zeros for an empty set.
struct Quantiles {
    double p50 = 0, p95 = 0, p99 = 0, max = 0;
};
/// By the nearest rank.
Quantiles quantilesOf(std::vector<float> values);

/// World units in cells of this edge.
Quantiles inCells(const Quantiles& world, double cell);

}  // namespace vcp
