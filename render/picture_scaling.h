// Scales a picture, which passes write into a buffer, to an image of a window or of the host's.
#pragma once

#include "render/passes/frame_resources.h"
#include "render/vulkan/device.h"

namespace vcp {

/// Used by one thread. Destroyed when the device is idle, before the device.
class PictureScaling {
public:
    explicit PictureScaling(Device& device) : device_(device) {}
    ~PictureScaling() { destroy(); }
    PictureScaling(const PictureScaling&) = delete;
    PictureScaling& operator=(const PictureScaling&) = delete;

    /// Makes room for pictures of a size. Precondition: the device is idle. Errors: Device.
    Result<void> prepare(PictureSize size);
    /// Records the copy of an RGBA8 picture of that size; what was in `target` is lost, and it is left in the layout
    /// TRANSFER_DST_OPTIMAL. Waits for earlier submissions that use the image. Precondition: the queue has graphics.
    void record(VkCommandBuffer commands, const Buffer& picture, VkImage target, VkExtent2D extent) const;

private:
    void destroy();

    Device& device_;
    VkImage image_ = VK_NULL_HANDLE;  // the picture as an image, which can be scaled
    VkDeviceMemory memory_ = VK_NULL_HANDLE;
    PictureSize size_;
};

/// Records a barrier from transfers to all that follows; where the image was not ours, from all that came before.
void changeLayout(VkCommandBuffer commands, VkImage image, VkImageLayout from, VkImageLayout to, VkAccessFlags wrote,
                  VkAccessFlags next);

}  // namespace vcp
