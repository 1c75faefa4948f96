// Triangles of a bin, worked on by all threads, each with a batch of what it hands on.
#pragma once

#include <atomic>
#include <mutex>

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include "octree/io/result.h"

namespace vcp {

/// Calls work(k, batch) for all k of [0, count) on the calling arena's threads, each with a batch of its own from
/// makeBatch(), which is flushed at the end. Returns the first error, which ends it.
template <class MakeBatch, class Work>
Result<void> inBatches(const MakeBatch& makeBatch, size_t count, const Work& work) {
    tbb::enumerable_thread_specific<decltype(makeBatch())> batches(makeBatch);
    std::mutex mutex;
    std::atomic<bool> failed = false;
    Result<void> result;
    tbb::parallel_for(tbb::blocked_range<size_t>(0, count, 4096), [&](const auto& range) {
        auto& batch = batches.local();
        for (size_t k = range.begin(); k < range.end() && !failed; ++k) {
            auto done = work(k, batch);
            if (done) continue;
            const std::scoped_lock lock(mutex);
            if (!failed.exchange(true)) result = done;
        }
    });
    if (!result) return result;
    for (auto& batch : batches) VCP_TRY(batch.flush());
    return {};
}

}  // namespace vcp
