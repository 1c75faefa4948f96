// Height maps from pictures.
#pragma once

#include <filesystem>

#include "mesostructure/shape.h"

namespace vcp {

/// Reads a PNG of 1 to 16 bits a channel as heights without any gamma: grey, or the mean of red, green and blue; alpha is
/// left out; 8 bits become 16 by v * 257. The picture's upper row is the tile's highest y. `range`: height of white, tile
/// units. Errors: Io; InvalidInput (damaged, truncated), Limit (more than kMaxGridEdge texels), Unsupported (EXR and
/// other formats), all with the file's name.
Result<meso::HeightMap> readHeightImage(const std::filesystem::path& path, double range);

}  // namespace vcp
