// Compute pipelines with specialization constants, and the four barriers that the passes need.
#pragma once

#include <span>

#include <vulkan/vulkan_core.h>

#include "octree/io/result.h"
#include "render/vulkan/device.h"

namespace vcp {

/// A compute pipeline. Move-only; destroyed before the device.
class ComputePipeline {
public:
    /// `constants[i]` is the value of constant_id i. Errors: Device.
    static Result<ComputePipeline> create(const Device& device, VkPipelineLayout layout,
                                          std::span<const uint32_t> spirv, std::span<const uint32_t> constants);
    ComputePipeline() = default;
    ~ComputePipeline() { destroy(); }
    ComputePipeline(ComputePipeline&& other) noexcept { *this = std::move(other); }
    ComputePipeline& operator=(ComputePipeline&& other) noexcept;

    [[nodiscard]] VkPipeline handle() const { return pipeline_; }

private:
    void destroy();
    VkDevice device_ = VK_NULL_HANDLE;
    VkPipeline pipeline_ = VK_NULL_HANDLE;
};

/// Lets shaders and copies after it begin when those before it have ended, and see what they wrote.
void barrierToAll(VkCommandBuffer commands);
/// Makes what compute shaders wrote visible to compute shaders and indirect dispatches.
void barrierComputeToCompute(VkCommandBuffer commands);
/// Makes what compute shaders wrote visible to copies and the CPU.
void barrierComputeToReadback(VkCommandBuffer commands);
/// Makes what was copied visible to the CPU.
void barrierTransferToHost(VkCommandBuffer commands);

}  // namespace vcp
