#include "render/page_pool.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include "render/shared/frame.h"
#include "render/vulkan/compute_pipeline.h"

namespace vcp {

namespace {

// Size of a staging buffer: what an update brings, in one submission; more where a page is larger.
constexpr uint64_t kStagingBytes = 16ull << 20;
// Larger than most pages, so that the buffer for moves is seldom made anew.
constexpr uint64_t kLeastScratch = 1ull << 20;

/// Copies before it are done before copies after it begin; it works on queues for copies only, too.
void keepOrder(VkCommandBuffer commands) {
    VkMemoryBarrier memory{VK_STRUCTURE_TYPE_MEMORY_BARRIER};
    memory.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
    memory.dstAccessMask = VK_ACCESS_TRANSFER_READ_BIT | VK_ACCESS_TRANSFER_WRITE_BIT;
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_TRANSFER_BIT, 0, 1, &memory, 0,
                         nullptr, 0, nullptr);
}

}  // namespace

uint64_t poolChunkBytes(const VkPhysicalDeviceLimits& limits, PageAccess access) {
    const uint64_t reach =
        access == PageAccess::TexelBuffer ? uint64_t{limits.maxTexelBufferElements} * 16 : limits.maxStorageBufferRange;
    return std::min(std::bit_floor(reach), uint64_t{1} << 30);
}

Result<std::unique_ptr<PagePool>> PagePool::create(Device& device, uint64_t bytes, PageAccess access) {
    const uint64_t chunkBytes = poolChunkBytes(device.limits(), access);
    const uint64_t units = bytes / kPoolUnitBytes;
    if (units == 0) return Error{.code = ErrorCode::Limit, .message = "the budget has no room for a page"};
    if (units * kPoolUnitBytes > chunkBytes * frame::kMaxPoolChunks)
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("a pool of {} bytes is more than shaders can address on '{}'; at most {}",
                                            bytes, device.info().name, chunkBytes * frame::kMaxPoolChunks)};
    std::unique_ptr<PagePool> pool(new PagePool(device, units * kPoolUnitBytes));
    pool->chunkShift_ = uint32_t(std::countr_zero(chunkBytes / 16));
    constexpr VkBufferUsageFlags kUsage = VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT |
                                          VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT |
                                          VK_BUFFER_USAGE_TRANSFER_SRC_BIT;
    for (uint64_t done = 0; done < pool->bytes(); done += chunkBytes) {
        Chunk chunk;
        VCP_TRY_ASSIGN(auto buffer,
                       device.createBuffer(std::min(chunkBytes, pool->bytes() - done), kUsage, MemoryUse::Local));
        chunk.buffer = std::move(buffer);
        const uint64_t viewBytes =
            std::min(chunk.buffer.bytes(), uint64_t{device.limits().maxTexelBufferElements} * 16);
        VCP_TRY_ASSIGN(chunk.view, device.createTexelView(chunk.buffer, VK_FORMAT_R32G32B32A32_UINT, viewBytes));
        pool->chunks_.push_back(std::move(chunk));
    }
    return pool;
}

PageMemorySource poolsOf(Device& device, PageAccess access) {
    return {poolChunkBytes(device.limits(), access),
            [&device, access](uint64_t bytes) -> Result<std::unique_ptr<PageMemory>> {
                VCP_TRY_ASSIGN(auto pool, PagePool::create(device, bytes, access));
                return std::unique_ptr<PageMemory>(std::move(pool));
            }};
}

PagePool::~PagePool() { static_cast<void>(device_.waitForCopies()); }

Result<void> PagePool::reserveStaging(uint64_t bytes) {
    Staging& filling = stagings_[filling_];
    VCP_TRY(device_.waitForCopies(filling.copies));
    if (filling.buffer.bytes() >= bytes) return {};
    VCP_TRY_ASSIGN(
        filling.buffer,
        device_.createBuffer(std::bit_ceil(bytes), VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                             MemoryUse::Upload));
    return {};
}

bool PagePool::overlapsWaiting(uint64_t chunk, uint64_t at, uint64_t bytes) const {
    return std::any_of(waiting_.begin(), waiting_.end(), [&](const StagedCopy& copy) {
        return copy.chunk == chunk && at < copy.region.dstOffset + copy.region.size &&
               copy.region.dstOffset < at + bytes;
    });
}

Result<void> PagePool::write(PoolSlot slot, uint64_t at, std::span<const std::byte> bytes) {
    assert(at + bytes.size() <= slot.units * kPoolUnitBytes && at % 16 == 0 && bytes.size() % 16 == 0);
    const uint64_t place = slot.firstUnit * kPoolUnitBytes + at;
    const uint64_t chunk = place / chunkBytes(), to = place % chunkBytes();
    if (std::byte* mapped = chunks_[chunk].buffer.mapped()) {
        VCP_TRY(device_.waitForAll());
        std::memcpy(mapped + to, bytes.data(), bytes.size());
        return {};
    }
    if (stagedBytes_ + bytes.size() > stagings_[filling_].buffer.bytes()) VCP_TRY(flush());
    if (stagedBytes_ == 0) VCP_TRY(reserveStaging(std::max<uint64_t>(bytes.size(), std::min(kStagingBytes, bytes_))));
    std::memcpy(stagings_[filling_].buffer.mapped() + stagedBytes_, bytes.data(), bytes.size());
    waiting_.push_back({chunk, {stagedBytes_, to, bytes.size()}, false, overlapsWaiting(chunk, to, bytes.size())});
    stagedBytes_ += bytes.size();
    return {};
}

Result<void> PagePool::flush() {
    if (waiting_.empty()) return {};
    stagedBytes_ = 0;
    const std::vector<StagedCopy> copies = std::exchange(waiting_, {});
    Staging& filled = stagings_[std::exchange(filling_, 1 - filling_)];
    VCP_TRY_ASSIGN(filled.copies, device_.submitCopies([&](VkCommandBuffer commands) {
        for (const StagedCopy& copy : copies) {
            if (copy.isMove) {
                recordMove(commands, copy);
                continue;
            }
            if (copy.isOrdered) keepOrder(commands);
            vkCmdCopyBuffer(commands, filled.buffer.handle(), chunks_[copy.chunk].buffer.handle(), 1, &copy.region);
        }
    }));
    return {};
}

void PagePool::recordMove(VkCommandBuffer commands, const StagedCopy& move) const {
    const VkBuffer chunk = chunks_[move.chunk].buffer.handle();
    const VkBufferCopy out{move.region.srcOffset, 0, move.region.size}, in{0, move.region.dstOffset, move.region.size};
    keepOrder(commands);
    vkCmdCopyBuffer(commands, chunk, scratch_.handle(), 1, &out);
    keepOrder(commands);
    vkCmdCopyBuffer(commands, scratch_.handle(), chunk, 1, &in);
    keepOrder(commands);
}

Result<void> PagePool::read(PoolSlot slot, uint64_t at, std::span<std::byte> bytes) {
    assert(at + bytes.size() <= slot.units * kPoolUnitBytes);
    const uint64_t from = slot.firstUnit * kPoolUnitBytes + at;
    const Chunk& chunk = chunks_[from / chunkBytes()];
    if (const std::byte* mapped = chunk.buffer.mapped()) {
        std::memcpy(bytes.data(), mapped + from % chunkBytes(), bytes.size());
        return {};
    }
    VCP_TRY(flush());
    VCP_TRY(reserveStaging(bytes.size()));
    VCP_TRY(device_.submitAndWait([&](VkCommandBuffer commands) {
        const VkBufferCopy region{from % chunkBytes(), 0, bytes.size()};
        vkCmdCopyBuffer(commands, chunk.buffer.handle(), stagings_[filling_].buffer.handle(), 1, &region);
        barrierTransferToHost(commands);
    }));
    std::memcpy(bytes.data(), stagings_[filling_].buffer.mapped(), bytes.size());
    return {};
}

std::span<const std::byte> PagePool::bytesOf(PoolSlot slot) const {
    const uint64_t from = slot.firstUnit * kPoolUnitBytes;
    const std::byte* mapped = chunks_[from / chunkBytes()].buffer.mapped();
    if (mapped == nullptr) return {};
    return {mapped + from % chunkBytes(), slot.units * kPoolUnitBytes};
}

Result<void> PagePool::move(PoolSlot from, PoolSlot to) {
    const uint64_t bytes = from.units * kPoolUnitBytes;
    const uint64_t source = from.firstUnit * kPoolUnitBytes, target = to.firstUnit * kPoolUnitBytes;
    assert(from.units == to.units && source / chunkBytes() == target / chunkBytes());
    const Chunk& chunk = chunks_[source / chunkBytes()];
    if (std::byte* mapped = chunk.buffer.mapped()) {
        VCP_TRY(device_.waitForAll());
        std::memmove(mapped + target % chunkBytes(), mapped + source % chunkBytes(), bytes);
        return {};
    }
    if (scratch_.bytes() < bytes) {
        // Moves that use the smaller one end first.
        if (scratch_.bytes() > 0) {
            VCP_TRY(flush());
            VCP_TRY(device_.waitForCopies());
        }
        VCP_TRY_ASSIGN(scratch_,
                       device_.createBuffer(std::bit_ceil(std::max(bytes, kLeastScratch)),
                                            VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                                            MemoryUse::Local));
    }
    waiting_.push_back({source / chunkBytes(), {source % chunkBytes(), target % chunkBytes(), bytes}, true});
    return {};
}

}  // namespace vcp
