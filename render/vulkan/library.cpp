#include "render/vulkan/library.h"

#include <dlfcn.h>

#include <string>

#include "render/vulkan/device_info.h"

namespace vcp {

namespace {

constexpr const char* kVulkanLibrary = "libvulkan.so.1";

// The library stays open: what was made by it may outlive every object of ours.
void* library() {
    static void* const opened = dlopen(kVulkanLibrary, RTLD_NOW | RTLD_LOCAL);
    return opened;
}

}  // namespace

Result<void> openVulkanLibrary() {
    if (library() != nullptr) return {};
    return Error{.code = ErrorCode::Device,
                 .message = std::string("no Vulkan loader (") + kVulkanLibrary +
                            ") on this machine: install libvulkan1; " + kHostName + " draws pictures without Vulkan"};
}

void* vulkanFunction(const char* name) { return library() != nullptr ? dlsym(library(), name) : nullptr; }

}  // namespace vcp
