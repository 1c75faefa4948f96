// Values at grid points of a sparse grid: collected, then computed at once, then looked up.
#pragma once

#include <bit>
#include <cstdint>
#include <optional>
#include <vector>

#include <glm/vec3.hpp>

#include "builder/paper/parallel_rows.h"

namespace vcp {

/// An open-addressing hash table. Coordinates from 0 to 2^21 - 1.
template <class Value>
class GridPoints {
public:
    /// Adds a point, in one thread. Once fill() was called, no more points are added.
    void add(glm::ivec3 point) {
        if (4 * (count_ + 1) > 3 * slots_.size()) grow();
        uint64_t& slot = slots_[slotOf(keyOf(point))];
        if (slot == kFree) {
            slot = keyOf(point);
            ++count_;
        }
    }
    template <class Compute>
    void fill(unsigned threads, const Compute& compute) {
        fillSlots(threads, [&](size_t slot) { return compute(pointAt(slot)); });
    }
    template <class Compute>
    void fillSlots(unsigned threads, const Compute& compute) {
        values_.resize(slots_.size());
        forEachIndex(slots_.size(), threads, [&](size_t i) {
            if (isUsed(i)) values_[i] = compute(i);
        });
    }
    /// Returns a point's value; null where it was never added. After fill(), any thread.
    [[nodiscard]] const Value* find(glm::ivec3 point) const {
        const auto slot = slotAt(point);
        return slot ? &values_[*slot] : nullptr;
    }
    [[nodiscard]] size_t size() const { return count_; }

    /// Slots are numbers below slots(); not all are used. They stay the same while no point is added.
    [[nodiscard]] size_t slots() const { return slots_.size(); }
    [[nodiscard]] bool isUsed(size_t slot) const { return slots_[slot] != kFree; }
    [[nodiscard]] glm::ivec3 pointAt(size_t slot) const { return pointOf(slots_[slot]); }
    [[nodiscard]] std::optional<size_t> slotAt(glm::ivec3 point) const {
        if (slots_.empty()) return {};
        const size_t slot = slotOf(keyOf(point));
        return isUsed(slot) ? std::optional(slot) : std::nullopt;
    }

private:
    static constexpr uint64_t kFree = ~uint64_t{0};
    static uint64_t keyOf(glm::ivec3 p) { return uint64_t(p.x) | uint64_t(p.y) << 21 | uint64_t(p.z) << 42; }
    static glm::ivec3 pointOf(uint64_t key) {
        constexpr uint64_t kMask = (1u << 21) - 1;
        return {int(key & kMask), int(key >> 21 & kMask), int(key >> 42)};
    }
    [[nodiscard]] size_t slotOf(uint64_t key) const {
        const size_t mask = slots_.size() - 1;
        // The product's highest bits depend on all of the key's.
        size_t slot = size_t(key * 0x9E3779B97F4A7C15u >> (64 - std::bit_width(mask)));
        while (slots_[slot] != kFree && slots_[slot] != key) slot = (slot + 1) & mask;
        return slot;
    }
    void grow() {
        std::vector<uint64_t> old(slots_.empty() ? 1024 : 2 * slots_.size(), kFree);
        old.swap(slots_);
        for (const uint64_t key : old)
            if (key != kFree) slots_[slotOf(key)] = key;
    }

    std::vector<uint64_t> slots_;
    std::vector<Value> values_;
    size_t count_ = 0;
};

}  // namespace vcp
