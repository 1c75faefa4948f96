#include "render/pages/host_page_memory.h"

#include <cassert>
#include <cstring>
#include <new>

namespace vcp {

namespace {

// As a device's largest chunk (page_pool.h), so that the same pages have room.
constexpr uint64_t kChunkBytes = 1ull << 30;

}  // namespace

Result<std::unique_ptr<HostPageMemory>> HostPageMemory::create(uint64_t bytes) {
    bytes = bytes / kPoolUnitBytes * kPoolUnitBytes;
    if (bytes == 0) return Error{.code = ErrorCode::Limit, .message = "the budget has no room for a page"};
    std::unique_ptr<std::byte[]> memory(new (std::nothrow) std::byte[bytes]);
    if (!memory) return Error{.code = ErrorCode::Device, .message = "there is not enough memory for pages"};
    return std::unique_ptr<HostPageMemory>(new HostPageMemory(bytes, std::move(memory)));
}

Result<void> HostPageMemory::write(PoolSlot slot, uint64_t at, std::span<const std::byte> bytes) {
    assert(at + bytes.size() <= slot.units * kPoolUnitBytes);
    std::memcpy(memory_.get() + slot.firstUnit * kPoolUnitBytes + at, bytes.data(), bytes.size());
    return {};
}

Result<void> HostPageMemory::read(PoolSlot slot, uint64_t at, std::span<std::byte> bytes) {
    assert(at + bytes.size() <= slot.units * kPoolUnitBytes);
    std::memcpy(bytes.data(), memory_.get() + slot.firstUnit * kPoolUnitBytes + at, bytes.size());
    return {};
}

Result<void> HostPageMemory::move(PoolSlot from, PoolSlot to) {
    assert(from.units == to.units);
    std::memmove(memory_.get() + to.firstUnit * kPoolUnitBytes, memory_.get() + from.firstUnit * kPoolUnitBytes,
                 from.units * kPoolUnitBytes);
    return {};
}

std::span<const std::byte> HostPageMemory::bytesOf(PoolSlot slot) const {
    return {memory_.get() + slot.firstUnit * kPoolUnitBytes, slot.units * kPoolUnitBytes};
}

PageMemorySource hostPageMemory() {
    return {kChunkBytes, [](uint64_t bytes) -> Result<std::unique_ptr<PageMemory>> {
                VCP_TRY_ASSIGN(auto made, HostPageMemory::create(bytes));
                return std::unique_ptr<PageMemory>(std::move(made));
            }};
}

}  // namespace vcp
