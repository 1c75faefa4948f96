// Morton codes: the order of pages within a level.
#pragma once

#include <cstdint>

#include <glm/vec3.hpp>

namespace vcp {

/// Interleaves three 21-bit coordinates, x lowest.
inline uint64_t mortonEncode(glm::u32vec3 cell) {
    const auto spread = [](uint64_t v) {
        v &= 0x1fffff;
        v = (v | v << 32) & 0x1f00000000ffff;
        v = (v | v << 16) & 0x1f0000ff0000ff;
        v = (v | v << 8) & 0x100f00f00f00f00f;
        v = (v | v << 4) & 0x10c30c30c30c30c3;
        return (v | v << 2) & 0x1249249249249249;
    };
    return spread(cell.x) | spread(cell.y) << 1 | spread(cell.z) << 2;
}

/// The coordinates that mortonEncode interleaved.
inline glm::u32vec3 mortonDecode(uint64_t code) {
    const auto gather = [](uint64_t v) {
        v &= 0x1249249249249249;
        v = (v | v >> 2) & 0x10c30c30c30c30c3;
        v = (v | v >> 4) & 0x100f00f00f00f00f;
        v = (v | v >> 8) & 0x1f0000ff0000ff;
        v = (v | v >> 16) & 0x1f00000000ffff;
        return uint32_t((v | v >> 32) & 0x1fffff);
    };
    return {gather(code), gather(code >> 1), gather(code >> 2)};
}

}  // namespace vcp
