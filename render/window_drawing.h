// What a host draws over pictures in windows, and images of its own that take them.
#pragma once

#include <cstdint>
#include <functional>

#include <vulkan/vulkan_core.h>

#include "render/frame_request.h"
#include "render/picture.h"

namespace vcp {

/// What a user interface needs to make pipelines that draw over the picture in the window.
struct WindowDrawing {
    VkInstance instance;
    VkPhysicalDevice physical;
    VkDevice device;
    VkQueue queue;  ///< frames of renderAhead() may be in flight between calls of the renderer
    uint32_t queueFamily;
    VkRenderPass renderPass;  ///< one colour attachment, one sample, the picture in it
};
/// Records draws of an image of the window, inside of WindowDrawing::renderPass.
using DrawOver = std::function<void(VkCommandBuffer commands, VkExtent2D size)>;

/// Paints over a picture, which was drawn for the request.
using PaintOver = std::function<void(const FrameRequest& request, Picture& picture)>;

/// An image of the host's on the renderer's device: a colour image, not multisampled, of a UNORM format, with usage
/// TRANSFER_DST.
struct ImageTarget {
    VkImage image = VK_NULL_HANDLE;
    uint32_t width = 0, height = 0;
    VkImageLayout layoutAfter = VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL;
    VkSemaphore wait = VK_NULL_HANDLE;    ///< where given: the image is written after it is signalled
    VkSemaphore signal = VK_NULL_HANDLE;  ///< where given: signalled when the image is written
};

}  // namespace vcp
