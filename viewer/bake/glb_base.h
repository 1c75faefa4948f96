// A baked base as a GLB (glTF 2.0): positions, normals, tangents, coordinates, and a material that names the pictures.
#pragma once

#include <string>

#include "viewer/bake/bake_maps.h"

namespace vcp {

/// Returns the file's bytes. Positions are single precision, from the node's translation. Errors: Limit (2^32 bytes).
Result<std::string> glbOf(const std::string& name, const meso::BaseSurface& base, const BaseFrames& frames,
                          const BakedMaps& maps);

}  // namespace vcp
