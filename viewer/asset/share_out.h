// Shares the ranges of a long preprocessing among the processor's threads.
#pragma once

#include <cstddef>
#include <functional>

namespace vcp {

/// Calls `fill(first, last)` for all of [0, count) in small ranges, from all the processor's threads, and `progress`
/// with the part that is done, from this one; false stops it. Returns whether all was done.
bool shareOut(size_t count, const std::function<void(size_t first, size_t last)>& fill,
              const std::function<bool(double part)>& progress);

}  // namespace vcp
