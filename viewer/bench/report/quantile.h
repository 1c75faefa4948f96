// The value that a part of many does not exceed.
#pragma once

#include <vector>

namespace vcp {

/// Of the values in order, that at `part` of their number: 0.5 is the median, 1 the greatest; 0 of none.
double quantile(std::vector<double> values, double part);

}  // namespace vcp
