#include "render/passes/trace.h"

#include "render/trace_spirv.h"

namespace vcp {

Result<void> TracePass::prepare(FrameResources& resources, const PassConstants& constants, SectionKind sections) {
    ComputePipeline& variant = variants_[{constants.colour, constants.countSteps, static_cast<uint32_t>(sections)}];
    if (variant.handle() == VK_NULL_HANDLE) {
        const uint32_t more[] = {static_cast<uint32_t>(sections)};
        auto made = resources.pipeline(kTraceSpirv, constants, more);
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
