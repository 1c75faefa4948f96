// Where pages go in a pool: runs of units, first fit. Pure bookkeeping.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace vcp {

/// Slots are taken in whole units of 16 KiB.
inline constexpr uint64_t kPoolUnitBytes = 16384;

constexpr uint64_t unitsOf(uint64_t bytes) { return (bytes + kPoolUnitBytes - 1) / kPoolUnitBytes; }

class SlotAllocator {
public:
    /// `units` in all; a slot never crosses a multiple of `unitsPerChunk`.
    SlotAllocator(uint64_t units, uint64_t unitsPerChunk);

    /// First unit of the lowest run of `units` free ones, or nothing. Precondition: units > 0.
    std::optional<uint64_t> allocate(uint64_t units);
    /// Precondition: allocate() gave `first` for `units`.
    void release(uint64_t first, uint64_t units);

    [[nodiscard]] uint64_t units() const { return taken_.size(); }
    [[nodiscard]] uint64_t unitsTaken() const { return unitsTaken_; }

private:
    std::vector<bool> taken_;
    uint64_t unitsPerChunk_;
    uint64_t unitsTaken_ = 0;
};

}  // namespace vcp
