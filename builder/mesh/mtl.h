// Wavefront MTL: the materials of an OBJ file, as far as the colour of a surface goes, and what is beside it.
//
// Reads `newmtl`, `Kd`, and `map_Kd` and `map_d` with their options -o, -s and -clamp; other statements are skipped.
// Where there is an image, it is the colour: Kd is ignored then, as many exporters leave a grey one behind. `map_d` is
// a mask, by its alpha or, where it is opaque, its grey; without one, the alpha of `map_Kd` is. Materials with images
// may have channels: `norm` (normals, `-bm` their scale), `map_Pr` and `Pr` (roughness), `Pm` (metalness), `map_Ke` and
// `Ke` (emission), placed as `map_Kd` is. Images lie below the folder of the MTL file, unless those outside are
// allowed; others are left out with a warning, as are faulty statements.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "builder/stream/material.h"
#include "builder/stream/side_file.h"

namespace vcp {

struct MtlMaterial {
    Material material;
    glm::vec2 uvOffset{0};
    glm::vec2 uvScale{1};  ///< texture coordinates of the file are scaled, then moved
};

/// Appends the materials of a file. Limits: 16 MiB, 65536 materials. It never fails: what cannot be read becomes a
/// warning, one line that names the file. `sideFiles` gets the file and the images that it names.
void readMtl(const std::filesystem::path& path, bool allowOutside, std::vector<MtlMaterial>& materials,
             std::vector<std::string>& warnings, std::vector<SideFile>& sideFiles);

}  // namespace vcp
