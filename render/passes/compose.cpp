#include "render/passes/compose.h"

#include <bit>
#include <cstring>

#include "render/compose_spirv.h"

namespace vcp {

Result<bool> ComposeTarget::resize(Device& device, PictureSize size, bool lit) {
    if (size == size_ && lit == (light_.bytes() > 0)) return false;
    if (lit) {
        VCP_TRY_ASSIGN(light_, device.createBuffer(size.pixels() * 4 * frame::kScenePlanes,
                                                   VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, MemoryUse::Local));
    }
    if (!lit) light_ = {};
    if (size == size_) return true;
    VCP_TRY_ASSIGN(auto depths,
                   device.createBuffer((size.pixels() + 1) * 4,
                                       VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT |
                                           VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                                       MemoryUse::Local));
    if (counted_.bytes() == 0) {
        VCP_TRY_ASSIGN(counted_, device.createBuffer(4, VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryUse::Readback));
    }
    depths_ = std::move(depths);
    size_ = size;
    return true;
}

void ComposeTarget::clear(VkCommandBuffer commands) const {
    const uint64_t bytes = size_.pixels() * 4;
    vkCmdFillBuffer(commands, depths_.handle(), 0, bytes, std::bit_cast<uint32_t>(frame::kNoHit));
    vkCmdFillBuffer(commands, depths_.handle(), bytes, 4, 0);
    barrierToAll(commands);
}

void ComposeTarget::recordReadback(VkCommandBuffer commands) const {
    const VkBufferCopy count{size_.pixels() * 4, 0, 4};
    vkCmdCopyBuffer(commands, depths_.handle(), counted_.handle(), 1, &count);
    barrierTransferToHost(commands);
}

uint32_t ComposeTarget::hitPixels() const {
    uint32_t count;
    std::memcpy(&count, counted_.mapped(), sizeof count);
    return count;
}

ComposePass::ComposePass() : pipelines_(kComposeSpirv) {}

Result<void> ComposePass::prepare(FrameResources& resources, const PassConstants& constants, bool gathers) {
    PassConstants plain = constants;
    plain.colour = plain.countSteps = plain.falseColour = plain.seams = false;
    return pipelines_.choose(resources, plain, {gathers ? 1u : 0u});
}

void ComposePass::record(VkCommandBuffer commands, const FrameResources& resources) const {
    barrierComputeToCompute(commands);
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipelines_.current());
    vkCmdDispatchIndirect(commands, resources.tileList().handle(), 0);
    barrierComputeToReadback(commands);
}

}  // namespace vcp
