#include "viewer/bench/report/quantile.h"

#include <algorithm>
#include <cstddef>

namespace vcp {

double quantile(std::vector<double> values, double part) {
    if (values.empty()) return 0;
    const auto at = values.begin() + std::ptrdiff_t(std::min(values.size() - 1, size_t(part * double(values.size()))));
    std::ranges::nth_element(values, at);
    return *at;
}

}  // namespace vcp
