// Makes the picture from the hits (shaders/shade.comp).
// Reads constants, tile list and starts, hits. Writes the picture's hit pixels. Before: the trace pass, with
// `light` also the light pass. After: barrierComputeToReadback, recorded here.
#pragma once

#include "render/passes/frame_resources.h"

namespace vcp {

class ShadePass {
public:
    ShadePass();
    /// Makes the variant's pipeline on first use. Errors: Device.
    Result<void> prepare(FrameResources& resources, const PassConstants& constants, bool light);
    /// Precondition: prepare().
    void record(VkCommandBuffer commands, const FrameResources& resources) const;
    /// Forgets the pipelines, before pools with another layout come.
    void clear() { pipelines_.clear(); }

private:
    PipelineVariants pipelines_;
};

}  // namespace vcp
