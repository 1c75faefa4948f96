#include "render/vulkan/check.h"

namespace vcp {

const char* vulkanResultText(VkResult result) {
    switch (result) {
        case VK_SUCCESS:
            return "success";
        case VK_ERROR_OUT_OF_HOST_MEMORY:
            return "out of memory";
        case VK_ERROR_OUT_OF_DEVICE_MEMORY:
            return "out of device memory; a smaller budget may help";
        case VK_ERROR_INITIALIZATION_FAILED:
            return "initialization failed";
        case VK_ERROR_DEVICE_LOST:
            return "the device was lost";
        case VK_ERROR_LAYER_NOT_PRESENT:
            return "validation layers are not installed";
        case VK_ERROR_EXTENSION_NOT_PRESENT:
            return "an extension is missing";
        case VK_ERROR_FEATURE_NOT_PRESENT:
            return "a feature is missing";
        case VK_ERROR_INCOMPATIBLE_DRIVER:
            return "no Vulkan driver is installed; host draws pictures without Vulkan";
        case VK_ERROR_SURFACE_LOST_KHR:
            return "the window is gone";
        case VK_ERROR_OUT_OF_DATE_KHR:
            return "the window changed";
        default:
            return "failed";
    }
}

Error vulkanError(const char* call, VkResult result) {
    return {.code = ErrorCode::Device,
            .message = std::string(call) + ": " + vulkanResultText(result) + " (VkResult " +
                       std::to_string(int(result)) + ")"};
}

}  // namespace vcp
