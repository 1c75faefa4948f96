// Start distances of tiles and the list of tiles that are not empty (shaders/beam.comp).
// Reads constants, pool, table. Writes tile starts, tile list. Before: FrameResources::begin. After:
// barrierComputeToCompute, recorded here.
#pragma once

#include <map>
#include <tuple>

#include "render/passes/frame_resources.h"

namespace vcp {

class BeamPass {
public:
    /// Makes the variant's pipeline on first use. Errors: Device.
    Result<void> prepare(FrameResources& resources, const PassConstants& constants, bool beam);
    /// Precondition: prepare().
    void record(VkCommandBuffer commands, const FrameResources& resources) const;
    /// Forgets all variants: pools with another layout are to come.
    void clear() { variants_.clear(); }

private:
    std::map<std::tuple<bool, bool, bool>, ComputePipeline> variants_;
    const ComputePipeline* current_ = nullptr;
};

}  // namespace vcp
