#include "render/passes/light.h"

#include "render/light_spirv.h"

namespace vcp {

LightPass::LightPass() : pipelines_(kLightSpirv) {}

Result<void> LightPass::prepare(FrameResources& resources, const PassConstants& constants) {
    PassConstants plain = constants;
    plain.colour = plain.countSteps = plain.falseColour = false;
    return pipelines_.choose(resources, plain);
}

void LightPass::record(VkCommandBuffer commands, const FrameResources& resources, TileRange tiles) const {
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipelines_.current());
    resources.dispatchTiles(commands, tiles);
    barrierComputeToCompute(commands);
}

}  // namespace vcp
