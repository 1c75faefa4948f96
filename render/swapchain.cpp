#include "render/swapchain.h"

#include <algorithm>

#include "render/vulkan/check.h"

namespace vcp {

Swapchain::~Swapchain() {
    vkDeviceWaitIdle(device_.handle());
    destroySwapchain();
    if (renderPass_ != VK_NULL_HANDLE) vkDestroyRenderPass(device_.handle(), renderPass_, nullptr);
    vkDestroySurfaceKHR(instance_, surface_, nullptr);
}

void Swapchain::destroySwapchain() {
    for (VkFramebuffer framebuffer : framebuffers_) vkDestroyFramebuffer(device_.handle(), framebuffer, nullptr);
    for (VkImageView view : views_) vkDestroyImageView(device_.handle(), view, nullptr);
    framebuffers_.clear();
    views_.clear();
    for (VkSemaphore semaphore : shown_) vkDestroySemaphore(device_.handle(), semaphore, nullptr);
    shown_.clear();
    for (Acquisition& acquisition : acquisitions_) {
        if (acquisition.semaphore != VK_NULL_HANDLE)
            vkDestroySemaphore(device_.handle(), acquisition.semaphore, nullptr);
        acquisition = {};
    }
    if (swapchain_ != VK_NULL_HANDLE) vkDestroySwapchainKHR(device_.handle(), swapchain_, nullptr);
    swapchain_ = VK_NULL_HANDLE;
}

Result<void> Swapchain::chooseFormat() {
    if (format_.format != VK_FORMAT_UNDEFINED) return {};
    uint32_t count = 0;
    VCP_VK(vkGetPhysicalDeviceSurfaceFormatsKHR, device_.physical(), surface_, &count, nullptr);
    std::vector<VkSurfaceFormatKHR> formats(count);
    VCP_VK(vkGetPhysicalDeviceSurfaceFormatsKHR, device_.physical(), surface_, &count, formats.data());
    if (formats.empty()) return Error{.code = ErrorCode::Device, .message = "the window has no format for pictures"};
    // The picture is encoded already, so no conversion is wanted.
    const auto plain = std::find_if(formats.begin(), formats.end(), [](const VkSurfaceFormatKHR& f) {
        return f.format == VK_FORMAT_B8G8R8A8_UNORM || f.format == VK_FORMAT_R8G8B8A8_UNORM;
    });
    format_ = plain != formats.end() ? *plain : formats.front();
    return {};
}

Result<VkRenderPass> Swapchain::renderPass() {
    if (renderPass_ != VK_NULL_HANDLE) return renderPass_;
    VCP_TRY(chooseFormat());
    VkAttachmentDescription image{};
    image.format = format_.format;
    image.samples = VK_SAMPLE_COUNT_1_BIT;
    image.loadOp = VK_ATTACHMENT_LOAD_OP_LOAD;
    image.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
    image.stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE;
    image.stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE;
    image.initialLayout = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;
    image.finalLayout = VK_IMAGE_LAYOUT_PRESENT_SRC_KHR;
    const VkAttachmentReference colour{0, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL};
    VkSubpassDescription subpass{};
    subpass.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS;
    subpass.colorAttachmentCount = 1;
    subpass.pColorAttachments = &colour;
    VkSubpassDependency afterCopy{};
    afterCopy.srcSubpass = VK_SUBPASS_EXTERNAL;
    afterCopy.srcStageMask = VK_PIPELINE_STAGE_TRANSFER_BIT;
    afterCopy.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
    afterCopy.dstStageMask = VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT;
    afterCopy.dstAccessMask = VK_ACCESS_COLOR_ATTACHMENT_READ_BIT | VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT;
    VkRenderPassCreateInfo info{VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO};
    info.attachmentCount = info.subpassCount = info.dependencyCount = 1;
    info.pAttachments = &image;
    info.pSubpasses = &subpass;
    info.pDependencies = &afterCopy;
    VCP_VK(vkCreateRenderPass, device_.handle(), &info, nullptr, &renderPass_);
    return renderPass_;
}

Result<void> Swapchain::makeFramebuffers() {
    if (!framebuffers_.empty()) return {};
    VCP_TRY_ASSIGN(const auto pass, renderPass());
    for (VkImage image : images_) {
        VkImageViewCreateInfo viewInfo{VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO};
        viewInfo.image = image;
        viewInfo.viewType = VK_IMAGE_VIEW_TYPE_2D;
        viewInfo.format = format_.format;
        viewInfo.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
        VCP_VK(vkCreateImageView, device_.handle(), &viewInfo, nullptr, &views_.emplace_back(VK_NULL_HANDLE));
        VkFramebufferCreateInfo info{VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO};
        info.renderPass = pass;
        info.attachmentCount = 1;
        info.pAttachments = &views_.back();
        info.width = extent_.width;
        info.height = extent_.height;
        info.layers = 1;
        VCP_VK(vkCreateFramebuffer, device_.handle(), &info, nullptr, &framebuffers_.emplace_back(VK_NULL_HANDLE));
    }
    return {};
}

Result<void> Swapchain::recreate(PictureSize window) {
    VCP_VK(vkDeviceWaitIdle, device_.handle());
    destroySwapchain();
    window_ = window;
    VkSurfaceCapabilitiesKHR can;
    VCP_VK(vkGetPhysicalDeviceSurfaceCapabilitiesKHR, device_.physical(), surface_, &can);
    VCP_TRY(chooseFormat());
    extent_ = can.currentExtent;
    if (extent_.width == UINT32_MAX)
        extent_ = {std::clamp(window.width, can.minImageExtent.width, can.maxImageExtent.width),
                   std::clamp(window.height, can.minImageExtent.height, can.maxImageExtent.height)};
    if (extent_.width == 0 || extent_.height == 0) return {};
    VkSwapchainCreateInfoKHR info{VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR};
    info.surface = surface_;
    info.minImageCount =
        can.maxImageCount > 0 ? std::min(can.minImageCount + 1, can.maxImageCount) : can.minImageCount + 1;
    info.imageFormat = format_.format;
    info.imageColorSpace = format_.colorSpace;
    info.imageExtent = extent_;
    info.imageArrayLayers = 1;
    info.imageUsage = VK_IMAGE_USAGE_TRANSFER_DST_BIT | VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT;
    info.preTransform = can.currentTransform;
    info.compositeAlpha = VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR;
    info.presentMode = VK_PRESENT_MODE_FIFO_KHR;
    info.clipped = VK_TRUE;
    VCP_VK(vkCreateSwapchainKHR, device_.handle(), &info, nullptr, &swapchain_);
    uint32_t count = 0;
    VCP_VK(vkGetSwapchainImagesKHR, device_.handle(), swapchain_, &count, nullptr);
    images_.resize(count);
    VCP_VK(vkGetSwapchainImagesKHR, device_.handle(), swapchain_, &count, images_.data());
    const VkSemaphoreCreateInfo semaphore{VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO};
    for (Acquisition& acquisition : acquisitions_)
        VCP_VK(vkCreateSemaphore, device_.handle(), &semaphore, nullptr, &acquisition.semaphore);
    shown_.assign(images_.size(), VK_NULL_HANDLE);
    for (VkSemaphore& shown : shown_) VCP_VK(vkCreateSemaphore, device_.handle(), &semaphore, nullptr, &shown);
    return {};
}

void Swapchain::recordOver(VkCommandBuffer commands, const DrawOver& drawOver, uint32_t image) const {
    VkRenderPassBeginInfo begin{VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO};
    begin.renderPass = renderPass_;
    begin.framebuffer = framebuffers_[image];
    begin.renderArea = {{0, 0}, extent_};
    vkCmdBeginRenderPass(commands, &begin, VK_SUBPASS_CONTENTS_INLINE);
    drawOver(commands, extent_);
    vkCmdEndRenderPass(commands);
}

/// Returns the number of the image that may be drawn to next; nothing where the window has none now.
Result<std::optional<uint32_t>> Swapchain::acquire(PictureSize window) {
    uint32_t image = 0;
    VkResult acquired = VK_ERROR_OUT_OF_DATE_KHR;
    // The window may change between asking for its size and drawing: try with the new one, once.
    for (int attempt = 0; attempt < 2 && acquired == VK_ERROR_OUT_OF_DATE_KHR; ++attempt) {
        if (swapchain_ == VK_NULL_HANDLE || window != window_ || attempt > 0) VCP_TRY(recreate(window));
        if (swapchain_ == VK_NULL_HANDLE) return std::optional<uint32_t>{};
        const Acquisition& next = acquisitions_[nextAcquisition_];
        VCP_TRY(device_.waitFor(next.submission));
        acquired =
            vkAcquireNextImageKHR(device_.handle(), swapchain_, UINT64_MAX, next.semaphore, VK_NULL_HANDLE, &image);
    }
    if (acquired == VK_ERROR_OUT_OF_DATE_KHR) return std::optional<uint32_t>{};
    if (acquired != VK_SUCCESS && acquired != VK_SUBOPTIMAL_KHR) return vulkanError("vkAcquireNextImageKHR", acquired);
    return std::optional<uint32_t>(image);
}

Result<uint64_t> Swapchain::show(const Buffer& picture, PictureSize pictureSize, PictureSize window,
                                 const DrawOver& drawOver) {
    if (window.width == 0 || window.height == 0) return uint64_t{0};
    VCP_TRY(scaling_.prepare(pictureSize));
    VCP_TRY_ASSIGN(const auto image, acquire(window));
    if (!image) return uint64_t{0};
    if (drawOver) VCP_TRY(makeFramebuffers());
    VCP_TRY_ASSIGN(auto commands, device_.beginCommands());
    scaling_.record(commands, picture, images_[*image], extent_);
    if (drawOver)
        recordOver(commands, drawOver, *image);
    else
        changeLayout(commands, images_[*image], VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_IMAGE_LAYOUT_PRESENT_SRC_KHR,
                     VK_ACCESS_TRANSFER_WRITE_BIT, 0);
    Acquisition& acquisition = acquisitions_[nextAcquisition_];
    const auto submission = device_.endCommands(acquisition.semaphore, shown_[*image]);
    if (!submission) return submission;
    acquisition.submission = *submission;
    nextAcquisition_ = (nextAcquisition_ + 1) % acquisitions_.size();
    VCP_TRY(present(*image));
    return submission;
}

Result<void> Swapchain::present(uint32_t image) {
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
