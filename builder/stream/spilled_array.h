// SpilledArray: items by number (texture coordinates, normals), appended one after another and looked up in any order,
// in bounded memory: what is beyond 4 Mi items lies in a temporary file, behind a cache of as much.
#pragma once

#include <cstdint>
#include <filesystem>
#include <type_traits>
#include <utility>
#include <vector>

#include "builder/stream/random_bytes.h"
#include "octree/io/result.h"

namespace vcp {

template <class Item>
class SpilledArray {
    static_assert(std::is_trivially_copyable_v<Item>);

public:
    static constexpr size_t kBlock = 8192;  ///< items read at once

    /// `memoryBlocks`: blocks kept in memory. `folder` as for Spool.
    explicit SpilledArray(std::filesystem::path folder, size_t memoryBlocks = 512)
        : spool_(std::move(folder), memoryBlocks * kBlockBytes), slots_(memoryBlocks) {}

    [[nodiscard]] uint64_t size() const { return size_; }

    /// Appends an item. Errors: Io.
    Result<void> append(const Item& item) {
        tail_.push_back(item);
        ++size_;
        if (tail_.size() < kBlock) return {};
        VCP_TRY(spool_.append({reinterpret_cast<const char*>(tail_.data()), kBlockBytes}));
        tail_.clear();
        return {};
    }

    /// Returns an item by number. Precondition: number < size(). Errors: Io.
    Result<Item> at(uint64_t number) {
        const uint64_t block = number / kBlock;
        const size_t item = number % kBlock;
        if (block == (size_ - tail_.size()) / kBlock) return tail_[item];
        Slot& slot = slots_[block % slots_.size()];
        if (slot.block != block) {
            slot.items.resize(kBlock);
            slot.block = ~uint64_t{0};
            VCP_TRY(spool_.read(block * kBlockBytes, reinterpret_cast<char*>(slot.items.data()), kBlockBytes));
            slot.block = block;
        }
        return slot.items[item];
    }

private:
    static constexpr size_t kBlockBytes = kBlock * sizeof(Item);

    struct Slot {
        uint64_t block = ~uint64_t{0};
        std::vector<Item> items;
    };

    Spool spool_;              // whole blocks
    std::vector<Item> tail_;   // the last block, until it is whole
    std::vector<Slot> slots_;  // block b is cached in slot b % slots
    uint64_t size_ = 0;
};

}  // namespace vcp
