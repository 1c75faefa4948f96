// From the device's buffers to the CPU: directly where they are mapped, else by a copy.
#pragma once

#include <span>
#include <vector>

#include "render/vulkan/device.h"

namespace vcp {

/// Copies `words` 32-bit words from `firstWord` on. Precondition: no frame in flight; `source` may be
/// copied from. Errors: Device.
Result<std::vector<uint32_t>> readWords(Device& device, const Buffer& source, uint64_t firstWord, uint64_t words);

}  // namespace vcp
