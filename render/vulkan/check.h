// Turns Vulkan results into errors; in release builds too.
#pragma once

#include <string>

#include <vulkan/vulkan_core.h>

#include "octree/io/result.h"

namespace vcp {

/// Says what a VkResult means, for a person.
const char* vulkanResultText(VkResult result);

/// Makes an error such as "vkQueueSubmit: device lost".
Error vulkanError(const char* call, VkResult result);

}  // namespace vcp

/// Returns an Error from the enclosing function unless the call gives VK_SUCCESS.
#define VCP_VK(function, ...)                                                  \
    do {                                                                       \
        if (const VkResult vcpVk = function(__VA_ARGS__); vcpVk != VK_SUCCESS) \
            return ::vcp::vulkanError(#function, vcpVk);                       \
    } while (false)
