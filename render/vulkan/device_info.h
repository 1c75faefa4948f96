// What is known of a Vulkan device before it is made, and what it is made from.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <vulkan/vulkan_core.h>

#include "octree/io/result.h"

namespace vcp {

/// A Vulkan device as `vcp devices` shows it.
struct DeviceInfo {
    uint32_t index = 0;  ///< in the order of the Vulkan loader
    std::string name;
    std::string type;    ///< "discrete", "integrated", "virtual", "cpu", "other"
    std::string driver;  ///< name and version
    bool software = false;
    bool usable = false;  ///< Vulkan 1.2 with a compute queue
    bool chosen = false;  ///< the device that the given choice, or an empty one, selects
};

/// Lists the devices of this machine; `choice`, as in RendererOptions::device, marks the chosen one.
/// Errors: Device, where Vulkan cannot be loaded or there is no device, or where `choice` names none.
Result<std::vector<DeviceInfo>> listDevices(const std::string& choice = {});

/// The processor as what draws pictures, without Vulkan: it is called so, in any case, among devices.
inline constexpr const char* kHostName = "host";
bool isHostName(const std::string& choice);
/// Returns the name of what cast a frame's rays. `onHost`: as in FrameStats.
inline std::string castBy(const DeviceInfo& device, bool onHost) { return onHost ? kHostName : device.name; }

/// What a window gives: the instance extensions it needs and a function that makes the surface
/// (glfwGetRequiredInstanceExtensions, glfwCreateWindowSurface).
struct SurfaceSource {
    std::vector<std::string> instanceExtensions;
    std::function<VkResult(VkInstance, VkSurfaceKHR*)> createSurface;
};

/// A device that the host made and keeps. It needs Vulkan 1.2 and no feature. Where views have windows, it also needs
/// the extension VK_KHR_swapchain, and a queue with graphics that can show pictures in them.
struct HostDevice {
    VkInstance instance = VK_NULL_HANDLE;
    VkPhysicalDevice physical = VK_NULL_HANDLE;
    VkDevice device = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;  ///< calls of the renderer use it, in the calling thread, and at no other time
    uint32_t queueFamily = 0;        ///< the queue's family, which can compute
};

/// What goes wrong, or is lacking, on purpose: for tests.
struct DeviceFaults {
    bool separateMemory = false;        ///< the CPU does not see the device's memory, as on a discrete GPU
    bool separateCopies = false;        ///< copies are submitted beside other work, as to a queue of their own
    uint64_t memoryBytes = UINT64_MAX;  ///< the device has no more memory than this
    uint64_t lostAtSubmission = 0;      ///< the device is lost at this submission of work, once; 0: never
};

/// How shaders read pages: Auto takes texel buffers on software devices that have long ones, storage buffers elsewhere.
enum class PageAccess { Auto, TexelBuffer, StorageBuffer };

}  // namespace vcp
