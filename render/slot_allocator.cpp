#include "render/slot_allocator.h"

#include <algorithm>
#include <cassert>

namespace vcp {

SlotAllocator::SlotAllocator(uint64_t units, uint64_t unitsPerChunk) : taken_(units, false), unitsPerChunk_(unitsPerChunk) {}

std::optional<uint64_t> SlotAllocator::allocate(uint64_t units) {
    assert(units > 0);
    uint64_t run = 0;
    for (uint64_t i = 0; i < taken_.size(); ++i) {
        if (i % unitsPerChunk_ == 0) run = 0;
        run = taken_[i] ? 0 : run + 1;
        if (run < units) continue;
        const uint64_t first = i + 1 - units;
        std::fill(taken_.begin() + static_cast<std::ptrdiff_t>(first), taken_.begin() + static_cast<std::ptrdiff_t>(i + 1), true);
        unitsTaken_ += units;
        return first;
    }
    return std::nullopt;
}

void SlotAllocator::release(uint64_t first, uint64_t units) {
    for (uint64_t i = first; i < first + units; ++i) {
        assert(taken_[i]);
        taken_[i] = false;
    }
    unitsTaken_ -= units;
}

}  // namespace vcp
