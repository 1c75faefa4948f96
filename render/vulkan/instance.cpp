#include "render/vulkan/instance.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <limits>

#include "render/vulkan/check.h"
#include "render/vulkan/library.h"

namespace vcp {

namespace {

VKAPI_ATTR VkBool32 VKAPI_CALL onMessage(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                         const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
    static_cast<ValidationLog*>(user)->add(data->pMessage);
    return VK_FALSE;
}

VkDebugUtilsMessengerCreateInfoEXT messengerInfo(ValidationLog* log) {
    VkDebugUtilsMessengerCreateInfoEXT info{VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT};
    info.messageSeverity =
        VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT;
    info.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT;
    info.pfnUserCallback = onMessage;
    info.pUserData = log;
    return info;
}

const char* typeName(VkPhysicalDeviceType type) {
    switch (type) {
        case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
            return "discrete";
        case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
            return "integrated";
        case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
            return "virtual";
        case VK_PHYSICAL_DEVICE_TYPE_CPU:
            return "cpu";
        default:
            return "other";
    }
}

bool hasComputeQueue(VkPhysicalDevice device) {
    uint32_t count = 0;
    vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
    return std::any_of(families.begin(), families.end(),
                       [](const auto& f) { return (f.queueFlags & VK_QUEUE_COMPUTE_BIT) != 0; });
}

int typeScore(const DeviceInfo& device) {
    constexpr const char* kOrder[] = {"cpu", "other", "virtual", "integrated", "discrete"};
    const auto* at = std::find(std::begin(kOrder), std::end(kOrder), device.type);
    return int(at - std::begin(kOrder));
}

std::string lower(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    return text;
}

Error noDevice(const std::vector<DeviceInfo>& devices, const std::string& what) {
    std::string text = what;
    if (devices.empty())
        text += "; install a Vulkan driver (mesa-vulkan-drivers has one for machines without a GPU)";
    else
        text += "; there is";
    for (const DeviceInfo& device : devices)
        text += (device.index == 0 ? " " : ", ") + std::to_string(device.index) + ": " + device.name +
                (device.usable ? "" : " (no Vulkan 1.2)");
    text += std::string("; ") + kHostName + " draws pictures without Vulkan";
    return {.code = ErrorCode::Device, .message = text};
}

}  // namespace

void ValidationLog::add(std::string message) {
    while (busy_.test_and_set(std::memory_order_acquire)) busy_.wait(true);
    messages_.push_back(std::move(message));
    busy_.clear(std::memory_order_release);
    busy_.notify_one();
}

std::vector<std::string> ValidationLog::messages() const {
    while (busy_.test_and_set(std::memory_order_acquire)) busy_.wait(true);
    std::vector<std::string> copy = messages_;
    busy_.clear(std::memory_order_release);
    busy_.notify_one();
    return copy;
}

Result<std::unique_ptr<Instance>> Instance::create(bool validation, const std::vector<std::string>& extensions) {
    VCP_TRY(openVulkanLibrary());
    std::unique_ptr<Instance> made(new Instance);
    std::vector<const char*> names;
    for (const std::string& name : extensions) names.push_back(name.c_str());
    std::vector<const char*> layers;
    if (validation) {
        layers.push_back("VK_LAYER_KHRONOS_validation");
        names.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
        names.push_back(VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME);
    }

    VkApplicationInfo application{VK_STRUCTURE_TYPE_APPLICATION_INFO};
    application.pApplicationName = "vcp";
    application.apiVersion = VK_API_VERSION_1_2;

    const VkValidationFeatureEnableEXT sync = VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;
    VkValidationFeaturesEXT features{VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT};
    features.enabledValidationFeatureCount = 1;
    features.pEnabledValidationFeatures = &sync;
    VkDebugUtilsMessengerCreateInfoEXT messenger = messengerInfo(made->log_.get());
    messenger.pNext = &features;

    VkInstanceCreateInfo info{VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO};
    info.pNext = validation ? &messenger : nullptr;
    info.pApplicationInfo = &application;
    info.enabledLayerCount = uint32_t(layers.size());
    info.ppEnabledLayerNames = layers.data();
    info.enabledExtensionCount = uint32_t(names.size());
    info.ppEnabledExtensionNames = names.data();
    VCP_VK(vkCreateInstance, &info, nullptr, &made->instance_);
    if (validation) VCP_TRY(made->connectLog());
    return made;
}

Result<void> Instance::connectLog() {
    const auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
        vkGetInstanceProcAddr(instance_, "vkCreateDebugUtilsMessengerEXT"));
    if (create == nullptr) return vulkanError("vkCreateDebugUtilsMessengerEXT", VK_ERROR_EXTENSION_NOT_PRESENT);
    const VkDebugUtilsMessengerCreateInfoEXT info = messengerInfo(log_.get());
    VCP_VK(create, instance_, &info, nullptr, &messenger_);
    return {};
}

std::unique_ptr<Instance> Instance::borrow(VkInstance instance) {
    std::unique_ptr<Instance> made(new Instance);
    made->instance_ = instance;
    made->borrowed_ = true;
    return made;
}

Instance::~Instance() {
    if (borrowed_) return;
    if (messenger_ != VK_NULL_HANDLE) {
        const auto destroy = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
            vkGetInstanceProcAddr(instance_, "vkDestroyDebugUtilsMessengerEXT"));
        destroy(instance_, messenger_, nullptr);
    }
    if (instance_ != VK_NULL_HANDLE) vkDestroyInstance(instance_, nullptr);
}

Result<std::vector<VkPhysicalDevice>> Instance::physicalDevices() const {
    uint32_t count = 0;
    VCP_VK(vkEnumeratePhysicalDevices, instance_, &count, nullptr);
    std::vector<VkPhysicalDevice> devices(count);
    if (count > 0) VCP_VK(vkEnumeratePhysicalDevices, instance_, &count, devices.data());
    devices.resize(count);
    return devices;
}

DeviceInfo describeDevice(VkPhysicalDevice device, uint32_t index) {
    VkPhysicalDeviceDriverProperties driver{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES};
    VkPhysicalDeviceProperties2 properties{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2};
    VkPhysicalDeviceProperties basic;
    vkGetPhysicalDeviceProperties(device, &basic);
    const bool modern = basic.apiVersion >= VK_API_VERSION_1_2;
    if (modern) {
        properties.pNext = &driver;
        vkGetPhysicalDeviceProperties2(device, &properties);
    }
    DeviceInfo info;
    info.index = index;
    info.name = basic.deviceName;
    info.type = typeName(basic.deviceType);
    info.driver = modern ? std::string(driver.driverName) + " " + driver.driverInfo : "";
    info.software = basic.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU;
    info.usable = modern && hasComputeQueue(device);
    return info;
}

Result<uint32_t> chooseDevice(const std::vector<DeviceInfo>& devices, const std::string& choice) {
    const auto usable = [&](const DeviceInfo& device) -> Result<uint32_t> {
        if (!device.usable) return noDevice(devices, "device '" + device.name + "' has no Vulkan 1.2 with compute");
        return device.index;
    };
    if (choice.empty()) {
        const DeviceInfo* best = nullptr;
        for (const DeviceInfo& device : devices)
            if (device.usable && (best == nullptr || typeScore(device) > typeScore(*best))) best = &device;
        if (best == nullptr) return noDevice(devices, "no Vulkan 1.2 device");
        return best->index;
    }
    uint32_t index = 0;
    const auto [end, error] = std::from_chars(choice.data(), choice.data() + choice.size(), index);
    if (error == std::errc() && end == choice.data() + choice.size()) {
        if (index >= devices.size()) return noDevice(devices, "no Vulkan device " + choice);
        return usable(devices[index]);
    }
    for (const DeviceInfo& device : devices)
        if (lower(device.name).find(lower(choice)) != std::string::npos) return usable(device);
    return noDevice(devices, "no Vulkan device is called '" + choice + "'");
}

bool isHostName(const std::string& choice) { return lower(choice) == kHostName; }

Result<std::vector<DeviceInfo>> listDevices(const std::string& choice) {
    VCP_TRY_ASSIGN(auto instance, Instance::create(false, {}));
    VCP_TRY_ASSIGN(auto physical, instance->physicalDevices());
    std::vector<DeviceInfo> devices;
    for (uint32_t i = 0; i < physical.size(); ++i) devices.push_back(describeDevice(physical[i], i));
    VCP_TRY_ASSIGN(auto chosen, chooseDevice(devices, choice));
    devices[chosen].chosen = true;
    return devices;
}

}  // namespace vcp
