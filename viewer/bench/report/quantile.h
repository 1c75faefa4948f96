// Quantiles: the value that a part of many does not exceed.
#pragma once

#include <vector>

namespace vcp {

/// Returns the value at `part` of the ascending values: 0.5 is the median, 1 the greatest; 0 where there are none.
double quantile(std::vector<double> values, double part);

}  // namespace vcp
