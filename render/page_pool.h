// Pages in the device's memory: a fixed number of bytes, taken once, in chunks of at most 1 GiB that shaders see as
// texels of 16 bytes. Where the CPU can write the device's memory, pages go straight into their slots, once the frames
// in flight, which could read them, have ended. Elsewhere pages go through staging buffers, many with one submission,
// on the queue for copies where there is one; the copies run after the frames that were submitted before them, and
// before those after. Which page has which slot is decided elsewhere (streaming/residency_policy.h).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "render/pages/page_memory.h"
#include "render/vulkan/device.h"

namespace vcp {

class PagePool final : public PageMemory {
public:
    /// Takes at most `bytes`, rounded down to units. Errors: Device; Limit, where shaders could not address it.
    static Result<std::unique_ptr<PagePool>> create(Device& device, uint64_t bytes, PageAccess access);
    ~PagePool() override;

    Result<void> write(PoolSlot slot, uint64_t at, std::span<const std::byte> bytes) override;
    Result<void> flush() override;
    Result<void> read(PoolSlot slot, uint64_t at, std::span<std::byte> bytes) override;
    Result<void> move(PoolSlot from, PoolSlot to) override;
    [[nodiscard]] uint64_t bytes() const override { return bytes_; }
    [[nodiscard]] std::span<const std::byte> bytesOf(PoolSlot slot) const override;

    [[nodiscard]] uint32_t chunks() const { return uint32_t(chunks_.size()); }
    [[nodiscard]] uint32_t chunkShift() const { return chunkShift_; }
    [[nodiscard]] const Buffer& chunk(uint32_t i) const { return chunks_[i].buffer; }
    [[nodiscard]] VkBufferView view(uint32_t i) const { return chunks_[i].view.handle(); }

private:
    struct Chunk {
        Buffer buffer;
        TexelView view;
    };
    PagePool(Device& device, uint64_t bytes) : device_(device), bytes_(bytes) {}
    [[nodiscard]] uint64_t chunkBytes() const { return uint64_t{16} << chunkShift_; }
    /// A copy from the staging buffer to a chunk, or within a chunk through the scratch buffer.
    struct StagedCopy {
        uint64_t chunk = 0;
        VkBufferCopy region{};
        bool isMove = false;
        bool isOrdered = false;  // it writes what a copy before it writes
    };
    /// What an update brings lies here until its copies have ended, while the next update fills the other one.
    struct Staging {
        Buffer buffer;
        uint64_t copies = 0;  // the last that read it
    };
    void recordMove(VkCommandBuffer commands, const StagedCopy& move) const;
    Result<void> reserveStaging(uint64_t bytes);
    [[nodiscard]] bool overlapsWaiting(uint64_t chunk, uint64_t at, uint64_t bytes) const;

    Device& device_;
    uint64_t bytes_;
    std::vector<Chunk> chunks_;
    uint32_t chunkShift_ = 0;
    Staging stagings_[2];
    size_t filling_ = 0;  // number of the staging buffer that takes pages now
    uint64_t stagedBytes_ = 0;
    Buffer scratch_;                   // as large as the largest move: regions of one copy must not overlap
    std::vector<StagedCopy> waiting_;  // in order; not submitted yet
};

/// Returns the largest chunk that shaders of this device can address whole, a power of two of at most 1 GiB.
uint64_t poolChunkBytes(const VkPhysicalDeviceLimits& limits, PageAccess access);

/// Gives pools of a device, which must outlive them.
PageMemorySource poolsOf(Device& device, PageAccess access);

}  // namespace vcp
