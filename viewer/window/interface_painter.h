// Dear ImGui over the window's picture: context, fonts, theme, and its own Vulkan backend (imgui_impl_vulkan).
//
//   painter->begin(framebufferSize);  // then ImGui calls
//   if (painter->end() || ...) renderer.present(width, height, painter->drawOver());
//
// Events reach ImGui through ImGui::GetIO(), in framebuffer pixels. One at a time, main thread, destroyed before
// the renderer.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <glm/vec2.hpp>

#include "octree/io/result.h"
#include "render/picture.h"
#include "render/view/renderer.h"
#include "viewer/window/theme.h"

struct ImDrawData;

namespace vcp {

class InterfacePainter {
public:
    /// How panels look. `scale`: pixels per unit of the layout; a high-density display asks for 2.
    struct Options {
        float scale = 1;
        bool isDark = true;
        bool operator==(const Options&) const = default;
    };

    /// `pictures` can be drawn by the panels (Look::pictures). Errors: Device.
    static Result<std::unique_ptr<InterfacePainter>> create(const WindowDrawing& window, const Options& options,
                                                            std::vector<Picture> pictures = {});
    ~InterfacePainter();
    InterfacePainter(const InterfacePainter&) = delete;
    InterfacePainter& operator=(const InterfacePainter&) = delete;

    /// Sets how panels look, between frames. Errors: Device.
    Result<void> setOptions(const Options& options);
    [[nodiscard]] const Look& look() const { return look_; }

    void begin(glm::ivec2 framebuffer);
    /// Ends the layout. Returns true when it looks other than the frame before.
    bool end();
    /// Returns a function that draws the last frame, in a window of its size.
    [[nodiscard]] DrawOver drawOver();

private:
    InterfacePainter(const WindowDrawing& window, std::vector<Picture> pictures)
        : window_(window), pictures_(std::move(pictures)) {}
    Result<void> start();
    void stop();
    void makeFonts();
    Result<void> uploadFont();

    WindowDrawing window_;
    VkDescriptorPool descriptors_ = VK_NULL_HANDLE;
    std::vector<Picture> pictures_;
    Options options_;
    Look look_;
    bool started_ = false;
    uint64_t shown_ = 0;
};

}  // namespace vcp
