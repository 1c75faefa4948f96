#include "builder/memory_plan.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include <fmt/format.h>
#include <unistd.h>

#include "builder/lattice/soup.h"
#include "octree/page/page.h"

namespace vcp {

namespace {

constexpr uint64_t kMiB = uint64_t{1} << 20;

// The program itself, the readers' windows, and what each thread keeps for coding and compressing.
constexpr uint64_t kBaseBytes = 40 * kMiB;
constexpr uint64_t kThreadBytes = 6 * kMiB;

// With less memory, blocks and bins become so small that the disk does nothing but seek.
constexpr uint64_t kLeastUsable = 96 * kMiB;

// A bin's records, its mesh, and what the step to the coarser level needs; measured, with some room to spare.
constexpr uint64_t kBinTriangleBytes = 284;
// Where a triangle is in an image: its record, and in the mesh.
constexpr uint64_t kTextureBytes = sizeof(TexturedTriangle) + 3 * sizeof(TexturePoint);

// A page's directory entry, of 80 bytes: in the pages' list and in that of the surfaces, both with the coarser levels
// and with room to grow, and at the end, alone, in the file's directory.
constexpr uint64_t kPageEntryBytes = 240;

// A page while it is counted: a node of a map for one of the threads, and of their sum.
constexpr uint64_t kCountedPageBytes = 3 * 64;

// Two sets of bins and a smaller one are open at a time; each may use half of its memory for the bins themselves.
constexpr uint64_t kBytesOfBin = 40;

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
    plan.fixedBytes = fixed;
    plan.usableBytes = usable;
    plan.vertexBytes = usable / 2;
    plan.tempBytes = usable / 6;
    plan.bufferBytes = usable / 16;
    // Pages get what temporary files, the next level's blocks and those of waiting triangles leave.
    plan.pageBytes = usable - plan.tempBytes - plan.bufferBytes * 5 / 4;
    plan.binBytes = usable / 3;
    return plan;
}

uint64_t MemoryPlan::binTriangles(bool withImages) const {
    return binBytes / (kBinTriangleBytes + (withImages ? kTextureBytes : 0));
}

uint64_t MemoryPlan::mostCountedPages() const { return pageBytes / kCountedPageBytes; }

Error tooLittleMemory(const MemoryPlan& plan, const std::string& what, uint64_t enoughBytes) {
    return {.code = ErrorCode::Limit,
            .message = fmt::format("{} need more memory than {} MiB; let the memory cap be {}M or more", what,
                                   (plan.fixedBytes + plan.usableBytes) / kMiB, enoughBytes / kMiB + 1)};
}

Result<MemoryPlan> planPages(MemoryPlan plan, uint64_t pages, uint64_t bins) {
    // A third: what is left holds a bin, and at the end what writing the directory takes.
    const uint64_t directory = pages * kPageEntryBytes;
    if (directory > plan.usableBytes / 3)
        return tooLittleMemory(plan, fmt::format("{} pages", pages), plan.fixedBytes + 3 * directory);
    // With more memory there are fewer bins.
    const double few = double(plan.bufferBytes / 4 / 2 / kBytesOfBin);
    if (double(bins) > few)
        return tooLittleMemory(plan, fmt::format("{} bins", bins),
                               plan.fixedBytes + uint64_t(double(plan.usableBytes) * std::sqrt(double(bins) / few)));
    plan.pageBytes -= directory;
    return plan;
}

}  // namespace vcp
