#include "builder/measure/quantile.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace vcp {

namespace {

/// The value at an index of them in order.
template <class Value>
double valueAt(std::vector<Value>& values, size_t index) {
    const auto at = values.begin() + std::ptrdiff_t(index);
    std::nth_element(values.begin(), at, values.end());
    return double(*at);
}

template <class Value>
double nearestRank(std::vector<Value>& values, double part) {
    const double rank = std::ceil(part * double(values.size()));
    return valueAt(values, size_t(std::clamp(rank, 1.0, double(values.size()))) - 1);
}

}  // namespace

double quantile(std::vector<double> values, double part) { return values.empty() ? 0 : nearestRank(values, part); }

double upperQuantile(std::vector<double> values, double part) {
    if (values.empty()) return 0;
    return valueAt(values, std::min(values.size() - 1, size_t(part * double(values.size()))));
}

Quantiles quantilesOf(std::vector<float> values) {
    if (values.empty()) return {};
    const auto at = [&](double part) { return nearestRank(values, part); };
    return {at(0.50), at(0.95), at(0.99), at(1.0)};
}

Quantiles inCells(const Quantiles& world, double cell) {
    return {world.p50 / cell, world.p95 / cell, world.p99 / cell, world.max / cell};
}

}  // namespace vcp
