#include "render/passes/beam.h"

#include "render/beam_spirv.h"

namespace vcp {

Result<void> BeamPass::prepare(FrameResources& resources, const PassConstants& constants, bool beam) {
    ComputePipeline& variant = variants_[{beam, false, false}];
    if (variant.handle() == VK_NULL_HANDLE) {
        PassConstants plain = constants;
        plain.colour = plain.countSteps = false;
        const uint32_t more[] = {beam ? 1u : 0u};
        auto made = resources.pipeline(kBeamSpirv, plain, more);
        if (!made) return made.error();
        variant = std::move(*made);
    }
    current_ = &variant;
    return {};
}

void BeamPass::record(VkCommandBuffer commands, const FrameResources& resources) const {
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, current_->handle());
    vkCmdDispatch(commands, (resources.size().tilesX() + 7) / 8, (resources.size().tilesY() + 7) / 8, 1);
    barrierComputeToCompute(commands);
}

}  // namespace vcp
