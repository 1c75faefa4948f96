#include "builder/memory_plan.h"

#include <algorithm>
#include <fstream>
#include <limits>

#include <fmt/format.h>
#include <unistd.h>

namespace vcp {

namespace {

constexpr uint64_t kMiB = uint64_t{1} << 20;

// The program itself, the readers' windows, and what each thread keeps for coding and compressing.
constexpr uint64_t kBaseBytes = 40 * kMiB;
constexpr uint64_t kThreadBytes = 6 * kMiB;

// With less memory, blocks and bins become so small that the disk does nothing but seek.
constexpr uint64_t kLeastUsable = 96 * kMiB;

// A bin's records, its mesh, and what the step to the coarser level needs; measured, with some room to spare.
constexpr uint64_t kBinTriangleBytes = 260;

/// Returns the bytes that a control group allows, or the largest number.
uint64_t groupLimit() {
    std::ifstream file("/sys/fs/cgroup/memory.max");
    uint64_t bytes = 0;
    return file >> bytes ? bytes : std::numeric_limits<uint64_t>::max();
}

}  // namespace

uint64_t defaultMemoryBytes() {
    const uint64_t machine = uint64_t(sysconf(_SC_PHYS_PAGES)) * uint64_t(sysconf(_SC_PAGESIZE));
    return std::min(machine, groupLimit()) / 2;
}

uint64_t fixedMemoryBytes(unsigned threads) { return kBaseBytes + threads * kThreadBytes; }

Result<MemoryPlan> planMemory(uint64_t memoryBytes, unsigned threads) {
    const uint64_t fixed = fixedMemoryBytes(threads);
    if (memoryBytes < fixed + kLeastUsable)
        return Error{
            .code = ErrorCode::Limit,
            .message = fmt::format("{} MiB of memory are too little for {} threads; let the memory cap be {}M or more",
                                   memoryBytes / kMiB, threads, (fixed + kLeastUsable) / kMiB + 1)};
    const uint64_t usable = memoryBytes - fixed;
    MemoryPlan plan;
    plan.vertexBytes = usable / 2;
    plan.tempBytes = usable / 6;
    plan.bufferBytes = usable / 16;
    // Pages get what temporary files, the next level's blocks and those of waiting triangles leave.
    plan.pageBytes = usable - plan.tempBytes - plan.bufferBytes * 5 / 4;
    plan.binTriangles = usable / 3 / kBinTriangleBytes;
    return plan;
}

}  // namespace vcp
