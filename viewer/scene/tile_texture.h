// Reads textures over a mesostructure's tile from pictures.
#pragma once

#include <filesystem>

#include "octree/io/result.h"
#include "render/meso_texture.h"

namespace vcp {

/// Reads PNG or JPEG; the picture's upper row is the tile's highest y. Colours are sRGB and become light; alpha is left
/// out. The file may be hostile. Errors: those of loadImage, with the file's name; Limit (more than 4096 texels along
/// an edge).
Result<MesoTexture> readColourTexture(const std::filesystem::path& path);

/// Does so with normals in the OpenGL convention: red, green and blue from 0 to 255 are x (to the right), y (up in the
/// picture) and z (out of it) from -1 to 1; no gamma. Vectors are made unit; one that does not point out of the picture
/// becomes (0, 0, 1).
Result<MesoTexture> readNormalTexture(const std::filesystem::path& path);

}  // namespace vcp
