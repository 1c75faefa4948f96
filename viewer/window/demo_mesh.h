// The demo of the welcome page: a knot with coloured scales, made here, so that there is something to look at without a
// file.
#pragma once

#include <filesystem>

#include "octree/io/result.h"

namespace vcp {

constexpr uint32_t kDemoAlong = 1536, kDemoAround = 144;
/// Triangles of the demo: closed, with a colour at each vertex.
constexpr uint64_t kDemoTriangles = uint64_t{2} * kDemoAlong * kDemoAround;

/// Writes the mesh as a binary PLY file, the same bytes each time. Errors: Io.
Result<void> writeDemoMesh(const std::filesystem::path& path);

/// Returns the mesh in defaultCacheFolder(), written there where it is not. Errors: Io.
Result<std::filesystem::path> demoMesh();

}  // namespace vcp
