// Compute pipelines with specialization constants, and the four barriers that the passes need.
#pragma once

#include <span>

#include <vulkan/vulkan_core.h>

#include "octree/result.h"
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

/// What was copied or filled is seen by shaders and copies.
void barrierTransferToAll(VkCommandBuffer commands);
/// What compute shaders wrote is seen by compute shaders and indirect dispatches.
void barrierComputeToCompute(VkCommandBuffer commands);
/// What compute shaders wrote is seen by copies and the CPU.
void barrierComputeToReadback(VkCommandBuffer commands);
/// What was copied is seen by the CPU.
void barrierTransferToHost(VkCommandBuffer commands);

}  // namespace vcp
