// How a tile of an image is stored, without loss: red and blue as differences to green, each channel as differences to
// what its neighbours foretell (the median edge detector of LOCO-I, Weinberger, Seroussi and Sapiro 2000), then zstd.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "octree/io/result.h"

namespace vcp {

/// Returns the stored bytes of a tile; the same texels give the same bytes everywhere. `texels`: RGBA8, row by row,
/// size.x * size.y of them. Any thread.
std::vector<std::byte> packTile(std::span<const uint32_t> texels, glm::uvec2 size);

/// Decodes a tile into `texels`, size.x * size.y of them. `packed` may be hostile. Errors: InvalidInput (it does not
/// decode to so many texels).
Result<void> unpackTile(std::span<const std::byte> packed, glm::uvec2 size, std::span<uint32_t> texels);

}  // namespace vcp
