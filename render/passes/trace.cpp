#include "render/passes/trace.h"

#include "render/trace_spirv.h"

namespace vcp {

TracePass::TracePass() : pipelines_(kTraceSpirv) {}

Result<void> TracePass::prepare(FrameResources& resources, const PassConstants& constants, SectionKind sections) {
    return pipelines_.choose(resources, constants, {uint32_t(sections)});
}

void TracePass::record(VkCommandBuffer commands, const FrameResources& resources, TileRange tiles) const {
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipelines_.current());
    resources.dispatchTiles(commands, tiles);
    barrierComputeToCompute(commands);
}

}  // namespace vcp
