// Dear ImGui over the window's picture: context, font, and its own Vulkan backend (imgui_impl_vulkan).
//
//   painter->begin(framebufferSize);  // then ImGui calls
//   if (painter->end() || ...) renderer.present(width, height, painter->drawOver());
//
// Events reach ImGui through ImGui::GetIO(), in framebuffer pixels. One at a time, main thread, destroyed before
// the renderer.
#pragma once

#include <cstdint>
#include <memory>

#include <glm/vec2.hpp>

#include "octree/io/result.h"
#include "render/renderer.h"

struct ImDrawData;

namespace vcp {

class InterfacePainter {
public:
    /// `scale` 1 is a 13 pixel font; a high-density display asks for 2. Errors: Device.
    static Result<std::unique_ptr<InterfacePainter>> create(const WindowDrawing& window, float scale);
    ~InterfacePainter();
    InterfacePainter(const InterfacePainter&) = delete;
    InterfacePainter& operator=(const InterfacePainter&) = delete;

    /// Sets the scale, between frames. Errors: Device.
    Result<void> setScale(float scale);
    [[nodiscard]] float scale() const { return scale_; }

    void begin(glm::ivec2 framebuffer);
    /// Ends the layout. Returns true when it looks other than the frame before.
    bool end();
    /// Returns a function that draws the last frame, in a window of its size.
    [[nodiscard]] DrawOver drawOver();

private:
    explicit InterfacePainter(const WindowDrawing& window) : window_(window) {}
    Result<void> start();
    void stop();
    Result<void> uploadFont();

    WindowDrawing window_;
    VkDescriptorPool descriptors_ = VK_NULL_HANDLE;
    float scale_ = 1;
    bool started_ = false;
    uint64_t shown_ = 0;
};

}  // namespace vcp
