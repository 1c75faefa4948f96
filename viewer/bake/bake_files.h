// The files of a baked base: a folder that a scene of ours and other programs show.
//
//   scene.json         draws heights.meso over base.obj by "remesh", with colour.png where there are colours
//   base.obj           the base; its coordinates are those of height maps: texel (i, j) lies at (i, j) / size
//   heights.meso       heights along the shell's directions, in 65535 steps
//   base.glb           the base for other programs, with normals, tangents, and the pictures beside it. Its
//                      asset.extras say what displacement.png means.
//   displacement.png   16-bit grey, along unit normals: 0 is `offset`, 65535 is `offset` + `range`, world units
//   normal.png         tangent space, green upwards (glTF, OpenGL)
//   colour.png         sRGB; only where the scan has colours
//   mask.png           green: a height field; red: no hit; orange: several sheets; blue: steep; black: in no triangle
#pragma once

#include <algorithm>
#include <array>
#include <string_view>

#include "mesostructure/base_surface.h"
#include "octree/io/output_folder.h"
#include "octree/io/result.h"
#include "viewer/bake/bake_maps.h"

namespace vcp {

inline constexpr std::array<std::string_view, 8> kBakedFiles{
    "scene.json", "base.obj", "heights.meso", "base.glb", "displacement.png", "normal.png", "colour.png", "mask.png"};

inline bool isBakedName(std::string_view name) {
    return std::find(kBakedFiles.begin(), kBakedFiles.end(), name) != kBakedFiles.end();
}

/// Writes all files into `folder`, under their names. `name`: what the asset is called. Returns their bytes. Errors:
/// those of OutputFile.
Result<uint64_t> writeBaked(const std::filesystem::path& folder, const std::string& name, const meso::BaseSurface& base,
                            const meso::TexelMap& map, const BaseFrames& frames, const BakedMaps& maps);

}  // namespace vcp
