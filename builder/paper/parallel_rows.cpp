#include "builder/paper/parallel_rows.h"

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace vcp {

void forEachRow(int rows, unsigned threads, const std::function<void(int)>& work) {
    const unsigned count = threads > 0 ? threads : std::max(1u, std::thread::hardware_concurrency());
    std::atomic<int> next{0};
    const auto loop = [&] {
        for (int row = next++; row < rows; row = next++) work(row);
    };
    std::vector<std::thread> others;
    for (unsigned t = 1; t < count; ++t) others.emplace_back(loop);
    loop();
    for (std::thread& thread : others) thread.join();
}

}  // namespace vcp
