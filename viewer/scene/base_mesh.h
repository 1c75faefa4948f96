// Reads base surfaces for mesostructure from mesh files.
#pragma once

#include <filesystem>

#include "builder/stream/byte_source.h"
#include "mesostructure/base_surface.h"

namespace vcp {

/// Reads a mesh with texture coordinates: OBJ (with or without materials), and the other formats where they have
/// coordinates and a material. `tiles`: tile edges that one unit of the coordinates takes. The file may be hostile.
/// Corners at one place share their number; the edges may be of any kind (meso::edgesOf says). Errors: those of
/// openMesh; InvalidInput (a face without texture coordinates); Limit (above 5 million triangles).
Result<meso::BaseSurface> readBaseMesh(const std::filesystem::path& path, double tiles);

/// Does the same with an OBJ that is open, from its start.
Result<meso::BaseSurface> readBaseObj(ByteSource source, double tiles);

}  // namespace vcp
