// Marches lists of rays through one asset (shaders/meso_rays.comp), to be measured or compared with the reference.
// Reads the asset and the rays; writes the results. Ends with barrierComputeToReadback.
#pragma once

#include "mesostructure/march.h"
#include "render/passes/meso_resources.h"

namespace vcp {

class MesoRaysPass {
public:
    MesoRaysPass(Device& device, MesoResources& resources) : device_(device), resources_(resources) {}

    /// Uploads the arrays and the rays. Errors: Device, Limit.
    Result<void> prepare(const meso::MarchArrays& arrays, std::span<const meso::MarchRay> rays);
    /// Precondition: prepare().
    void record(VkCommandBuffer commands) const;
    Result<std::vector<meso::MarchResult>> read();

private:
    Device& device_;
    MesoResources& resources_;
    uint32_t count_ = 0;
    MesoConstants values_{};
    MesoTexels words_, rays_;
    Buffer constants_, results_, none_;
    MesoSet set_;
    VkPipeline pipeline_ = VK_NULL_HANDLE;
};

}  // namespace vcp
