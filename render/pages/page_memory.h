// Memory for pages: what the residency (residency.h) needs of it. A fixed number of bytes, taken once, in slots of
// whole units; which page has which slot is decided elsewhere (streaming/residency_policy.h).
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>

#include "octree/io/result.h"
#include "streaming/slot_allocator.h"

namespace vcp {

class PageMemory {
public:
    virtual ~PageMemory() = default;

    /// Writes at byte `at` of a slot, at the latest with flush(). Precondition: the bytes fit into the slot and are
    /// multiples of 16. Errors: Device.
    virtual Result<void> write(PoolSlot slot, uint64_t at, std::span<const std::byte> bytes) = 0;
    /// Makes what was written visible to all that is drawn later, and waits for nothing. Errors: Device.
    virtual Result<void> flush() = 0;
    /// Reads from byte `at` of a slot; preconditions as for write(). Errors: Device.
    virtual Result<void> read(PoolSlot slot, uint64_t at, std::span<std::byte> bytes) = 0;
    /// Copies a slot's bytes, at the latest with flush(), in order with what is written; both slots are in one chunk
    /// and may overlap. Errors: Device.
    virtual Result<void> move(PoolSlot from, PoolSlot to) = 0;
    [[nodiscard]] virtual uint64_t bytes() const = 0;
    /// Returns a slot's bytes, 16-byte aligned, valid as long as the slot stays where it is; nothing where the
    /// processor does not see the memory.
    [[nodiscard]] virtual std::span<const std::byte> bytesOf(PoolSlot slot) const = 0;
};

/// Where memory for pages comes from.
struct PageMemorySource {
    uint64_t chunkBytes = 0;  ///< no slot crosses a multiple of it
    /// Takes at most so many bytes, rounded down to units. Errors: Device; Limit, where it could not be addressed.
    std::function<Result<std::unique_ptr<PageMemory>>(uint64_t bytes)> take;
};

}  // namespace vcp
