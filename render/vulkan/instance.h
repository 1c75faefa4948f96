// The Vulkan instance, what its validation layers say, and the choice of a device.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include <vulkan/vulkan_core.h>

#include "octree/io/result.h"
#include "render/vulkan/device_info.h"

namespace vcp {

/// Collects warnings and errors of the validation layers. Any thread may add; a spin lock, for there are few or none.
class ValidationLog {
public:
    void add(std::string message);
    [[nodiscard]] std::vector<std::string> messages() const;

private:
    mutable std::atomic_flag busy_;
    std::vector<std::string> messages_;
};

class Instance {
public:
    /// Makes an instance of Vulkan 1.2. With `validation`: core and synchronization checks into log(). Errors: Device.
    static Result<std::unique_ptr<Instance>> create(bool validation, const std::vector<std::string>& extensions);
    /// Wraps the host's instance, which the host keeps.
    static std::unique_ptr<Instance> borrow(VkInstance instance);
    ~Instance();
    Instance(const Instance&) = delete;
    Instance& operator=(const Instance&) = delete;

    [[nodiscard]] VkInstance handle() const { return instance_; }
    [[nodiscard]] const ValidationLog& log() const { return *log_; }
    Result<std::vector<VkPhysicalDevice>> physicalDevices() const;

private:
    Instance() = default;
    Result<void> connectLog();

    VkInstance instance_ = VK_NULL_HANDLE;
    bool borrowed_ = false;
    VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
    std::unique_ptr<ValidationLog> log_ = std::make_unique<ValidationLog>();
};

DeviceInfo describeDevice(VkPhysicalDevice device, uint32_t index);

/// Returns the index of the device that `choice` means among `devices` (pure; see RendererOptions::device). An empty
/// choice takes the usable device of the best type: discrete, integrated, virtual, other, cpu; among equals the first.
/// Errors: Device, naming the devices there are.
Result<uint32_t> chooseDevice(const std::vector<DeviceInfo>& devices, const std::string& choice);

}  // namespace vcp
