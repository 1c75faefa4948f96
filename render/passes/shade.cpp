#include "render/passes/shade.h"

#include "render/shade_spirv.h"

namespace vcp {

ShadePass::ShadePass() : pipelines_(kShadeSpirv) {}

Result<void> ShadePass::prepare(FrameResources& resources, const PassConstants& constants, ShadeLight light) {
    PassConstants plain = constants;
    plain.countSteps = plain.seams = false;
    plain.images = constants.channels;
    return pipelines_.choose(resources, plain, {uint32_t(light)});
}

void ShadePass::record(VkCommandBuffer commands, const FrameResources& resources) const {
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipelines_.current());
    vkCmdDispatchIndirect(commands, resources.tileList().handle(), 0);
    barrierComputeToReadback(commands);
}

}  // namespace vcp
