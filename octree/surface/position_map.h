// An open-addressing hash map from 64-bit keys, for the decoder's inner loops. Grows; never shrinks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace vcp {

template <class Value>
class PositionMap {
public:
    explicit PositionMap(size_t expected) {
        size_t size = 16;
        while (size < 2 * expected) size *= 2;
        slots_.resize(size);
    }
    /// Returns the value of `key` (below 2^64 - 1), or null. The pointer is valid until the next findOrAdd.
    [[nodiscard]] Value* find(uint64_t key) {
        Slot& slot = slotOf(key);
        return slot.key == key + 1 ? &slot.value : nullptr;
    }
    /// Returns the value of `key`; a default value when the key is new.
    Value& findOrAdd(uint64_t key) {
        Slot* slot = &slotOf(key);
        if (slot->key == 0) {
            if (2 * ++used_ > slots_.size()) {
                grow();
                slot = &slotOf(key);
            }
            slot->key = key + 1;
        }
        return slot->value;
    }

private:
    struct Slot {
        uint64_t key = 0;  ///< the key plus 1; 0: free
        Value value{};
    };
    Slot& slotOf(uint64_t key) {
        const size_t mask = slots_.size() - 1;
        uint64_t h = key * 0x9e3779b97f4a7c15u;
        for (size_t i = (h ^ h >> 32) & mask;; i = (i + 1) & mask)
            if (slots_[i].key == key + 1 || slots_[i].key == 0) return slots_[i];
    }
    void grow() {
        std::vector<Slot> old(slots_.size() * 2);
        old.swap(slots_);
        for (const Slot& slot : old)
            if (slot.key != 0) slotOf(slot.key - 1) = slot;
    }

    std::vector<Slot> slots_;
    size_t used_ = 0;
};

}  // namespace vcp
