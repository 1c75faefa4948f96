#include "render/picture_scaling.h"

#include "render/vulkan/check.h"

namespace vcp {

namespace {

constexpr VkImageSubresourceLayers kLayer{VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};

VkOffset3D farCorner(uint32_t width, uint32_t height) { return {int32_t(width), int32_t(height), 1}; }

}  // namespace

void changeLayout(VkCommandBuffer commands, VkImage image, VkImageLayout from, VkImageLayout to, VkAccessFlags wrote,
                  VkAccessFlags next) {
    VkImageMemoryBarrier barrier{VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER};
    barrier.srcAccessMask = wrote;
    barrier.dstAccessMask = next;
    barrier.oldLayout = from;
    barrier.newLayout = to;
    barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.image = image;
    barrier.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    const VkPipelineStageFlags before =
        from == VK_IMAGE_LAYOUT_UNDEFINED ? VK_PIPELINE_STAGE_ALL_COMMANDS_BIT : VK_PIPELINE_STAGE_TRANSFER_BIT;
    vkCmdPipelineBarrier(commands, before, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 0, nullptr, 0, nullptr, 1, &barrier);
}

void PictureScaling::destroy(SizedImage& image) {
    if (image.image != VK_NULL_HANDLE) vkDestroyImage(device_.handle(), image.image, nullptr);
    if (image.memory != VK_NULL_HANDLE) vkFreeMemory(device_.handle(), image.memory, nullptr);
    image = {};
}

Result<void> PictureScaling::prepare(PictureSize size) {
    if (size != images_[current_].size) current_ = 1 - current_;
    SizedImage& made = images_[current_];
    if (size == made.size) return {};
    VCP_TRY(device_.waitForAll());
    destroy(made);
    VkImageCreateInfo info{VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO};
    info.imageType = VK_IMAGE_TYPE_2D;
    info.format = VK_FORMAT_R8G8B8A8_UNORM;
    info.extent = {size.width, size.height, 1};
    info.mipLevels = info.arrayLayers = 1;
    info.samples = VK_SAMPLE_COUNT_1_BIT;
    info.usage = VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
    VCP_VK(vkCreateImage, device_.handle(), &info, nullptr, &made.image);
    VkMemoryRequirements needs;
    vkGetImageMemoryRequirements(device_.handle(), made.image, &needs);
    VCP_TRY_ASSIGN(auto type, device_.memoryType(needs.memoryTypeBits, MemoryUse::Local));
    VkMemoryAllocateInfo allocation{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
    allocation.allocationSize = needs.size;
    allocation.memoryTypeIndex = type;
    VCP_VK(vkAllocateMemory, device_.handle(), &allocation, nullptr, &made.memory);
    VCP_VK(vkBindImageMemory, device_.handle(), made.image, made.memory, 0);
    made.size = size;
    return {};
}

void PictureScaling::record(VkCommandBuffer commands, const Buffer& picture, VkImage target, VkExtent2D extent) const {
    const auto& [image, memory, size] = images_[current_];
    constexpr VkImageLayout kTo = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, kFrom = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
    changeLayout(commands, image, VK_IMAGE_LAYOUT_UNDEFINED, kTo, 0, VK_ACCESS_TRANSFER_WRITE_BIT);
    const VkBufferImageCopy copy{0, 0, 0, kLayer, {0, 0, 0}, {size.width, size.height, 1}};
    vkCmdCopyBufferToImage(commands, picture.handle(), image, kTo, 1, &copy);
    changeLayout(commands, image, kTo, kFrom, VK_ACCESS_TRANSFER_WRITE_BIT, VK_ACCESS_TRANSFER_READ_BIT);
    changeLayout(commands, target, VK_IMAGE_LAYOUT_UNDEFINED, kTo, 0, VK_ACCESS_TRANSFER_WRITE_BIT);
    const VkImageBlit blit{kLayer,
                           {{0, 0, 0}, farCorner(size.width, size.height)},
                           kLayer,
                           {{0, 0, 0}, farCorner(extent.width, extent.height)}};
    const bool same = size.width == extent.width && size.height == extent.height;
    vkCmdBlitImage(commands, image, kFrom, target, kTo, 1, &blit, same ? VK_FILTER_NEAREST : VK_FILTER_LINEAR);
}

}  // namespace vcp
