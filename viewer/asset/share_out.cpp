#include "viewer/asset/share_out.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

namespace vcp {

bool shareOut(size_t count, const std::function<void(size_t first, size_t last)>& fill,
              const std::function<bool(double part)>& progress) {
    constexpr size_t kRange = 16;
    std::atomic<size_t> next = 0, done = 0;
    std::mutex mutex;
    std::condition_variable isDone;
    std::atomic<bool> isStopped = false;
    const auto work = [&] {
        while (!isStopped) {
            const size_t first = next.fetch_add(kRange);
            if (first >= count) return;
            const size_t last = std::min(count, first + kRange);
            fill(first, last);
            if ((done += last - first) != count) continue;
            const std::lock_guard lock(mutex);
            isDone.notify_one();
        }
    };
    std::vector<std::jthread> threads;
    for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i) threads.emplace_back(work);
    while (done < count && !isStopped) {
        if (progress && !progress(double(done) / double(count))) isStopped = true;
        std::unique_lock lock(mutex);
        isDone.wait_for(lock, std::chrono::milliseconds(20), [&] { return done == count; });
    }
    threads.clear();
    return !isStopped;
}

}  // namespace vcp
