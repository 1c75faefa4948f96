// Textured meshes for the benchmark of colours, where no model is named.
#pragma once

#include <filesystem>
#include <vector>

#include "octree/io/result.h"

namespace vcp {

/// Writes `wall`, two triangles, and `relief`, 2 x 96 x 96 of waves, both 2 world units across, with one picture of 512
/// x 512 texels that has slopes, edges and stripes of all widths. Returns the files. Errors: Io.
Result<std::vector<std::filesystem::path>> writeColourModels(const std::filesystem::path& folder);

}  // namespace vcp
