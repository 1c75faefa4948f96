// Textures of mesostructure: pictures over the tile with their coarser levels, as shared/meso_texture_lookup.h reads
// them.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

namespace vcp {

/// Texel (i, j) lies at (i, j) / size of the tile, as a height map's, and repeats with it. A level has half the texels
/// of the one before along each axis, rounded down, 1 at least.
struct MesoTexture {
    glm::uvec2 size{0};  ///< size of the finest level
    uint32_t levels = 0;
    std::vector<uint64_t> texels;  ///< four halfs each, red lowest; level after level, rows from the lowest y
};

/// Makes the coarser levels by averaging, so colours must be linear, not encoded; normals may have any length.
/// Precondition: size.x * size.y texels, at least one.
MesoTexture makeMesoTexture(glm::uvec2 size, std::vector<glm::vec4> texels);

}  // namespace vcp
