#include "viewer/window/interface_painter.h"

#include <algorithm>
#include <cmath>
#include <span>

#include <backends/imgui_impl_vulkan.h>
#include <imgui.h>

#include "octree/io/content_hash.h"
#include "render/vulkan/check.h"

namespace vcp {

namespace {

constexpr float kFontPixels = 13;
// The backend cycles through so many vertex buffers. Of the pictures that are presented, two are in flight at most.
constexpr uint32_t kBuffers = 2;
constexpr uint32_t kMostDescriptors = 8;

uint64_t hashOf(const void* bytes, size_t size) {
    return hashBytes(std::span(static_cast<const std::byte*>(bytes), size));
}

uint64_t hashOf(const ImDrawData& drawing) {
    uint64_t hash = 0;
    const auto add = [&](uint64_t more) { hash = hash * 0x9e3779b97f4a7c15u + more; };
    for (int i = 0; i < drawing.CmdListsCount; ++i) {
        const ImDrawList& list = *drawing.CmdLists[i];
        add(hashOf(list.VtxBuffer.Data, size_t(list.VtxBuffer.size_in_bytes())));
        add(hashOf(list.IdxBuffer.Data, size_t(list.IdxBuffer.size_in_bytes())));
        for (const ImDrawCmd& command : list.CmdBuffer) add(hashOf(&command.ClipRect, sizeof(command.ClipRect)));
    }
    return hash;
}

}  // namespace

Result<std::unique_ptr<InterfacePainter>> InterfacePainter::create(const WindowDrawing& window, float scale) {
    std::unique_ptr<InterfacePainter> painter(new InterfacePainter(window));
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;
    const VkDescriptorPoolSize samplers{VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, kMostDescriptors};
    VkDescriptorPoolCreateInfo info{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
    info.flags = VK_DESCRIPTOR_POOL_CREATE_FREE_DESCRIPTOR_SET_BIT;
    info.maxSets = kMostDescriptors;
    info.poolSizeCount = 1;
    info.pPoolSizes = &samplers;
    VCP_VK(vkCreateDescriptorPool, window.device, &info, nullptr, &painter->descriptors_);
    VCP_TRY(painter->setScale(scale));
    return painter;
}

InterfacePainter::~InterfacePainter() {
    stop();
    vkDestroyDescriptorPool(window_.device, descriptors_, nullptr);
    ImGui::DestroyContext();
}

Result<void> InterfacePainter::setScale(float scale) {
    stop();
    // The built-in font is a bitmap: only whole multiples of its size are sharp.
    scale_ = std::clamp(std::round(scale), 1.0f, 8.0f);
    ImGui::GetStyle() = ImGuiStyle();
    ImGui::StyleColorsDark();
    ImGui::GetStyle().ScaleAllSizes(scale_);
    ImFontConfig config;
    config.SizePixels = kFontPixels * scale_;
    ImFontAtlas& fonts = *ImGui::GetIO().Fonts;
    fonts.Clear();
    fonts.AddFontDefault(&config);
    return start();
}

Result<void> InterfacePainter::start() {
    ImGui_ImplVulkan_InitInfo info{};
    info.Instance = window_.instance;
    info.PhysicalDevice = window_.physical;
    info.Device = window_.device;
    info.QueueFamily = window_.queueFamily;
    info.Queue = window_.queue;
    info.DescriptorPool = descriptors_;
    info.MinImageCount = info.ImageCount = kBuffers;
    info.MSAASamples = VK_SAMPLE_COUNT_1_BIT;
#if IMGUI_VERSION_NUM >= 19030
    info.RenderPass = window_.renderPass;
    ImGui_ImplVulkan_Init(&info);
#else
    ImGui_ImplVulkan_Init(&info, window_.renderPass);
#endif
    started_ = true;
    return uploadFont();
}

void InterfacePainter::stop() {
    if (!started_) return;
    vkDeviceWaitIdle(window_.device);
    ImGui_ImplVulkan_Shutdown();
    started_ = false;
}

Result<void> InterfacePainter::uploadFont() {
#if IMGUI_VERSION_NUM < 19000
    VkCommandPoolCreateInfo poolInfo{VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
    poolInfo.queueFamilyIndex = window_.queueFamily;
    VkCommandPool pool = VK_NULL_HANDLE;
    VCP_VK(vkCreateCommandPool, window_.device, &poolInfo, nullptr, &pool);
    const auto upload = [&]() -> Result<void> {
        VkCommandBufferAllocateInfo allocation{VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO};
        allocation.commandPool = pool;
        allocation.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
        allocation.commandBufferCount = 1;
        VkCommandBuffer commands = VK_NULL_HANDLE;
        VCP_VK(vkAllocateCommandBuffers, window_.device, &allocation, &commands);
        VkCommandBufferBeginInfo begin{VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
        VCP_VK(vkBeginCommandBuffer, commands, &begin);
        if (!ImGui_ImplVulkan_CreateFontsTexture(commands))
            return Error{.code = ErrorCode::Device, .message = "no memory for the window's font"};
        VCP_VK(vkEndCommandBuffer, commands);
        VkSubmitInfo submit{VK_STRUCTURE_TYPE_SUBMIT_INFO};
        submit.commandBufferCount = 1;
        submit.pCommandBuffers = &commands;
        VCP_VK(vkQueueSubmit, window_.queue, 1, &submit, VkFence(VK_NULL_HANDLE));
        VCP_VK(vkQueueWaitIdle, window_.queue);
        return {};
    }();
    vkDestroyCommandPool(window_.device, pool, nullptr);
    ImGui_ImplVulkan_DestroyFontUploadObjects();
    return upload;
#else
    return {};  // the backend recovers by itself
#endif
}

void InterfacePainter::begin(glm::ivec2 framebuffer) {
    ImGuiIO& io = ImGui::GetIO();
    io.DisplaySize = ImVec2(float(framebuffer.x), float(framebuffer.y));
    io.DeltaTime = 1.0f / 60;
    ImGui_ImplVulkan_NewFrame();
    ImGui::NewFrame();
}

bool InterfacePainter::end() {
    ImGui::Render();
    const uint64_t hash = hashOf(*ImGui::GetDrawData());
    return std::exchange(shown_, hash) != hash;
}

DrawOver InterfacePainter::drawOver() {
    return [](VkCommandBuffer commands, VkExtent2D size) {
        ImDrawData* drawing = ImGui::GetDrawData();
        // A window that has just changed its size is laid out anew at once.
        const bool fits =
            drawing && drawing->DisplaySize.x <= float(size.width) && drawing->DisplaySize.y <= float(size.height);
        if (fits) ImGui_ImplVulkan_RenderDrawData(drawing, commands);
    };
}

}  // namespace vcp
