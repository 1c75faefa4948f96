// The window of `vcp view`: GLFW around a ViewSession and its panels. It turns events into calls, waits while nothing
// happens, and draws when the session says so. What keys and the mouse do: key_map.cpp.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <glm/common.hpp>
#include <glm/vec2.hpp>

#include "octree/io/result.h"
#include "viewer/window/view_session.h"

namespace vcp {

struct WindowOptions {
    SessionOptions session;
    std::optional<glm::ivec2> size;  ///< in the window system's units; absent: the size it had last time
    /// Returns an object; while it is held, Ctrl-C is caught: as long as something is being built. May be empty.
    std::function<std::shared_ptr<void>()> catchInterrupts;
    std::function<bool()> interrupted;  ///< true ends the window; may be empty
};

/// What happened while the window was open; times from the call of showWindow.
struct WindowReport {
    std::optional<double> windowSeconds;        ///< something was on the screen
    std::optional<double> previewSeconds;       ///< something of a mesh that is being built
    std::optional<double> firstPictureSeconds;  ///< first picture of a dataset; absent when it was closed before
    std::optional<double> settledSeconds;       ///< the first settled picture
    uint64_t framesDrawn = 0;
    ViewerStatus status;
    std::string problem;      ///< the problem that the window showed when it was closed
    SettingsChanges changes;  ///< to be remembered
};

/// Returns a window's size in units of a display that is not scaled, from which it is made (GLFW_SCALE_TO_MONITOR):
/// where the window system counts pixels, `window` has grown by `scale`.
inline glm::ivec2 unscaledSize(glm::ivec2 window, glm::ivec2 framebuffer, glm::dvec2 scale) {
    if (window != framebuffer || !(scale.x > 0 && scale.y > 0)) return window;
    return glm::ivec2(glm::round(glm::dvec2(window) / scale));
}

/// Returns a window's size in the same units that fits on a screen with room for `room` pixels, where there are some.
inline glm::ivec2 fittingSize(glm::ivec2 size, glm::ivec2 room, glm::dvec2 scale) {
    if (!(room.x > 0 && room.y > 0 && scale.x > 0 && scale.y > 0)) return size;
    return glm::min(size, glm::ivec2(glm::dvec2(room) / scale));
}

/// Opens the window at once, the inputs in it as soon as they are built, and returns when it is closed. Main thread
/// only, one at a time (GLFW). Errors: Device (no display, no Vulkan for it, and what the renderer says).
Result<WindowReport> showWindow(const WindowOptions& options);

}  // namespace vcp
