// Writes depth, normals and other numbers as files, each whole or absent (octree/io/output_file.h).
//
//   .pfm   32-bit float, lower row first, little endian (scale -1), as the format wants it. Depth: one
//          channel, world units along the ray, infinity where nothing was hit. Normals: three channels, world
//          axes, 0 where nothing was hit.
//   .png   Depth: 16-bit grey, 0 where nothing was hit, else linear from 1 (nearest hit) to 65535 (farthest).
//          Normals: 8-bit RGB, 128 + 127 n rounded, world axes; black where nothing was hit.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include <glm/vec3.hpp>

#include "octree/io/output_file.h"
#include "octree/io/result.h"

namespace vcp {

/// Nearest and farthest finite depth; both 0 when nothing was hit.
struct DepthRange {
    float nearest = 0, farthest = 0;
};
DepthRange depthRange(std::span<const float> depth);

/// Writes depth: width * height values, upper row first. Errors: Unsupported (neither .pfm nor .png), Io.
Result<void> writeDepth(std::span<const float> depth, uint32_t width, uint32_t height,
                        const std::filesystem::path& path, const OutputRules& rules = {});

/// Does the same for unit normals.
Result<void> writeNormals(std::span<const glm::vec3> normals, uint32_t width, uint32_t height,
                          const std::filesystem::path& path, const OutputRules& rules = {});

/// Writes numbers as 16-bit grey, upper row first: width * height values. Errors: Limit (no memory), Io.
Result<void> writeGrey16(std::span<const uint16_t> values, uint32_t width, uint32_t height,
                         const std::filesystem::path& path, const OutputRules& rules = {});

/// Returns true when writeDepth and writeNormals know the extension.
bool isImagePlanePath(const std::filesystem::path& path);

}  // namespace vcp
