#include "render/passes/scene_light.h"

#include "render/scene_light_spirv.h"

namespace vcp {

SceneLightPass::SceneLightPass() : pipelines_(kSceneLightSpirv) {}

Result<void> SceneLightPass::prepare(FrameResources& resources, const PassConstants& constants) {
    PassConstants plain = constants;
    plain.colour = plain.countSteps = plain.falseColour = false;
    return pipelines_.choose(resources, plain);
}

void SceneLightPass::record(VkCommandBuffer commands, const FrameResources& resources, const frame::SceneRay& ray,
                            TileRange tiles) const {
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipelines_.current());
    vkCmdPushConstants(commands, resources.layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof ray, &ray);
    resources.dispatchAnyTiles(commands, tiles);
    barrierComputeToCompute(commands);
}

}  // namespace vcp
