// The swapchain: the images that a window shows.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "render/passes/frame_resources.h"
#include "render/picture_scaling.h"
#include "render/vulkan/device.h"
#include "render/window_drawing.h"

namespace vcp {

/// Owns the surface. Used by one thread.
class Swapchain {
public:
    /// Takes the surface over.
    Swapchain(VkInstance instance, Device& device, VkSurfaceKHR surface)
        : instance_(instance), device_(device), surface_(surface), scaling_(device) {}
    ~Swapchain();
    Swapchain(const Swapchain&) = delete;
    Swapchain& operator=(const Swapchain&) = delete;

    /// Shows an RGBA8 picture, scaled to the window's framebuffer, with what `drawOver` draws over it, if it is not
    /// empty. Waits for the call before the last, at most, where that has not ended. Returns the number of the
    /// submission that reads the picture; 0 where the framebuffer has no area, and nothing is done. Errors: Device.
    Result<uint64_t> show(const Buffer& picture, PictureSize pictureSize, PictureSize window,
                          const DrawOver& drawOver = {});

    /// Returns the render pass that drawOver draws in; made on first use. Errors: Device.
    Result<VkRenderPass> renderPass();

private:
    Result<void> recreate(PictureSize window);
    Result<std::optional<uint32_t>> acquire(PictureSize window);
    Result<void> present(uint32_t image);
    void destroySwapchain();
    void destroyAfterResize();
    Result<void> chooseFormat();
    Result<void> makeFramebuffers();
    void recordOver(VkCommandBuffer commands, const DrawOver& drawOver, uint32_t image) const;

    VkInstance instance_;
    Device& device_;
    VkSurfaceKHR surface_;
    VkSwapchainKHR swapchain_ = VK_NULL_HANDLE;
    VkSurfaceFormatKHR format_{};  // VK_FORMAT_UNDEFINED: not chosen yet
    VkRenderPass renderPass_ = VK_NULL_HANDLE;
    std::vector<VkImage> images_;
    std::vector<VkImageView> views_;  // one an image, like the framebuffers; empty until drawn over
    std::vector<VkFramebuffer> framebuffers_;
    std::vector<VkSemaphore> shown_;  // one an image: free again when the image comes back
    /// Signalled when an image may be drawn to. Free again when the submission that waited for it has ended.
    struct Acquisition {
        VkSemaphore semaphore = VK_NULL_HANDLE;
        uint64_t submission = 0;
    };
    std::array<Acquisition, 2> acquisitions_;
    size_t nextAcquisition_ = 0;
    PictureSize window_;  // as the caller asked for it
    VkExtent2D extent_{};
    PictureScaling scaling_;
};

}  // namespace vcp
