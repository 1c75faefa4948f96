#include "render/passes/trace.h"

#include "render/trace_spirv.h"

namespace vcp {

Result<void> TracePass::prepare(FrameResources& resources, const PassConstants& constants) {
    ComputePipeline& variant = variants_[{constants.colour, constants.countSteps, false}];
    if (variant.handle() == VK_NULL_HANDLE) {
        auto made = resources.pipeline(kTraceSpirv, constants);
        if (!made) return made.error();
        variant = std::move(*made);
    }
    current_ = &variant;
    return {};
}

void TracePass::record(VkCommandBuffer commands, const FrameResources& resources) const {
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, current_->handle());
    vkCmdDispatchIndirect(commands, resources.tileList().handle(), 0);
    barrierComputeToCompute(commands);
}

}  // namespace vcp
