// Makes the picture from the hits (shaders/shade.comp).
// Reads constants, tile list and starts, hits. Writes the picture's hit pixels. Before: the trace pass, with
// ShadeLight::Own also the light pass. After: barrierComputeToReadback, recorded here.
#pragma once

#include "render/passes/frame_resources.h"

namespace vcp {

/// Where the light of the hits is.
enum class ShadeLight : uint32_t {
    None = 0,
    Own = 1,    ///< in the hits (passes/light.h)
    Scene = 2,  ///< in the target (passes/scene_light.h), which the pass then writes as well
};

class ShadePass {
public:
    ShadePass();
    /// Makes the variant's pipeline on first use. Errors: Device.
    Result<void> prepare(FrameResources& resources, const PassConstants& constants, ShadeLight light);
    /// Precondition: prepare().
    void record(VkCommandBuffer commands, const FrameResources& resources) const;
    /// Forgets the pipelines, before pools with another layout come.
    void clear() { pipelines_.clear(); }

private:
    PipelineVariants pipelines_;
};

}  // namespace vcp
