// Traces the light of a picture of several datasets, and of mesostructure: each shades all (shaders/scene_light.comp).
//
// Once all datasets are traced, their nearest hits are gathered (passes/compose.h): depth, normal, and by how much rays
// of light begin above. Then comes a dispatch for each ray of a pixel and each dataset, with the dataset's descriptor
// set, over all tiles: rays into the sky first, each of which keeps how far it comes from one dataset to the next, then
// the sun's. Reads and writes the target's light. Before: the gathering. After: barrierComputeToCompute, recorded here.
// A picture that one dataset alone shades has no such pass (passes/light.h).
#pragma once

#include "render/passes/frame_resources.h"

namespace vcp {

class SceneLightPass {
public:
    SceneLightPass();
    /// `resources`: of the dataset that rays go through. Makes the pipeline on first use. Errors: Device.
    Result<void> prepare(FrameResources& resources, const PassConstants& constants);
    /// `tiles`: of all tiles of the picture. Precondition: prepare(), and the resources' set is bound.
    void record(VkCommandBuffer commands, const FrameResources& resources, const frame::SceneRay& ray,
                TileRange tiles) const;
    /// Forgets the pipelines, before pools with another layout come.
    void clear() { pipelines_.clear(); }

private:
    PipelineVariants pipelines_;
};

}  // namespace vcp
