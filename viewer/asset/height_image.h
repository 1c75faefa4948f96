// Height maps from pictures.
#pragma once

#include <filesystem>

#include "mesostructure/shape.h"
#include "viewer/asset/exr_picture.h"

namespace vcp {

/// Decodes a PNG of 1 to 16 bits a channel as heights without any gamma: grey, or the mean of red, green and blue;
/// alpha is left out; 8 bits become 16 by v * 257, and white is `range` high, tile units. Or an EXR
/// (viewer/asset/exr_picture.h): heightsOf its values. The picture's upper row is the tile's highest y. The bytes may
/// be hostile. Errors, without file: InvalidInput (damaged, truncated, another format), Limit (more than kMaxMapEdge
/// texels), Unsupported (kinds of EXR), Io (many heights, which are in a file of the store).
Result<meso::HeightMap> decodeHeights(std::span<const std::byte> file, double range,
                                      const meso::HeightStore& store = {});

/// Does decodeHeights() of a file of at most 512 MiB. Errors: Io, and those, all with the file's name.
Result<meso::HeightMap> readHeightImage(const std::filesystem::path& path, double range,
                                        const meso::HeightStore& store = {});

/// Makes heights of values of any size: the least lies on the slab's bottom, the greatest `range` above it, in steps of
/// 1/65535; where all are the same, all lie on the bottom. Errors: Io.
Result<meso::HeightMap> heightsOf(const FloatPicture& picture, double range, const meso::HeightStore& store = {});

}  // namespace vcp
