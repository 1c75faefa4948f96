// Finds start distances of tiles and lists the tiles that are not empty (shaders/beam.comp).
// Reads constants, pool, table. Writes tile starts, tile list. Before: FrameResources::begin. After:
// barrierComputeToCompute, recorded here.
#pragma once

#include "render/passes/frame_resources.h"

namespace vcp {

class BeamPass {
public:
    BeamPass();
    /// Makes the variant's pipeline on first use. Errors: Device.
    Result<void> prepare(FrameResources& resources, const PassConstants& constants, bool beam);
    /// Precondition: prepare().
    void record(VkCommandBuffer commands, const FrameResources& resources) const;
    /// Forgets the pipelines, before pools with another layout come.
    void clear() { pipelines_.clear(); }

private:
    PipelineVariants pipelines_;
};

}  // namespace vcp
