// How a build divides the memory it may use. Every stage stays within its shares, whatever the input's size.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "octree/result.h"

namespace vcp {

struct MemoryPlan {
    uint64_t vertexBytes = 0;   ///< reading: vertices of one input that stay in memory
    uint64_t tempBytes = 0;     ///< temporary files' bytes that have not gone to the disk
    uint64_t bufferBytes = 0;   ///< open blocks of one set of bins
    uint64_t binTriangles = 0;  ///< triangles of a bin
    uint64_t pageBytes = 0;     ///< a bin's mesh and its pages under construction, all threads together
};

/// Half of the machine's memory, or of the control group's limit when that is less.
uint64_t defaultMemoryBytes();

/// Errors: Limit (too little to work with; the message says how much is needed).
Result<MemoryPlan> planMemory(uint64_t memoryBytes, unsigned threads);

/// A page's leaves below the size of a cell are split further only while it has fewer leaves than this: what a
/// page takes, in memory and in the file, is bounded by its triangles.
constexpr uint64_t mostSplitLeaves(uint64_t triangles) { return 32768 + triangles * 3 / 4; }
/// Likewise for the triangles that its leaves name: a bundle of long slivers would be repeated hundreds of times.
constexpr uint64_t mostSplitRecords(uint64_t triangles) { return 65536 + triangles * 8; }

/// What a page needs while it is built, in bytes; measured on scans and on random soups of triangles of 0.3 to 3
/// cells, each at one third to 17 leaves a triangle. `touched`: cells that its triangles touch, each counted by
/// itself.
constexpr uint64_t pageWorkBytes(uint64_t triangles, uint64_t touched) {
    return (4 << 20) + 180 * triangles + 20 * touched + 390 * std::min(4 * touched, mostSplitLeaves(triangles));
}

}  // namespace vcp
