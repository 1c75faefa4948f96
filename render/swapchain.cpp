#include "render/swapchain.h"

#include <algorithm>
#include <cstring>

#include "render/vulkan/check.h"

namespace vcp {

namespace {

constexpr VkImageSubresourceLayers kLayer{VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};

void changeLayout(VkCommandBuffer commands, VkImage image, VkImageLayout from, VkImageLayout to, VkAccessFlags wrote, VkAccessFlags next) {
    VkImageMemoryBarrier barrier{VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER};
    barrier.srcAccessMask = wrote;
    barrier.dstAccessMask = next;
    barrier.oldLayout = from;
    barrier.newLayout = to;
    barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.image = image;
    barrier.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_TRANSFER_BIT, 0, 0, nullptr, 0, nullptr, 1, &barrier);
}

VkOffset3D farCorner(uint32_t width, uint32_t height) { return {static_cast<int32_t>(width), static_cast<int32_t>(height), 1}; }

}  // namespace

Swapchain::~Swapchain() {
    vkDeviceWaitIdle(device_.handle());
    destroySwapchain();
    destroyPictureImage();
    vkDestroySurfaceKHR(instance_, surface_, nullptr);
}

void Swapchain::destroySwapchain() {
    for (VkSemaphore semaphore : shown_) vkDestroySemaphore(device_.handle(), semaphore, nullptr);
    shown_.clear();
    if (acquired_ != VK_NULL_HANDLE) vkDestroySemaphore(device_.handle(), acquired_, nullptr);
    acquired_ = VK_NULL_HANDLE;
    if (swapchain_ != VK_NULL_HANDLE) vkDestroySwapchainKHR(device_.handle(), swapchain_, nullptr);
    swapchain_ = VK_NULL_HANDLE;
}

void Swapchain::destroyPictureImage() {
    if (pictureImage_ != VK_NULL_HANDLE) vkDestroyImage(device_.handle(), pictureImage_, nullptr);
    if (pictureMemory_ != VK_NULL_HANDLE) vkFreeMemory(device_.handle(), pictureMemory_, nullptr);
    pictureImage_ = VK_NULL_HANDLE;
    pictureMemory_ = VK_NULL_HANDLE;
    pictureSize_ = {};
}

Result<void> Swapchain::recreate(PictureSize window) {
    VCP_VK(vkDeviceWaitIdle, device_.handle());
    destroySwapchain();
    window_ = window;
    VkSurfaceCapabilitiesKHR can;
    VCP_VK(vkGetPhysicalDeviceSurfaceCapabilitiesKHR, device_.physical(), surface_, &can);
    uint32_t count = 0;
    VCP_VK(vkGetPhysicalDeviceSurfaceFormatsKHR, device_.physical(), surface_, &count, nullptr);
    std::vector<VkSurfaceFormatKHR> formats(count);
    VCP_VK(vkGetPhysicalDeviceSurfaceFormatsKHR, device_.physical(), surface_, &count, formats.data());
    if (formats.empty()) return Error{.code = ErrorCode::Device, .message = "the window has no format for pictures"};
    // The picture is encoded already: no conversion wanted.
    const auto plain = std::find_if(formats.begin(), formats.end(), [](const VkSurfaceFormatKHR& f) {
        return f.format == VK_FORMAT_B8G8R8A8_UNORM || f.format == VK_FORMAT_R8G8B8A8_UNORM;
    });
    const VkSurfaceFormatKHR format = plain != formats.end() ? *plain : formats.front();
    extent_ = can.currentExtent;
    if (extent_.width == UINT32_MAX)
        extent_ = {std::clamp(window.width, can.minImageExtent.width, can.maxImageExtent.width),
                   std::clamp(window.height, can.minImageExtent.height, can.maxImageExtent.height)};
    if (extent_.width == 0 || extent_.height == 0) return {};
    VkSwapchainCreateInfoKHR info{VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR};
    info.surface = surface_;
    info.minImageCount = can.maxImageCount > 0 ? std::min(can.minImageCount + 1, can.maxImageCount) : can.minImageCount + 1;
    info.imageFormat = format.format;
    info.imageColorSpace = format.colorSpace;
    info.imageExtent = extent_;
    info.imageArrayLayers = 1;
    info.imageUsage = VK_IMAGE_USAGE_TRANSFER_DST_BIT;
    info.preTransform = can.currentTransform;
    info.compositeAlpha = VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR;
    info.presentMode = VK_PRESENT_MODE_FIFO_KHR;
    info.clipped = VK_TRUE;
    VCP_VK(vkCreateSwapchainKHR, device_.handle(), &info, nullptr, &swapchain_);
    VCP_VK(vkGetSwapchainImagesKHR, device_.handle(), swapchain_, &count, nullptr);
    images_.resize(count);
    VCP_VK(vkGetSwapchainImagesKHR, device_.handle(), swapchain_, &count, images_.data());
    const VkSemaphoreCreateInfo semaphore{VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO};
    VCP_VK(vkCreateSemaphore, device_.handle(), &semaphore, nullptr, &acquired_);
    shown_.assign(images_.size(), VK_NULL_HANDLE);
    for (VkSemaphore& shown : shown_) VCP_VK(vkCreateSemaphore, device_.handle(), &semaphore, nullptr, &shown);
    return {};
}

Result<void> Swapchain::makePictureImage(PictureSize size) {
    if (size == pictureSize_) return {};
    destroyPictureImage();
    VkImageCreateInfo info{VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO};
    info.imageType = VK_IMAGE_TYPE_2D;
    info.format = VK_FORMAT_R8G8B8A8_UNORM;
    info.extent = {size.width, size.height, 1};
    info.mipLevels = info.arrayLayers = 1;
    info.samples = VK_SAMPLE_COUNT_1_BIT;
    info.usage = VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
    VCP_VK(vkCreateImage, device_.handle(), &info, nullptr, &pictureImage_);
    VkMemoryRequirements needs;
    vkGetImageMemoryRequirements(device_.handle(), pictureImage_, &needs);
    auto type = device_.memoryType(needs.memoryTypeBits, MemoryUse::Local);
    if (!type) return type.error();
    VkMemoryAllocateInfo allocation{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
    allocation.allocationSize = needs.size;
    allocation.memoryTypeIndex = *type;
    VCP_VK(vkAllocateMemory, device_.handle(), &allocation, nullptr, &pictureMemory_);
    VCP_VK(vkBindImageMemory, device_.handle(), pictureImage_, pictureMemory_, 0);
    pictureSize_ = size;
    return {};
}

void Swapchain::record(VkCommandBuffer commands, const Buffer& picture, VkImage target) const {
    constexpr VkImageLayout kTo = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, kFrom = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
    changeLayout(commands, pictureImage_, VK_IMAGE_LAYOUT_UNDEFINED, kTo, 0, VK_ACCESS_TRANSFER_WRITE_BIT);
    const VkBufferImageCopy copy{0, 0, 0, kLayer, {0, 0, 0}, {pictureSize_.width, pictureSize_.height, 1}};
    vkCmdCopyBufferToImage(commands, picture.handle(), pictureImage_, kTo, 1, &copy);
    changeLayout(commands, pictureImage_, kTo, kFrom, VK_ACCESS_TRANSFER_WRITE_BIT, VK_ACCESS_TRANSFER_READ_BIT);
    changeLayout(commands, target, VK_IMAGE_LAYOUT_UNDEFINED, kTo, 0, VK_ACCESS_TRANSFER_WRITE_BIT);
    const VkImageBlit blit{kLayer, {{0, 0, 0}, farCorner(pictureSize_.width, pictureSize_.height)}, kLayer,
                           {{0, 0, 0}, farCorner(extent_.width, extent_.height)}};
    const bool same = pictureSize_.width == extent_.width && pictureSize_.height == extent_.height;
    vkCmdBlitImage(commands, pictureImage_, kFrom, target, kTo, 1, &blit, same ? VK_FILTER_NEAREST : VK_FILTER_LINEAR);
    recordOverlay(commands, target);
    changeLayout(commands, target, kTo, VK_IMAGE_LAYOUT_PRESENT_SRC_KHR, VK_ACCESS_TRANSFER_WRITE_BIT, 0);
}

Result<void> Swapchain::takeOverlay(const Picture* overlay) {
    overlaySize_ = {};
    if (!overlay || overlay->rgba.empty()) return {};
    const uint64_t bytes = overlay->rgba.size();
    if (overlay_.bytes() < bytes) {
        auto buffer = device_.createBuffer(bytes, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, MemoryUse::Upload);
        if (!buffer) return buffer.error();
        overlay_ = std::move(*buffer);
    }
    // Greys look the same whichever channel comes first in the window's format.
    std::memcpy(overlay_.mapped(), overlay->rgba.data(), bytes);
    overlaySize_ = {overlay->width, overlay->height};
    return {};
}

void Swapchain::recordOverlay(VkCommandBuffer commands, VkImage target) const {
    constexpr VkImageLayout kTo = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;
    const uint32_t width = std::min(overlaySize_.width, extent_.width), height = std::min(overlaySize_.height, extent_.height);
    if (width == 0 || height == 0) return;
    changeLayout(commands, target, kTo, kTo, VK_ACCESS_TRANSFER_WRITE_BIT, VK_ACCESS_TRANSFER_WRITE_BIT);
    const VkBufferImageCopy copy{0, overlaySize_.width, overlaySize_.height, kLayer, {0, static_cast<int32_t>(extent_.height - height), 0}, {width, height, 1}};
    vkCmdCopyBufferToImage(commands, overlay_.handle(), target, kTo, 1, &copy);
}

Result<void> Swapchain::show(const Buffer& picture, PictureSize pictureSize, PictureSize window, const Picture* overlay) {
    if (window.width == 0 || window.height == 0) return {};
    if (swapchain_ == VK_NULL_HANDLE || window != window_) VCP_TRY(recreate(window));
    uint32_t image = 0;
    VkResult acquired = VK_ERROR_OUT_OF_DATE_KHR;
    // The window may change between asking for its size and drawing: try with the new one, once.
    for (int attempt = 0; attempt < 2 && acquired == VK_ERROR_OUT_OF_DATE_KHR; ++attempt) {
        if (attempt > 0) VCP_TRY(recreate(window));
        if (swapchain_ == VK_NULL_HANDLE) return {};
        acquired = vkAcquireNextImageKHR(device_.handle(), swapchain_, UINT64_MAX, acquired_, VK_NULL_HANDLE, &image);
    }
    if (acquired == VK_ERROR_OUT_OF_DATE_KHR) return {};
    if (acquired != VK_SUCCESS && acquired != VK_SUBOPTIMAL_KHR) return vulkanError("vkAcquireNextImageKHR", acquired);
    VCP_TRY(makePictureImage(pictureSize));
    VCP_TRY(takeOverlay(overlay));
    auto commands = device_.beginCommands();
    if (!commands) return commands.error();
    record(*commands, picture, images_[image]);
    VCP_TRY(device_.endCommandsAndWait(acquired_, shown_[image]));
    VkPresentInfoKHR present{VK_STRUCTURE_TYPE_PRESENT_INFO_KHR};
    present.waitSemaphoreCount = 1;
    present.pWaitSemaphores = &shown_[image];
    present.swapchainCount = 1;
    present.pSwapchains = &swapchain_;
    present.pImageIndices = &image;
    const VkResult shown = vkQueuePresentKHR(device_.queue(), &present);
    if (shown == VK_ERROR_OUT_OF_DATE_KHR || shown == VK_SUBOPTIMAL_KHR) {
        destroyAfterResize();
        return {};
    }
    if (shown != VK_SUCCESS) return vulkanError("vkQueuePresentKHR", shown);
    return {};
}

void Swapchain::destroyAfterResize() {
    vkDeviceWaitIdle(device_.handle());
    destroySwapchain();
}

}  // namespace vcp
