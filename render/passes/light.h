// Traces shadows and ambient occlusion of the hits (shaders/light.comp).
// Reads constants, pools, table, tile list, hits. Writes the hits' plane of light. Before: the trace pass. After:
// barrierComputeToCompute, recorded here. A frame without both has no such pass.
#pragma once

#include "render/passes/frame_resources.h"

namespace vcp {

class LightPass {
public:
    LightPass();
    /// Makes the pipeline on first use. Errors: Device.
    Result<void> prepare(FrameResources& resources, const PassConstants& constants);
    /// Precondition: prepare().
    void record(VkCommandBuffer commands, const FrameResources& resources, TileRange tiles) const;
    /// Forgets the pipelines, before pools with another layout come.
    void clear() { pipelines_.clear(); }

private:
    PipelineVariants pipelines_;
};

}  // namespace vcp
