// The Vulkan loader, a shared library of the machine: opened when a function of it is first called, so that programs
// start where there is none, and draw with the processor.
#pragma once

#include "octree/io/result.h"

namespace vcp {

/// Comes before the first call of Vulkan. Thread-safe, as vulkanFunction() is. Errors: Device (there is no loader).
Result<void> openVulkanLibrary();

/// Returns a function of the loader by its name, null where there is no such. What forward_vulkan.cmake writes calls
/// it.
void* vulkanFunction(const char* name);

}  // namespace vcp
