#include "render/passes/readback.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <glm/geometric.hpp>

#include "render/vulkan/compute_pipeline.h"

namespace vcp {

Result<std::vector<uint32_t>> readWords(Device& device, const Buffer& source, uint64_t firstWord, uint64_t words) {
    std::vector<uint32_t> result(words);
    if (const std::byte* mapped = source.mapped()) {
        std::memcpy(result.data(), mapped + firstWord * 4, words * 4);
        return result;
    }
    VCP_TRY_ASSIGN(auto staging, device.createBuffer(words * 4, VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryUse::Readback));
    VCP_TRY(device.submitAndWait([&](VkCommandBuffer commands) {
        const VkBufferCopy region{firstWord * 4, 0, words * 4};
        vkCmdCopyBuffer(commands, source.handle(), staging.handle(), 1, &region);
        barrierTransferToHost(commands);
    }));
    std::memcpy(result.data(), staging.mapped(), words * 4);
    return result;
}

Result<std::vector<uint32_t>> readEach(Device& device, std::span<const WordPlace> places) {
    std::vector<uint32_t> result(places.size());
    std::vector<size_t> hidden;
    for (size_t i = 0; i < places.size(); ++i) {
        const std::byte* mapped = places[i].source->mapped();
        if (mapped != nullptr)
            std::memcpy(&result[i], mapped + places[i].word * 4, 4);
        else
            hidden.push_back(i);
    }
    if (hidden.empty()) return result;
    VCP_TRY_ASSIGN(auto staging,
                   device.createBuffer(hidden.size() * 4, VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryUse::Readback));
    VCP_TRY(device.submitAndWait([&](VkCommandBuffer commands) {
        for (size_t i = 0; i < hidden.size(); ++i) {
            const VkBufferCopy region{places[hidden[i]].word * 4, i * 4, 4};
            vkCmdCopyBuffer(commands, places[hidden[i]].source->handle(), staging.handle(), 1, &region);
        }
        barrierTransferToHost(commands);
    }));
    for (size_t i = 0; i < hidden.size(); ++i) std::memcpy(&result[hidden[i]], staging.mapped() + i * 4, 4);
    return result;
}

glm::vec3 unpackNormal(uint32_t code) {
    glm::vec3 n(float(code & 0xffff) / 65535.0f * 2 - 1, float(code >> 16) / 65535.0f * 2 - 1, 0);
    n.z = 1 - std::abs(n.x) - std::abs(n.y);
    const float fold = std::max(-n.z, 0.0f);
    n.x += n.x >= 0 ? -fold : fold;
    n.y += n.y >= 0 ? -fold : fold;
    return glm::normalize(n);
}

}  // namespace vcp
