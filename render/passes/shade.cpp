#include "render/passes/shade.h"

#include "render/shade_spirv.h"

namespace vcp {

Result<void> ShadePass::prepare(FrameResources& resources, const PassConstants& constants) {
    ComputePipeline& variant = variants_[{constants.colour, false, false}];
    if (variant.handle() == VK_NULL_HANDLE) {
        PassConstants plain = constants;
        plain.countSteps = false;
        auto made = resources.pipeline(kShadeSpirv, plain);
        if (!made) return made.error();
        variant = std::move(*made);
    }
    current_ = &variant;
    return {};
}

void ShadePass::record(VkCommandBuffer commands, const FrameResources& resources) const {
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, current_->handle());
    vkCmdDispatchIndirect(commands, resources.tileList().handle(), 0);
    barrierComputeToReadback(commands);
}

}  // namespace vcp
