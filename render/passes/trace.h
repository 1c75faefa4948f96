// Finds the first hits of the pixels of listed tiles (shaders/trace.comp).
// Reads constants, pools, table, tile starts and list. Writes hits, counters. Before: the beam pass. After:
// barrierComputeToCompute, recorded here.
#pragma once

#include "render/frame_setup.h"
#include "render/passes/frame_resources.h"

namespace vcp {

class TracePass {
public:
    TracePass();
    /// Makes the variant's pipeline on first use. Errors: Device.
    Result<void> prepare(FrameResources& resources, const PassConstants& constants, SectionKind sections);
    /// Precondition: prepare().
    void record(VkCommandBuffer commands, const FrameResources& resources, TileRange tiles) const;
    /// Forgets the pipelines, before pools with another layout come.
    void clear() { pipelines_.clear(); }

private:
    PipelineVariants pipelines_;
};

}  // namespace vcp
