#include "render/passes/readback.h"

#include <cstring>

#include "render/vulkan/compute_pipeline.h"

namespace vcp {

Result<std::vector<uint32_t>> readWords(Device& device, const Buffer& source, uint64_t firstWord, uint64_t words) {
    std::vector<uint32_t> result(words);
    if (const std::byte* mapped = source.mapped()) {
        std::memcpy(result.data(), mapped + firstWord * 4, words * 4);
        return result;
    }
    auto staging = device.createBuffer(words * 4, VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryUse::Readback);
    if (!staging) return staging.error();
    VCP_TRY(device.submitAndWait([&](VkCommandBuffer commands) {
        const VkBufferCopy region{firstWord * 4, 0, words * 4};
        vkCmdCopyBuffer(commands, source.handle(), staging->handle(), 1, &region);
        barrierTransferToHost(commands);
    }));
    std::memcpy(result.data(), staging->mapped(), words * 4);
    return result;
}

}  // namespace vcp
