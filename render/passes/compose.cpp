#include "render/passes/compose.h"

#include <bit>

#include "render/compose_spirv.h"
#include "render/passes/readback.h"

namespace vcp {

Result<void> ComposeTarget::resize(Device& device, PictureSize size) {
    if (size == size_) return {};
    auto depths = device.createBuffer(
        (size.pixels() + 1) * 4,
        VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
        MemoryUse::Local);
    if (!depths) return depths.error();
    depths_ = std::move(*depths);
    size_ = size;
    return {};
}

void ComposeTarget::clear(VkCommandBuffer commands) const {
    const uint64_t bytes = size_.pixels() * 4;
    vkCmdFillBuffer(commands, depths_.handle(), 0, bytes, std::bit_cast<uint32_t>(frame::kNoHit));
    vkCmdFillBuffer(commands, depths_.handle(), bytes, 4, 0);
    barrierTransferToAll(commands);
}

Result<uint32_t> ComposeTarget::hitPixels(Device& device) const {
    auto count = readWords(device, depths_, size_.pixels(), 1);
    if (!count) return count.error();
    return count->front();
}

ComposePass::ComposePass() : pipelines_(kComposeSpirv) {}

Result<void> ComposePass::prepare(FrameResources& resources, const PassConstants& constants) {
    PassConstants plain = constants;
    plain.colour = plain.countSteps = plain.falseColour = false;
    return pipelines_.choose(resources, plain);
}

void ComposePass::record(VkCommandBuffer commands, const FrameResources& resources) const {
    barrierComputeToCompute(commands);
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipelines_.current());
    vkCmdDispatchIndirect(commands, resources.tileList().handle(), 0);
    barrierComputeToReadback(commands);
}

}  // namespace vcp
