// Makes Vulkan surfaces of the host's windows.
#pragma once

#include "render/view/renderer.h"
#include "viewer/widget/vcp.h"

namespace vcp::widget {

/// Returns the instance extensions for windows that vcp.h knows and this machine has. Errors: Device.
Result<std::vector<std::string>> windowExtensions();

/// Returns how to make a view's surface; nothing for views without a window. Errors: Usage.
Result<std::optional<SurfaceSource>> surfaceSource(const vcp_view_options& options);

}  // namespace vcp::widget
