// Rasterizing triangles: a graphics pipeline with its render pass, and the images that it draws into. Colours are
// copied to buffers afterwards, as compute passes read them.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <vulkan/vulkan_core.h>

#include "octree/io/result.h"
#include "render/vulkan/device.h"

namespace vcp {

/// An image with its memory and view. Move-only; destroyed before the device.
class RasterImage {
public:
    /// Errors: Device (out of memory).
    static Result<RasterImage> create(const Device& device, VkFormat format, VkExtent2D size, VkImageUsageFlags usage,
                                      VkImageAspectFlags aspect);
    RasterImage() = default;
    ~RasterImage();
    RasterImage(RasterImage&& other) noexcept { *this = std::move(other); }
    RasterImage& operator=(RasterImage&& other) noexcept {
        std::swap(device_, other.device_), std::swap(image_, other.image_);
        std::swap(memory_, other.memory_), std::swap(view_, other.view_);
        return *this;
    }
    [[nodiscard]] VkImage handle() const { return image_; }
    [[nodiscard]] VkImageView view() const { return view_; }

private:
    VkDevice device_ = VK_NULL_HANDLE;
    VkImage image_ = VK_NULL_HANDLE;
    VkDeviceMemory memory_ = VK_NULL_HANDLE;
    VkImageView view_ = VK_NULL_HANDLE;
};

struct RasterPipelineOptions {
    std::span<const uint32_t> vertex, fragment;     ///< SPIR-V
    std::span<const uint32_t> control, evaluation;  ///< the same, of patches of three points; empty: triangles
    uint32_t vertexBytes = 0;
    std::vector<std::pair<VkFormat, uint32_t>> attributes;  ///< format and byte of each location
    uint32_t pushBytes = 0;                                 ///< of all stages
    VkDescriptorSetLayout set = VK_NULL_HANDLE;             ///< set 0, not owned; null: none
    std::vector<VkFormat> colours;
};

/// Triangle lists, or patches; the greater depth is nearer; both faces are drawn. Move-only; destroyed before the
/// device.
class RasterPipeline {
public:
    static constexpr VkFormat kDepth = VK_FORMAT_D32_SFLOAT;

    /// Errors: Device; Unsupported (the device's queue does not rasterize).
    static Result<RasterPipeline> create(const Device& device, const RasterPipelineOptions& options);
    RasterPipeline() = default;
    ~RasterPipeline();
    RasterPipeline(RasterPipeline&& other) noexcept { *this = std::move(other); }
    RasterPipeline& operator=(RasterPipeline&& other) noexcept {
        std::swap(device_, other.device_), std::swap(pass_, other.pass_);
        std::swap(layout_, other.layout_), std::swap(pipeline_, other.pipeline_);
        std::swap(colours_, other.colours_), std::swap(pushStages_, other.pushStages_);
        return *this;
    }
    [[nodiscard]] bool exists() const { return pipeline_ != VK_NULL_HANDLE; }
    [[nodiscard]] VkPipelineLayout layout() const { return layout_; }
    [[nodiscard]] VkRenderPass pass() const { return pass_; }
    [[nodiscard]] VkShaderStageFlags pushStages() const { return pushStages_; }

    /// Begins the pass with all cleared to 0, and binds the pipeline. The colours' images are to be copied from after
    /// vkCmdEndRenderPass.
    void begin(VkCommandBuffer commands, VkFramebuffer target, VkExtent2D size) const;

private:
    Result<void> createPass(const RasterPipelineOptions& options);
    Result<void> createPipeline(const Device& device, const RasterPipelineOptions& options,
                                std::span<const VkPipelineShaderStageCreateInfo> stages);

    VkDevice device_ = VK_NULL_HANDLE;
    VkRenderPass pass_ = VK_NULL_HANDLE;
    VkPipelineLayout layout_ = VK_NULL_HANDLE;
    VkPipeline pipeline_ = VK_NULL_HANDLE;
    VkShaderStageFlags pushStages_ = 0;
    uint32_t colours_ = 0;
};

/// Makes what compute shaders wrote visible to draws, as vertices, indices and indirect commands.
void barrierComputeToDraw(VkCommandBuffer commands);

/// The images of a picture's size that a pipeline draws into. Move-only; destroyed before the device.
class RasterTarget {
public:
    /// Errors: Device (out of memory).
    static Result<RasterTarget> create(const Device& device, const RasterPipeline& pipeline,
                                       std::span<const VkFormat> colours, VkExtent2D size);
    RasterTarget() = default;
    ~RasterTarget();
    RasterTarget(RasterTarget&& other) noexcept { *this = std::move(other); }
    RasterTarget& operator=(RasterTarget&& other) noexcept {
        std::swap(device_, other.device_), std::swap(framebuffer_, other.framebuffer_);
        std::swap(images_, other.images_), std::swap(size_, other.size_);
        return *this;
    }
    [[nodiscard]] VkFramebuffer framebuffer() const { return framebuffer_; }
    [[nodiscard]] VkExtent2D size() const { return size_; }
    /// Copies a colour's image, row by row. Comes after the pass.
    void copy(VkCommandBuffer commands, size_t colour, const Buffer& to) const;

private:
    VkDevice device_ = VK_NULL_HANDLE;
    VkFramebuffer framebuffer_ = VK_NULL_HANDLE;
    std::vector<RasterImage> images_;  // the colours, then the depth
    VkExtent2D size_{};
};

}  // namespace vcp
