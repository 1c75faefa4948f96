// Reads pictures of light, which have no brightest value: Radiance's (.hdr) and EXR.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "octree/io/result.h"

namespace vcp {

struct RadiancePicture {
    glm::uvec2 size{0};
    std::vector<glm::vec3> texels;  ///< row by row from the top: linear red, green and blue, finite and at least 0
};

/// Decodes a Radiance picture or the red, green and blue (or Y) of an EXR. What is below 0 becomes 0. The bytes may be
/// hostile: at most 8192 texels along an edge, and no more than the file is long enough to hold. Errors, without file:
/// InvalidInput (damaged, truncated, NaN or infinity, another format), Limit (more texels), Unsupported (kinds of EXR).
Result<RadiancePicture> decodeRadiance(std::span<const std::byte> file);

/// Does so with a file of at most 512 MiB. Errors: Io, and those, all with the file's name.
Result<RadiancePicture> readRadiancePicture(const std::filesystem::path& path);

}  // namespace vcp
