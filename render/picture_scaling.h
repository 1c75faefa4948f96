// Scales a picture, which passes write into a buffer, to an image of a window or of the host's.
#pragma once

#include "render/passes/frame_resources.h"
#include "render/vulkan/device.h"

namespace vcp {

/// Keeps an image for each of the last two sizes: pictures of a moving camera may be smaller than those at rest. Used
/// by one thread. Destroyed when the device is idle, before the device.
class PictureScaling {
public:
    explicit PictureScaling(Device& device) : device_(device) {}
    ~PictureScaling() {
        for (SizedImage& each : images_) destroy(each);
    }
    PictureScaling(const PictureScaling&) = delete;
    PictureScaling& operator=(const PictureScaling&) = delete;

    /// Makes room for pictures of a size; waits for the device where it is a new one. Errors: Device.
    Result<void> prepare(PictureSize size);
    /// Records the copy of an RGBA8 picture of that size; what was in `target` is lost, and it is left in the layout
    /// TRANSFER_DST_OPTIMAL. Waits for earlier submissions that use the image. Precondition: the queue has graphics.
    void record(VkCommandBuffer commands, const Buffer& picture, VkImage target, VkExtent2D extent) const;

private:
    /// A picture as an image, which can be scaled.
    struct SizedImage {
        VkImage image = VK_NULL_HANDLE;
        VkDeviceMemory memory = VK_NULL_HANDLE;
        PictureSize size;
    };
    void destroy(SizedImage& image);

    Device& device_;
    SizedImage images_[2];
    size_t current_ = 0;
};

/// Records a barrier from transfers to all that follows; where the image was not ours, from all that came before.
void changeLayout(VkCommandBuffer commands, VkImage image, VkImageLayout from, VkImageLayout to, VkAccessFlags wrote,
                  VkAccessFlags next);

}  // namespace vcp
