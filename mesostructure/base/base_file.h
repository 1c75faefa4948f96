// Writes a surface as an OBJ file, which viewer/scene/base_mesh.h and other programs read.
#pragma once

#include <filesystem>

#include "mesostructure/base_surface.h"
#include "octree/io/output_file.h"

namespace vcp::meso {

/// Writes positions to the last bit, normals averaged over the triangles at a corner by their areas, texture
/// coordinates where the surface has them, and faces. Errors: those of OutputFile.
Result<void> writeBase(const std::filesystem::path& output, const BaseSurface& surface, const OutputRules& rules);

}  // namespace vcp::meso
