// Brings words from the device's buffers to the CPU: directly where they are mapped, else by a copy.
#pragma once

#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "render/vulkan/device.h"

namespace vcp {

/// Returns `words` 32-bit words from `firstWord` on. Precondition: no frame is in flight; `source` may be copied from.
/// Errors: Device.
Result<std::vector<uint32_t>> readWords(Device& device, const Buffer& source, uint64_t firstWord, uint64_t words);

struct WordPlace {
    const Buffer* source;
    uint64_t word;
};

/// Returns words from several places, with one wait at most. Precondition: as for readWords. Errors: Device.
Result<std::vector<uint32_t>> readEach(Device& device, std::span<const WordPlace> places);

/// Unpacks a unit vector that hit_records.glsl packed.
glm::vec3 unpackNormal(uint32_t code);

}  // namespace vcp
