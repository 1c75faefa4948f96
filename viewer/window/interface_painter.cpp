#include "viewer/window/interface_painter.h"

#include <algorithm>
#include <cmath>
#include <span>

#include <backends/imgui_impl_vulkan.h>
#include <imgui.h>

#include "octree/io/content_hash.h"
#include "render/vulkan/check.h"
#include "viewer/annotation/fonts.h"

namespace vcp {

namespace {

// Heights of lines, in units of the layout: letters are 0.83 of it.
constexpr float kBodyHeight = 16, kSmallHeight = 14, kTitleHeight = 32, kIconHeight = 16, kTitleIconHeight = 28;
// Icons stand on their own baseline: so far below that of letters are they centred in a line.
constexpr float kIconDrop = 1.5f;
// From here on letters are large enough without samples between pixels.
constexpr float kSharpScale = 2;
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

Result<std::unique_ptr<InterfacePainter>> InterfacePainter::create(const WindowDrawing& window, const Options& options,
                                                                   std::vector<Picture> pictures) {
    std::unique_ptr<InterfacePainter> painter(new InterfacePainter(window, std::move(pictures)));
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;
    const VkDescriptorPoolSize samplers{VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, kMostDescriptors};
    VkDescriptorPoolCreateInfo info{VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO};
    info.flags = VK_DESCRIPTOR_POOL_CREATE_FREE_DESCRIPTOR_SET_BIT;
    info.maxSets = kMostDescriptors;
    info.poolSizeCount = 1;
    info.pPoolSizes = &samplers;
    VCP_VK(vkCreateDescriptorPool, window.device, &info, nullptr, &painter->descriptors_);
    VCP_TRY(painter->setOptions(options));
    return painter;
}

InterfacePainter::~InterfacePainter() {
    stop();
    vkDestroyDescriptorPool(window_.device, descriptors_, nullptr);
    ImGui::DestroyContext();
}

Result<void> InterfacePainter::setOptions(const Options& options) {
    const Options before = std::exchange(options_, options);
    if (started_ && before == options) return {};
    look_.palette = paletteOf(options.isDark);
    applyPalette(look_.palette, options.scale);
    if (started_ && before.scale == options.scale) return {};
    stop();
    look_.scale = options.scale;
    makeFonts();
    return start();
}

/// Fills the fonts' texture: letters, icons, and the pictures.
void InterfacePainter::makeFonts() {
    // Ranges of characters; Dear ImGui reads them when it makes the texture.
    static constexpr ImWchar kAll[] = {0x20, 0x17f, 0x370, 0x52f, 0x2009, 0x2265, 0};
    static constexpr ImWchar kWestern[] = {0x20, 0xff, 0x2009, 0x2265, 0, 0};
    static constexpr ImWchar kIconRange[] = {0xf000, 0xf700, 0};
    ImFontAtlas& atlas = *ImGui::GetIO().Fonts;
    atlas.Clear();
    atlas.Flags |= ImFontAtlasFlags_NoPowerOfTwoHeight;
    const auto add = [&](std::span<const unsigned char> file, float height, const ImWchar* ranges, float drop,
                         bool isMerged) {
        ImFontConfig config;
        config.FontDataOwnedByAtlas = false;
        config.MergeMode = isMerged;
        config.PixelSnapH = true;
        config.OversampleH = look_.scale < kSharpScale ? 2 : 1;
        config.GlyphOffset.y = std::round(drop * look_.scale);
        // The atlas only reads what it does not own.
        return atlas.AddFontFromMemoryTTF(const_cast<unsigned char*>(file.data()), int(file.size()),
                                          std::round(height * look_.scale), &config, ranges);
    };
    const auto withIcons = [&](ImFont* font, float height) {
        add(kIcons, height, kIconRange, kIconDrop * height / kIconHeight, true);
        return font;
    };
    look_.body = withIcons(add(kInterRegular, kBodyHeight, kAll, 0, false), kIconHeight);
    look_.strong = withIcons(add(kInterSemibold, kBodyHeight, kAll, 0, false), kIconHeight);
    look_.small = add(kInterRegular, kSmallHeight, kAll, 0, false);
    look_.title = withIcons(add(kInterSemibold, kTitleHeight, kWestern, 0, false), kTitleIconHeight);
    std::vector<int> places;
    for (const Picture& picture : pictures_)
        places.push_back(atlas.AddCustomRectRegular(int(picture.width), int(picture.height)));
    unsigned char* texels = nullptr;
    int width = 0, height = 0;
    atlas.GetTexDataAsRGBA32(&texels, &width, &height);
    look_.pictures.clear();
    for (size_t i = 0; i < pictures_.size(); ++i) {
        const ImFontAtlasCustomRect& place = *atlas.GetCustomRectByIndex(places[i]);
        const size_t row = size_t{pictures_[i].width} * 4;
        for (size_t y = 0; y < pictures_[i].height; ++y)
            std::copy_n(&pictures_[i].rgba[y * row], row,
                        texels + (size_t{place.Y} + y) * size_t(width) * 4 + size_t{place.X} * 4);
        Look::Texture& texture = look_.pictures.emplace_back();
        atlas.CalcCustomRectUV(&place, &texture.from, &texture.to);
    }
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
