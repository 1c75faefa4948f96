#include "render/passes/shade.h"

#include "render/shade_spirv.h"

namespace vcp {

Result<void> ShadePass::prepare(FrameResources& resources, const PassConstants& constants, bool light) {
    ComputePipeline& variant = variants_[{constants.colour, false, light ? 1 : 0}];
    if (variant.handle() == VK_NULL_HANDLE) {
        PassConstants plain = constants;
        plain.countSteps = false;
        const uint32_t more[] = {light ? 1u : 0u};
        auto made = resources.pipeline(kShadeSpirv, plain, more);
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
