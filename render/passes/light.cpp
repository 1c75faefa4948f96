#include "render/passes/light.h"

#include "render/light_spirv.h"

namespace vcp {

Result<void> LightPass::prepare(FrameResources& resources, const PassConstants& constants) {
    if (pipeline_.handle() != VK_NULL_HANDLE) return {};
    PassConstants plain = constants;
    plain.colour = plain.countSteps = false;
    auto made = resources.pipeline(kLightSpirv, plain);
    if (!made) return made.error();
    pipeline_ = std::move(*made);
    return {};
}

void LightPass::record(VkCommandBuffer commands, const FrameResources& resources) const {
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline_.handle());
    vkCmdDispatchIndirect(commands, resources.tileList().handle(), 0);
    barrierComputeToCompute(commands);
}

}  // namespace vcp
