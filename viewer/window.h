// The window of `vcp view`: GLFW around a Viewer. It turns events into calls, waits while nothing happens,
// and draws when the viewer says so.
//
//   left drag            orbit about the point under the cursor    F          fit
//   right, middle drag,  pan                                       R, Home    reset
//   shift + left drag                                              L          light follows or stays
//   wheel                zoom to the cursor                        P          perspective or orthographic
//   1 3 7 9              front, right, top, isometric              Esc, Q     quit
#pragma once

#include <string>

#include <glm/vec2.hpp>

#include "octree/result.h"
#include "viewer/render_settings.h"
#include "viewer/viewer.h"

namespace vcp {

struct WindowOptions {
    glm::ivec2 size{1280, 800};  ///< in the window system's units
    std::string title;
};

/// What happened while the window was open; times from the call of showWindow.
struct WindowReport {
    std::optional<double> firstPictureSeconds;  ///< absent when it was closed before
    std::optional<double> settledSeconds;       ///< the first settled picture
    uint64_t framesDrawn = 0;
    ViewerStatus status;
};

/// Opens the window and returns when it is closed. Main thread only, one at a time (GLFW).
/// Errors: Device (no display, no Vulkan for it, and what the renderer says); those of the camera file.
Result<WindowReport> showWindow(const OpenDataset& open, const RenderSettings& settings, const WindowOptions& options);

}  // namespace vcp
