// Pages in the device's memory: a fixed number of bytes, taken once, in chunks of at most 1 GiB that
// shaders see as texels of 16 bytes. Where the CPU can write the device's memory, pages go straight into
// their slots; elsewhere through a staging buffer and a copy. A slot is written only while no frame that
// could read it is in flight: the renderer waits for each frame.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "render/slot_allocator.h"
#include "render/vulkan/device.h"

namespace vcp {

struct PoolSlot {
    uint64_t firstUnit = 0, units = 0;
};

class PagePool {
public:
    /// At most `bytes`, rounded down to units. Errors: Device; Limit, where shaders could not address it.
    static Result<std::unique_ptr<PagePool>> create(Device& device, uint64_t bytes, PageAccess access);
    ~PagePool();

    std::optional<PoolSlot> allocate(uint64_t bytes) ;
    void release(PoolSlot slot) { slots_.release(slot.firstUnit, slot.units); }
    /// Precondition: bytes fit into the slot and are a multiple of 16. Errors: Device.
    Result<void> write(PoolSlot slot, std::span<const std::byte> bytes);

    /// Number of the slot's first texel, over all chunks.
    [[nodiscard]] uint32_t texel(PoolSlot slot) const { return static_cast<uint32_t>(slot.firstUnit * (kPoolUnitBytes / 16)); }
    [[nodiscard]] uint64_t bytes() const { return slots_.units() * kPoolUnitBytes; }
    [[nodiscard]] uint64_t bytesTaken() const { return slots_.unitsTaken() * kPoolUnitBytes; }

    [[nodiscard]] uint32_t chunks() const { return static_cast<uint32_t>(chunks_.size()); }
    [[nodiscard]] uint32_t chunkShift() const { return chunkShift_; }
    [[nodiscard]] const Buffer& chunk(uint32_t i) const { return chunks_[i].buffer; }
    [[nodiscard]] VkBufferView view(uint32_t i) const { return chunks_[i].view.handle(); }

private:
    struct Chunk {
        Buffer buffer;
        TexelView view;
    };
    PagePool(Device& device, SlotAllocator slots) : device_(device), slots_(std::move(slots)) {}

    Device& device_;
    SlotAllocator slots_;
    std::vector<Chunk> chunks_;
    uint32_t chunkShift_ = 0;
    Buffer staging_;
};

/// Largest chunk that shaders of this device can address whole, a power of two of at most 1 GiB.
uint64_t poolChunkBytes(const VkPhysicalDeviceLimits& limits, PageAccess access);

}  // namespace vcp
