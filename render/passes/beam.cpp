#include "render/passes/beam.h"

#include "render/beam_spirv.h"

namespace vcp {

BeamPass::BeamPass() : pipelines_(kBeamSpirv) {}

Result<void> BeamPass::prepare(FrameResources& resources, const PassConstants& constants, bool beam) {
    PassConstants plain = constants;
    plain.colour = plain.countSteps = plain.falseColour = plain.seams = false;
    return pipelines_.choose(resources, plain, {beam ? 1u : 0u});
}

void BeamPass::record(VkCommandBuffer commands, const FrameResources& resources) const {
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipelines_.current());
    vkCmdDispatch(commands, (resources.size().tilesX() + 7) / 8, (resources.size().tilesY() + 7) / 8, 1);
    barrierComputeToCompute(commands);
}

}  // namespace vcp
