// Memory for pages that the processor casts rays through: plain memory, in slots like a device's pool.
#pragma once

#include "octree/page/page.h"
#include "render/pages/page_memory.h"

namespace vcp {

class HostPageMemory final : public PageMemory {
public:
    /// Takes `bytes`, rounded down to units; what no page was written to costs nothing. Errors: Device, where there is
    /// not so much memory; Limit, where there is no room for a unit.
    static Result<std::unique_ptr<HostPageMemory>> create(uint64_t bytes);

    Result<void> write(PoolSlot slot, uint64_t at, std::span<const std::byte> bytes) override;
    Result<void> flush() override { return {}; }
    Result<void> read(PoolSlot slot, uint64_t at, std::span<std::byte> bytes) override;
    Result<void> move(PoolSlot from, PoolSlot to) override;
    [[nodiscard]] uint64_t bytes() const override { return bytes_; }
    [[nodiscard]] std::span<const std::byte> bytesOf(PoolSlot slot) const override;

private:
    HostPageMemory(uint64_t bytes, std::unique_ptr<std::byte[]> memory) : bytes_(bytes), memory_(std::move(memory)) {}

    uint64_t bytes_;
    std::unique_ptr<std::byte[]> memory_;
};

/// Gives such memory.
PageMemorySource hostPageMemory();

}  // namespace vcp
