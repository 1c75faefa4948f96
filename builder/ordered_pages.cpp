#include "builder/ordered_pages.h"

#include <atomic>
#include <condition_variable>
#include <map>
#include <mutex>
#include <vector>

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

namespace vcp {

namespace {

/// Lets pages be built while there is memory for them.
class Admission {
public:
    explicit Admission(uint64_t bytes) : free_(bytes) {}
    void enter(uint64_t bytes) {
        std::unique_lock lock(mutex_);
        freed_.wait(lock, [&] { return bytes <= free_; });
        free_ -= bytes;
    }
    void leave(uint64_t bytes) {
        {
            const std::scoped_lock lock(mutex_);
            free_ += bytes;
        }
        freed_.notify_all();
    }

private:
    std::mutex mutex_;
    std::condition_variable freed_;
    uint64_t free_;
};

/// Appends pages in order, whatever the order they come in.
class InOrder {
public:
    explicit InOrder(const PageTasks& tasks)
        : pages_(tasks.pages), surfaces_(tasks.surfaces), emptyToo_(tasks.emptyToo) {}
    Result<void> put(size_t number, BuiltPage page) {
        const std::scoped_lock lock(mutex_);
        ready_.emplace(number, std::move(page));
        for (auto at = ready_.begin(); at != ready_.end() && at->first == next_; at = ready_.erase(at), ++next_) {
            const BuiltPage& built = at->second;
            if (built.entry.leaves > 0 || emptyToo_) VCP_TRY(pages_.append(built.entry, built.stored));
            if (surfaces_ != nullptr && !built.surface.geometry.empty())
                VCP_TRY(surfaces_->append({.morton = built.entry.morton}, built.surface));
        }
        return {};
    }

private:
    PageSpool& pages_;
    PageSpool* surfaces_;
    bool emptyToo_;
    std::mutex mutex_;
    std::map<size_t, BuiltPage> ready_;
    size_t next_ = 0;
};

/// Builds the pages that need more than all have together: each alone, while nothing else takes memory.
Result<void> buildLarge(const PageTasks& tasks, InOrder& inOrder, std::vector<bool>& isBuilt) {
    for (size_t i = 0; i < tasks.work.size(); ++i) {
        if (tasks.work[i] <= tasks.pageBytes) continue;
        if (const uint64_t most = tasks.pageBytes + tasks.roomBytes; tasks.work[i] > most)
            return Error{.code = ErrorCode::Limit,
                         .message = fmt::format("{} and needs {} MiB more memory; use a smaller cell edge or a larger "
                                                "memory cap",
                                                tasks.description(i), ((tasks.work[i] - most) * 3 / 2 >> 20) + 1)};
        VCP_TRY(tasks.makeRoom());
        VCP_TRY_ASSIGN(auto page, tasks.build(i));
        VCP_TRY(inOrder.put(i, std::move(page)));
        isBuilt[i] = true;
    }
    return {};
}

}  // namespace

Result<void> forEachInOrder(size_t count, const std::function<Result<void>(size_t)>& work) {
    std::atomic<size_t> next = 0;
    std::atomic<bool> stopped = false;
    std::mutex mutex;
    Result<void> result;
    tbb::parallel_for(
        0, tbb::this_task_arena::max_concurrency(),
        [&](int) {
            for (size_t i; !stopped && (i = next++) < count;) {
                auto done = work(i);
                if (done) continue;
                const std::scoped_lock lock(mutex);
                if (!stopped.exchange(true)) result = done;
            }
        },
        tbb::simple_partitioner());
    return result;
}

Result<void> buildInOrder(const PageTasks& tasks) {
    const size_t count = tasks.work.size();
    InOrder inOrder(tasks);
    std::vector<bool> isBuilt(count, false);
    VCP_TRY(buildLarge(tasks, inOrder, isBuilt));
    Admission admission(tasks.pageBytes);
    std::atomic<size_t> done = 0;
    // Pages differ in weight. Taken in order, few must wait for an earlier one.
    return forEachInOrder(count, [&](size_t i) -> Result<void> {
        Result<void> put;
        if (!isBuilt[i]) {
            admission.enter(tasks.work[i]);
            auto page = tasks.build(i);
            put = page ? inOrder.put(i, std::move(*page)) : Result<void>(page.error());
            admission.leave(tasks.work[i]);
        }
        if (put && !tasks.progress(double(++done) / double(count))) return Error::cancelled();
        return put;
    });
}

}  // namespace vcp
