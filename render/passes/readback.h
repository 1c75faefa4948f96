// From the device's buffers to the CPU: directly where they are mapped, else by a copy.
#pragma once

#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "render/vulkan/device.h"

namespace vcp {

/// Copies `words` 32-bit words from `firstWord` on. Precondition: no frame in flight; `source` may be
/// copied from. Errors: Device.
Result<std::vector<uint32_t>> readWords(Device& device, const Buffer& source, uint64_t firstWord, uint64_t words);

struct WordPlace {
    const Buffer* source;
    uint64_t word;
};

/// Words from several places, with one wait at most. Precondition: as readWords. Errors: Device.
Result<std::vector<uint32_t>> readEach(Device& device, std::span<const WordPlace> places);

/// A unit vector as hit_records.glsl packs it.
glm::vec3 unpackNormal(uint32_t code);

}  // namespace vcp
