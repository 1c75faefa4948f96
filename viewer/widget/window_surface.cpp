#include "viewer/widget/window_surface.h"

#include <algorithm>
#include <cstring>

#include "render/vulkan/check.h"
#include "render/vulkan/library.h"

// These declarations are what three headers of Vulkan need of the window systems' own, which need not be installed.
struct xcb_connection_t;
using xcb_window_t = uint32_t;
using xcb_visualid_t = uint32_t;
struct _XDisplay;
using Display = _XDisplay;
using Window = unsigned long;
using VisualID = unsigned long;
struct wl_display;
struct wl_surface;

#include <vulkan/vulkan_wayland.h>
#include <vulkan/vulkan_xcb.h>
#include <vulkan/vulkan_xlib.h>

namespace vcp::widget {

namespace {

/// Calls vkCreateXcbSurfaceKHR and its like.
template <class Create, class Info>
VkResult create(VkInstance instance, const char* function, const Info& info, VkSurfaceKHR* surface) {
    const auto call = reinterpret_cast<Create>(vkGetInstanceProcAddr(instance, function));
    return call ? call(instance, &info, nullptr, surface) : VK_ERROR_EXTENSION_NOT_PRESENT;
}

VkResult createXcb(VkInstance instance, void* display, uint64_t window, VkSurfaceKHR* surface) {
    VkXcbSurfaceCreateInfoKHR info{};
    info.sType = VK_STRUCTURE_TYPE_XCB_SURFACE_CREATE_INFO_KHR;
    info.connection = static_cast<xcb_connection_t*>(display);
    info.window = static_cast<xcb_window_t>(window);
    return create<PFN_vkCreateXcbSurfaceKHR>(instance, "vkCreateXcbSurfaceKHR", info, surface);
}

VkResult createXlib(VkInstance instance, void* display, uint64_t window, VkSurfaceKHR* surface) {
    VkXlibSurfaceCreateInfoKHR info{};
    info.sType = VK_STRUCTURE_TYPE_XLIB_SURFACE_CREATE_INFO_KHR;
    info.dpy = static_cast<Display*>(display);
    info.window = static_cast<Window>(window);
    return create<PFN_vkCreateXlibSurfaceKHR>(instance, "vkCreateXlibSurfaceKHR", info, surface);
}

VkResult createWayland(VkInstance instance, void* display, uint64_t window, VkSurfaceKHR* surface) {
    VkWaylandSurfaceCreateInfoKHR info{};
    info.sType = VK_STRUCTURE_TYPE_WAYLAND_SURFACE_CREATE_INFO_KHR;
    info.display = static_cast<wl_display*>(display);
    info.surface = reinterpret_cast<wl_surface*>(uintptr_t(window));
    return create<PFN_vkCreateWaylandSurfaceKHR>(instance, "vkCreateWaylandSurfaceKHR", info, surface);
}

VkResult createByHost(const vcp_view_options& options, VkInstance instance, VkSurfaceKHR* surface) {
    uint64_t made = 0;
    const int32_t result = options.create_surface(options.create_surface_user, instance, &made);
    // A handle is a pointer or a number, depending on the machine.
    std::memcpy(surface, &made, sizeof(*surface));
    return result == VK_SUCCESS && made == 0 ? VK_ERROR_INITIALIZATION_FAILED : static_cast<VkResult>(result);
}

}  // namespace

Result<std::vector<std::string>> windowExtensions() {
    VCP_TRY(openVulkanLibrary());
    uint32_t count = 0;
    VCP_VK(vkEnumerateInstanceExtensionProperties, nullptr, &count, nullptr);
    std::vector<VkExtensionProperties> there(count);
    VCP_VK(vkEnumerateInstanceExtensionProperties, nullptr, &count, there.data());
    std::vector<std::string> names;
    for (const char* name : {VK_KHR_SURFACE_EXTENSION_NAME, VK_KHR_XCB_SURFACE_EXTENSION_NAME,
                             VK_KHR_XLIB_SURFACE_EXTENSION_NAME, VK_KHR_WAYLAND_SURFACE_EXTENSION_NAME})
        if (std::any_of(there.begin(), there.end(),
                        [&](const VkExtensionProperties& each) { return std::strcmp(each.extensionName, name) == 0; }))
            names.emplace_back(name);
    if (names.size() < 2) return Error{.code = ErrorCode::Device, .message = "Vulkan cannot draw into windows here"};
    return names;
}

Result<std::optional<SurfaceSource>> surfaceSource(const vcp_view_options& options) {
    const auto wrong = [](const char* what) { return Error{.code = ErrorCode::Usage, .message = what}; };
    SurfaceSource source;
    switch (options.window_system) {
        case VCP_WINDOW_NONE:
            return std::optional<SurfaceSource>{};
        case VCP_WINDOW_CALLBACK:
            if (!options.create_surface) return wrong("the view has no create_surface");
            source.createSurface = [options](VkInstance instance, VkSurfaceKHR* surface) {
                return createByHost(options, instance, surface);
            };
            return std::optional(std::move(source));
        case VCP_WINDOW_XCB:
        case VCP_WINDOW_XLIB:
        case VCP_WINDOW_WAYLAND:
            break;
        default:
            return wrong("there is no such window_system");
    }
    if (!options.display || options.window == 0) return wrong("the view has no display, or no window");
    const auto system = options.window_system == VCP_WINDOW_XCB    ? createXcb
                        : options.window_system == VCP_WINDOW_XLIB ? createXlib
                                                                   : createWayland;
    source.createSurface = [system, display = options.display, window = options.window](VkInstance instance,
                                                                                        VkSurfaceKHR* surface) {
        return system(instance, display, window, surface);
    };
    return std::optional(std::move(source));
}

}  // namespace vcp::widget
