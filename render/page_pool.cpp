#include "render/page_pool.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>

#include <fmt/format.h>

#include "render/frame.h"

namespace vcp {

uint64_t poolChunkBytes(const VkPhysicalDeviceLimits& limits, PageAccess access) {
    const uint64_t reach = access == PageAccess::TexelBuffer ? uint64_t{limits.maxTexelBufferElements} * 16 : limits.maxStorageBufferRange;
    return std::min(std::bit_floor(reach), uint64_t{1} << 30);
}

Result<std::unique_ptr<PagePool>> PagePool::create(Device& device, uint64_t bytes, PageAccess access) {
    const uint64_t chunkBytes = poolChunkBytes(device.limits(), access);
    const uint64_t units = bytes / kPoolUnitBytes;
    if (units == 0) return Error{.code = ErrorCode::Limit, .message = "the budget has no room for a page"};
    if (units * kPoolUnitBytes > chunkBytes * frame::kMaxPoolChunks)
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("a pool of {} bytes is more than shaders can address on '{}'; at most {}", bytes,
                                            device.info().name, chunkBytes * frame::kMaxPoolChunks)};
    std::unique_ptr<PagePool> pool(new PagePool(device, SlotAllocator(units, chunkBytes / kPoolUnitBytes)));
    pool->chunkShift_ = static_cast<uint32_t>(std::countr_zero(chunkBytes / 16));
    constexpr VkBufferUsageFlags kUsage =
        VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT | VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
    for (uint64_t done = 0; done < pool->bytes(); done += chunkBytes) {
        Chunk chunk;
        auto buffer = device.createBuffer(std::min(chunkBytes, pool->bytes() - done), kUsage, MemoryUse::Local);
        if (!buffer) return buffer.error();
        chunk.buffer = std::move(*buffer);
        const uint64_t viewBytes = std::min(chunk.buffer.bytes(), uint64_t{device.limits().maxTexelBufferElements} * 16);
        auto view = device.createTexelView(chunk.buffer, VK_FORMAT_R32G32B32A32_UINT, viewBytes);
        if (!view) return view.error();
        chunk.view = std::move(*view);
        pool->chunks_.push_back(std::move(chunk));
    }
    return pool;
}

PagePool::~PagePool() = default;

std::optional<PoolSlot> PagePool::allocate(uint64_t bytes) {
    const uint64_t units = unitsOf(bytes);
    const auto first = slots_.allocate(units);
    if (!first) return std::nullopt;
    return PoolSlot{*first, units};
}

Result<void> PagePool::write(PoolSlot slot, std::span<const std::byte> bytes) {
    assert(bytes.size() <= slot.units * kPoolUnitBytes && bytes.size() % 16 == 0);
    const uint64_t chunkBytes = uint64_t{16} << chunkShift_;
    const uint64_t at = slot.firstUnit * kPoolUnitBytes;
    const Chunk& chunk = chunks_[at / chunkBytes];
    if (std::byte* mapped = chunk.buffer.mapped()) {
        std::memcpy(mapped + at % chunkBytes, bytes.data(), bytes.size());
        return {};
    }
    if (staging_.bytes() < bytes.size()) {
        auto staging = device_.createBuffer(std::bit_ceil(bytes.size()), VK_BUFFER_USAGE_TRANSFER_SRC_BIT, MemoryUse::Upload);
        if (!staging) return staging.error();
        staging_ = std::move(*staging);
    }
    std::memcpy(staging_.mapped(), bytes.data(), bytes.size());
    return device_.submitAndWait([&](VkCommandBuffer commands) {
        const VkBufferCopy region{0, at % chunkBytes, bytes.size()};
        vkCmdCopyBuffer(commands, staging_.handle(), chunk.buffer.handle(), 1, &region);
    });
}

}  // namespace vcp
