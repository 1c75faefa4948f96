#include "render/passes/paper_trace.h"

#include "render/paper_trace_spirv.h"

namespace vcp {

PaperTracePass::PaperTracePass() : pipelines_(kPaperTraceSpirv) {}

Result<void> PaperTracePass::prepare(FrameResources& resources, const PassConstants& constants, bool sections,
                                     const PaperMarch& march) {
    return pipelines_.choose(resources, constants,
                             {sections ? 1u : 0u, uint32_t(march.scheme), uint32_t(march.step), march.back ? 1u : 0u,
                              march.cached ? 1u : 0u});
}

void PaperTracePass::record(VkCommandBuffer commands, const FrameResources& resources) const {
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipelines_.current());
    vkCmdDispatchIndirect(commands, resources.tileList().handle(), 0);
    barrierComputeToCompute(commands);
}

}  // namespace vcp
