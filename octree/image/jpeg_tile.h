// Tiles that are JPEGs of their own (baseline, their tables in them): blocks of a source's JPEG as they were, or coded
// anew; always opaque.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "octree/io/result.h"

namespace vcp {

/// Whether a stored tile is a JPEG, and not one of packTile().
inline bool isJpeg(std::span<const std::byte> packed) {
    return packed.size() >= 2 && packed[0] == std::byte{0xff} && packed[1] == std::byte{0xd8};
}

/// Codes a tile, whose alpha is left out, in blocks of light and unhalved colour. `quality`: 1 to 100. The same texels
/// give the same bytes wherever libjpeg is the same. Errors: Limit (no memory). Any thread.
Result<std::vector<std::byte>> packJpeg(std::span<const uint32_t> texels, glm::uvec2 size, int quality);

/// Decodes a tile into `texels`, size.x * size.y of them. `packed` may be hostile. Errors: InvalidInput (it is no JPEG
/// of such a tile: another size or kind, progressive, damaged). Any thread.
Result<void> unpackJpeg(std::span<const std::byte> packed, glm::uvec2 size, std::span<uint32_t> texels);

}  // namespace vcp
