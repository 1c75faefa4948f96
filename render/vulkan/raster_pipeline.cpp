#include "render/vulkan/raster_pipeline.h"

#include "render/vulkan/check.h"

namespace vcp {

Result<RasterImage> RasterImage::create(const Device& device, VkFormat format, VkExtent2D size, VkImageUsageFlags usage,
                                        VkImageAspectFlags aspect) {
    RasterImage made;
    made.device_ = device.handle();
    VkImageCreateInfo info{VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO};
    info.imageType = VK_IMAGE_TYPE_2D;
    info.format = format;
    info.extent = {size.width, size.height, 1};
    info.mipLevels = info.arrayLayers = 1;
    info.samples = VK_SAMPLE_COUNT_1_BIT;
    info.usage = usage;
    VCP_VK(vkCreateImage, device.handle(), &info, nullptr, &made.image_);
    VkMemoryRequirements needs;
    vkGetImageMemoryRequirements(device.handle(), made.image_, &needs);
    VCP_TRY_ASSIGN(auto type, device.memoryType(needs.memoryTypeBits, MemoryUse::Local));
    VkMemoryAllocateInfo allocation{VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO};
    allocation.allocationSize = needs.size;
    allocation.memoryTypeIndex = type;
    VCP_VK(vkAllocateMemory, device.handle(), &allocation, nullptr, &made.memory_);
    VCP_VK(vkBindImageMemory, device.handle(), made.image_, made.memory_, 0);
    VkImageViewCreateInfo view{VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO};
    view.image = made.image_;
    view.viewType = VK_IMAGE_VIEW_TYPE_2D;
    view.format = format;
    view.subresourceRange = {aspect, 0, 1, 0, 1};
    VCP_VK(vkCreateImageView, device.handle(), &view, nullptr, &made.view_);
    return made;
}

RasterImage::~RasterImage() {
    if (device_ == VK_NULL_HANDLE) return;
    vkDestroyImageView(device_, view_, nullptr);
    vkDestroyImage(device_, image_, nullptr);
    vkFreeMemory(device_, memory_, nullptr);
}

Result<RasterPipeline> RasterPipeline::create(const Device& device, const RasterPipelineOptions& options) {
    if (!device.hasGraphics())
        return Error{.code = ErrorCode::Unsupported,
                     .message = "the queue of '" + device.info().name +
                                "' does not rasterize, which remeshed surfaces need; other methods march them"};
    RasterPipeline made;
    made.device_ = device.handle();
    made.colours_ = uint32_t(options.colours.size());
    VCP_TRY(made.createPass(options));
    std::vector<std::pair<VkShaderStageFlagBits, std::span<const uint32_t>>> codes{
        {VK_SHADER_STAGE_VERTEX_BIT, options.vertex}, {VK_SHADER_STAGE_FRAGMENT_BIT, options.fragment}};
    if (!options.control.empty()) {
        codes.emplace_back(VK_SHADER_STAGE_TESSELLATION_CONTROL_BIT, options.control);
        codes.emplace_back(VK_SHADER_STAGE_TESSELLATION_EVALUATION_BIT, options.evaluation);
    }
    for (const auto& [stage, code] : codes) made.pushStages_ |= stage;
    const VkPushConstantRange push{made.pushStages_, 0, options.pushBytes};
    VkPipelineLayoutCreateInfo layout{VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
    layout.setLayoutCount = options.set != VK_NULL_HANDLE ? 1 : 0;
    layout.pSetLayouts = &options.set;
    layout.pushConstantRangeCount = 1;
    layout.pPushConstantRanges = &push;
    VCP_VK(vkCreatePipelineLayout, device.handle(), &layout, nullptr, &made.layout_);
    std::vector<VkPipelineShaderStageCreateInfo> stages;
    const auto free = [&] {
        for (const auto& stage : stages) vkDestroyShaderModule(device.handle(), stage.module, nullptr);
    };
    for (const auto& [stage, code] : codes) {
        VkShaderModuleCreateInfo info{VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO};
        info.codeSize = code.size_bytes();
        info.pCode = code.data();
        VkPipelineShaderStageCreateInfo used{VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO};
        used.stage = stage;
        used.pName = "main";
        if (const VkResult result = vkCreateShaderModule(device.handle(), &info, nullptr, &used.module);
            result != VK_SUCCESS) {
            free();
            return vulkanError("vkCreateShaderModule", result);
        }
        stages.push_back(used);
    }
    const auto created = made.createPipeline(device, options, stages);
    free();
    if (!created) return created.error();
    return made;
}

Result<void> RasterPipeline::createPass(const RasterPipelineOptions& options) {
    std::vector<VkAttachmentDescription> attachments;
    std::vector<VkAttachmentReference> references;
    const auto add = [&](VkFormat format, VkAttachmentStoreOp store, VkImageLayout within, VkImageLayout after) {
        VkAttachmentDescription made{};
        made.format = format;
        made.samples = VK_SAMPLE_COUNT_1_BIT;
        made.loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR;
        made.storeOp = store;
        made.stencilLoadOp = VK_ATTACHMENT_LOAD_OP_DONT_CARE;
        made.stencilStoreOp = VK_ATTACHMENT_STORE_OP_DONT_CARE;
        made.initialLayout = VK_IMAGE_LAYOUT_UNDEFINED;
        made.finalLayout = after;
        references.push_back({uint32_t(attachments.size()), within});
        attachments.push_back(made);
    };
    for (const VkFormat format : options.colours)
        add(format, VK_ATTACHMENT_STORE_OP_STORE, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL,
            VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
    constexpr VkImageLayout kDepthLayout = VK_IMAGE_LAYOUT_DEPTH_STENCIL_ATTACHMENT_OPTIMAL;
    add(kDepth, VK_ATTACHMENT_STORE_OP_DONT_CARE, kDepthLayout, kDepthLayout);
    VkSubpassDescription subpass{};
    subpass.pipelineBindPoint = VK_PIPELINE_BIND_POINT_GRAPHICS;
    subpass.colorAttachmentCount = colours_;
    subpass.pColorAttachments = references.data();
    subpass.pDepthStencilAttachment = &references.back();
    constexpr VkPipelineStageFlags kDepthStages =
        VK_PIPELINE_STAGE_EARLY_FRAGMENT_TESTS_BIT | VK_PIPELINE_STAGE_LATE_FRAGMENT_TESTS_BIT;
    // The images were copied from, or drawn into, by the pass before.
    VkSubpassDependency dependencies[2] = {};
    dependencies[0].srcSubpass = VK_SUBPASS_EXTERNAL;
    dependencies[0].srcStageMask =
        VK_PIPELINE_STAGE_TRANSFER_BIT | VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT | kDepthStages;
    dependencies[0].srcAccessMask = VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT | VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT;
    dependencies[0].dstStageMask = VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT | kDepthStages;
    dependencies[0].dstAccessMask = VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT | VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_READ_BIT |
                                    VK_ACCESS_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT;
    dependencies[1].dstSubpass = VK_SUBPASS_EXTERNAL;
    dependencies[1].srcStageMask = VK_PIPELINE_STAGE_COLOR_ATTACHMENT_OUTPUT_BIT;
    dependencies[1].srcAccessMask = VK_ACCESS_COLOR_ATTACHMENT_WRITE_BIT;
    dependencies[1].dstStageMask = VK_PIPELINE_STAGE_TRANSFER_BIT;
    dependencies[1].dstAccessMask = VK_ACCESS_TRANSFER_READ_BIT;
    VkRenderPassCreateInfo info{VK_STRUCTURE_TYPE_RENDER_PASS_CREATE_INFO};
    info.attachmentCount = uint32_t(attachments.size());
    info.pAttachments = attachments.data();
    info.subpassCount = 1;
    info.pSubpasses = &subpass;
    info.dependencyCount = 2;
    info.pDependencies = dependencies;
    VCP_VK(vkCreateRenderPass, device_, &info, nullptr, &pass_);
    return {};
}

Result<void> RasterPipeline::createPipeline(const Device& device, const RasterPipelineOptions& options,
                                            std::span<const VkPipelineShaderStageCreateInfo> stages) {
    const VkVertexInputBindingDescription binding{0, options.vertexBytes, VK_VERTEX_INPUT_RATE_VERTEX};
    std::vector<VkVertexInputAttributeDescription> attributes;
    for (const auto& [format, offset] : options.attributes)
        attributes.push_back({uint32_t(attributes.size()), 0, format, offset});
    VkPipelineVertexInputStateCreateInfo input{VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO};
    input.vertexBindingDescriptionCount = attributes.empty() ? 0 : 1;
    input.pVertexBindingDescriptions = &binding;
    input.vertexAttributeDescriptionCount = uint32_t(attributes.size());
    input.pVertexAttributeDescriptions = attributes.data();
    VkPipelineInputAssemblyStateCreateInfo assembly{VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO};
    assembly.topology =
        options.control.empty() ? VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST : VK_PRIMITIVE_TOPOLOGY_PATCH_LIST;
    VkPipelineTessellationStateCreateInfo patches{VK_STRUCTURE_TYPE_PIPELINE_TESSELLATION_STATE_CREATE_INFO};
    patches.patchControlPoints = 3;
    VkPipelineViewportStateCreateInfo viewport{VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO};
    viewport.viewportCount = viewport.scissorCount = 1;
    VkPipelineRasterizationStateCreateInfo raster{VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO};
    raster.polygonMode = VK_POLYGON_MODE_FILL;
    raster.cullMode = VK_CULL_MODE_NONE;
    raster.lineWidth = 1;
    VkPipelineMultisampleStateCreateInfo samples{VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO};
    samples.rasterizationSamples = VK_SAMPLE_COUNT_1_BIT;
    VkPipelineDepthStencilStateCreateInfo depth{VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO};
    depth.depthTestEnable = depth.depthWriteEnable = VK_TRUE;
    depth.depthCompareOp = VK_COMPARE_OP_GREATER;
    VkPipelineColorBlendAttachmentState written{};
    written.colorWriteMask =
        VK_COLOR_COMPONENT_R_BIT | VK_COLOR_COMPONENT_G_BIT | VK_COLOR_COMPONENT_B_BIT | VK_COLOR_COMPONENT_A_BIT;
    const std::vector<VkPipelineColorBlendAttachmentState> blends(colours_, written);
    VkPipelineColorBlendStateCreateInfo blend{VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO};
    blend.attachmentCount = colours_;
    blend.pAttachments = blends.data();
    const VkDynamicState states[] = {VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
    VkPipelineDynamicStateCreateInfo dynamic{VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO};
    dynamic.dynamicStateCount = 2;
    dynamic.pDynamicStates = states;
    VkGraphicsPipelineCreateInfo info{VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO};
    info.stageCount = uint32_t(stages.size());
    info.pStages = stages.data();
    info.pVertexInputState = &input;
    info.pInputAssemblyState = &assembly;
    if (!options.control.empty()) info.pTessellationState = &patches;
    info.pViewportState = &viewport;
    info.pRasterizationState = &raster;
    info.pMultisampleState = &samples;
    info.pDepthStencilState = &depth;
    info.pColorBlendState = &blend;
    info.pDynamicState = &dynamic;
    info.layout = layout_;
    info.renderPass = pass_;
    VCP_VK(vkCreateGraphicsPipelines, device_, device.pipelineCache(), 1, &info, nullptr, &pipeline_);
    return {};
}

RasterPipeline::~RasterPipeline() {
    if (device_ == VK_NULL_HANDLE) return;
    vkDestroyPipeline(device_, pipeline_, nullptr);
    vkDestroyPipelineLayout(device_, layout_, nullptr);
    vkDestroyRenderPass(device_, pass_, nullptr);
}

void RasterPipeline::begin(VkCommandBuffer commands, VkFramebuffer target, VkExtent2D size) const {
    const std::vector<VkClearValue> clears(colours_ + 1, VkClearValue{});
    VkRenderPassBeginInfo info{VK_STRUCTURE_TYPE_RENDER_PASS_BEGIN_INFO};
    info.renderPass = pass_;
    info.framebuffer = target;
    info.renderArea = {{0, 0}, size};
    info.clearValueCount = uint32_t(clears.size());
    info.pClearValues = clears.data();
    vkCmdBeginRenderPass(commands, &info, VK_SUBPASS_CONTENTS_INLINE);
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline_);
    const VkViewport viewport{0, 0, float(size.width), float(size.height), 0, 1};
    vkCmdSetViewport(commands, 0, 1, &viewport);
    vkCmdSetScissor(commands, 0, 1, &info.renderArea);
}

void barrierComputeToDraw(VkCommandBuffer commands) {
    VkMemoryBarrier memory{VK_STRUCTURE_TYPE_MEMORY_BARRIER};
    memory.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT;
    memory.dstAccessMask =
        VK_ACCESS_INDIRECT_COMMAND_READ_BIT | VK_ACCESS_INDEX_READ_BIT | VK_ACCESS_VERTEX_ATTRIBUTE_READ_BIT;
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                         VK_PIPELINE_STAGE_DRAW_INDIRECT_BIT | VK_PIPELINE_STAGE_VERTEX_INPUT_BIT, 0, 1, &memory, 0,
                         nullptr, 0, nullptr);
}

Result<RasterTarget> RasterTarget::create(const Device& device, const RasterPipeline& pipeline,
                                          std::span<const VkFormat> colours, VkExtent2D size) {
    RasterTarget made;
    made.device_ = device.handle();
    made.size_ = size;
    for (const VkFormat format : colours) {
        VCP_TRY_ASSIGN(auto image,
                       RasterImage::create(device, format, size,
                                           VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT,
                                           VK_IMAGE_ASPECT_COLOR_BIT));
        made.images_.push_back(std::move(image));
    }
    VCP_TRY_ASSIGN(auto depth,
                   RasterImage::create(device, RasterPipeline::kDepth, size,
                                       VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT, VK_IMAGE_ASPECT_DEPTH_BIT));
    made.images_.push_back(std::move(depth));
    std::vector<VkImageView> views;
    for (const RasterImage& image : made.images_) views.push_back(image.view());
    VkFramebufferCreateInfo info{VK_STRUCTURE_TYPE_FRAMEBUFFER_CREATE_INFO};
    info.renderPass = pipeline.pass();
    info.attachmentCount = uint32_t(views.size());
    info.pAttachments = views.data();
    info.width = size.width;
    info.height = size.height;
    info.layers = 1;
    VCP_VK(vkCreateFramebuffer, device.handle(), &info, nullptr, &made.framebuffer_);
    return made;
}

RasterTarget::~RasterTarget() {
    if (device_ != VK_NULL_HANDLE) vkDestroyFramebuffer(device_, framebuffer_, nullptr);
}

void RasterTarget::copy(VkCommandBuffer commands, size_t colour, const Buffer& to) const {
    VkBufferImageCopy region{};
    region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
    region.imageExtent = {size_.width, size_.height, 1};
    vkCmdCopyImageToBuffer(commands, images_[colour].handle(), VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, to.handle(), 1,
                           &region);
}

}  // namespace vcp
