// Decides where pages go in a pool: runs of units, first fit. Pure bookkeeping.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace vcp {

/// Slots are taken in whole units of 16 KiB.
inline constexpr uint64_t kPoolUnitBytes = 16384;

constexpr uint64_t unitsOf(uint64_t bytes) { return (bytes + kPoolUnitBytes - 1) / kPoolUnitBytes; }

struct PoolSlot {
    uint64_t firstUnit = 0, units = 0;

    [[nodiscard]] uint64_t end() const { return firstUnit + units; }
    bool operator==(const PoolSlot&) const = default;
};

class SlotAllocator {
public:
    /// The pool has `units` in all; a slot never crosses a multiple of `unitsPerChunk`.
    SlotAllocator(uint64_t units, uint64_t unitsPerChunk);

    /// Takes the lowest run of `units` free ones, or returns nothing. Precondition: units > 0.
    std::optional<PoolSlot> allocate(uint64_t units);
    /// Takes a given slot. Precondition: all of it is free and in one chunk.
    void take(PoolSlot slot);
    /// Frees a slot. Precondition: all of it is taken.
    void release(PoolSlot slot);

    [[nodiscard]] uint64_t units() const { return taken_.size(); }
    [[nodiscard]] uint64_t unitsPerChunk() const { return unitsPerChunk_; }
    [[nodiscard]] uint64_t unitsTaken() const { return unitsTaken_; }
    [[nodiscard]] uint64_t unitsFree() const { return units() - unitsTaken_; }
    [[nodiscard]] uint64_t bytesHeld() const { return taken_.capacity() / 8; }

private:
    std::vector<bool> taken_;
    uint64_t unitsPerChunk_;
    uint64_t unitsTaken_ = 0;
};

}  // namespace vcp
