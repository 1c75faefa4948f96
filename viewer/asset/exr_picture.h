// Reads EXR pictures: of one value a texel, in which height maps of floats are stored, and of colours.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "octree/io/result.h"

namespace vcp {

struct FloatPicture {
    glm::ivec2 size{0};
    std::vector<float> values;  ///< row by row from the top, finite
};

struct FloatColours {
    glm::ivec2 size{0};
    std::array<std::vector<float>, 3> planes;  ///< red, green and blue, each row by row from the top, finite
};

/// Whether this program was built with OpenEXR.
bool readsExr();

/// Whether the bytes begin as an EXR does.
bool isExr(std::span<const std::byte> file);

/// Decodes the data window of an EXR of one part, scan lines or tiles (of which the finest level), any compression:
/// channel Y, else the mean of those of R, G and B that there are, else the only channel, of any type. The bytes may be
/// hostile: sizes, tiles and channels are checked against each other and against the file before anything is allocated,
/// so that decoding takes 64 MiB, or a few times the picture, which the file must be long enough to hold. Errors,
/// without file: InvalidInput (damaged, truncated, NaN or infinity), Limit (above `mostEdge` texels along an edge;
/// tiles or channels out of proportion), Unsupported (deep, several parts, other channels, or a program built without
/// OpenEXR).
Result<FloatPicture> decodeExr(std::span<const std::byte> file, int mostEdge);

/// Does so with the channels R, G and B, or where one lacks, with Y for all of them. Errors: also Limit above
/// `mostTexels`.
Result<FloatColours> decodeExrColours(std::span<const std::byte> file, int mostEdge, uint64_t mostTexels);

}  // namespace vcp
