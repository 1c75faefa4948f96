// The threads of a build.
#pragma once

#include <optional>
#include <utility>

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

namespace vcp {

/// So many threads, also more than there are processors. One at a time in a process.
class WorkArena {
public:
    explicit WorkArena(unsigned threads) : arena_(int(threads)) {
        // Without this TBB gives no more threads than processors, and warns about it.
        using Control = oneapi::tbb::global_control;
        if (threads > Control::active_value(Control::max_allowed_parallelism))
            more_.emplace(Control::max_allowed_parallelism, threads);
    }

    /// Returns work(), which the threads share.
    template <class Work>
    auto execute(Work&& work) {
        return arena_.execute(std::forward<Work>(work));
    }

private:
    std::optional<oneapi::tbb::global_control> more_;
    oneapi::tbb::task_arena arena_;
};

}  // namespace vcp
