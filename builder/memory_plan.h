// How a build divides the memory it may use. Every stage stays within its shares, whatever the input's size.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "octree/io/result.h"

namespace vcp {

struct MemoryPlan {
    uint64_t vertexBytes = 0;  ///< reading: vertices of one input that stay in memory
    uint64_t tempBytes = 0;    ///< bytes of temporary files that have not gone to the disk
    uint64_t bufferBytes = 0;  ///< open blocks of one set of bins
    uint64_t binBytes = 0;     ///< a bin
    uint64_t pageBytes = 0;    ///< a bin's mesh and its pages under construction, all threads together
    uint64_t fixedBytes = 0;   ///< the rest: fixedMemoryBytes
    uint64_t usableBytes = 0;  ///< what is divided

    /// Returns the most triangles of a bin. `withImages`: they have places in images.
    [[nodiscard]] uint64_t binTriangles(bool withImages) const;
    /// Most pages that may be counted before they are chosen: then nothing else takes memory.
    [[nodiscard]] uint64_t mostCountedPages() const;
};

/// Returns half of the machine's memory, or of the control group's limit when that is less.
uint64_t defaultMemoryBytes();

/// Returns the bytes that a build takes whatever its input: the program, its readers and its threads.
uint64_t fixedMemoryBytes(unsigned threads);

/// Divides the memory. Errors: Limit (too little to work with; the message says how much is needed).
Result<MemoryPlan> planMemory(uint64_t memoryBytes, unsigned threads);

/// Sets memory aside for the directory of so many pages that hold the mesh, and of those above them, and for what each
/// bin takes by itself. Errors: Limit (as planMemory's).
Result<MemoryPlan> planPages(MemoryPlan plan, uint64_t pages, uint64_t bins);

/// Returns the error that the memory is too little for `what`, and names what is enough. Bytes of all memory.
Error tooLittleMemory(const MemoryPlan& plan, const std::string& what, uint64_t enoughBytes);

}  // namespace vcp
