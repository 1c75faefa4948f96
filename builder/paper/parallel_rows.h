// Spreads work over threads, row by row.
#pragma once

#include <functional>

namespace vcp {

/// Runs work(row) for all rows on `threads` threads (0: one a processor).
void forEachRow(int rows, unsigned threads, const std::function<void(int)>& work);

/// Runs work(i) for i in [0, count), in rows of 256.
template <class Work>
void forEachIndex(size_t count, unsigned threads, const Work& work) {
    constexpr size_t kRow = 256;
    forEachRow(int((count + kRow - 1) / kRow), threads, [&](int row) {
        const size_t first = size_t(row) * kRow;
        for (size_t i = first; i < count && i < first + kRow; ++i) work(i);
    });
}

}  // namespace vcp
