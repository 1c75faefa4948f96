#include "streaming/slot_allocator.h"

#include <algorithm>
#include <cassert>

namespace vcp {

SlotAllocator::SlotAllocator(uint64_t units, uint64_t unitsPerChunk)
    : taken_(units, false), unitsPerChunk_(unitsPerChunk) {}

std::optional<PoolSlot> SlotAllocator::allocate(uint64_t units) {
    assert(units > 0);
    uint64_t run = 0;
    for (uint64_t i = 0; i < taken_.size(); ++i) {
        if (i % unitsPerChunk_ == 0) run = 0;
        run = taken_[i] ? 0 : run + 1;
        if (run < units) continue;
        const PoolSlot slot{i + 1 - units, units};
        take(slot);
        return slot;
    }
    return std::nullopt;
}

void SlotAllocator::take(PoolSlot slot) {
    for (uint64_t i = slot.firstUnit; i < slot.end(); ++i) {
        assert(!taken_[i]);
        taken_[i] = true;
    }
    unitsTaken_ += slot.units;
}

void SlotAllocator::release(PoolSlot slot) {
    for (uint64_t i = slot.firstUnit; i < slot.end(); ++i) {
        assert(taken_[i]);
        taken_[i] = false;
    }
    unitsTaken_ -= slot.units;
}

}  // namespace vcp
