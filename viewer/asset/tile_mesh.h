// Triangle meshes as tiles.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include <glm/vec2.hpp>

#include "mesostructure/shape.h"

namespace vcp {

struct TileMeshOptions {
    char up = 'z';  ///< the mesh's axis that points out of the base surface
    /// The length after which the mesh repeats along the tile's x and y, in the mesh's units; without it, the mesh
    /// stands alone in the middle of a square tile, nine tenths of it wide.
    std::optional<glm::dvec2> period;
};

struct TileMesh {
    std::vector<meso::TileTriangle> triangles;
    glm::dvec3 extent{0};
};

/// Reads a mesh whole and puts it into a tile, with a fiftieth of a tile free below and above. Errors: those of the
/// mesh readers; InvalidInput (no triangle, no size, edges as meso::edgesOf says, a border although it stands alone),
/// Limit (10^7 triangles, a slab above 16 tiles), with the file's name.
Result<TileMesh> readTileMesh(const std::filesystem::path& path, const TileMeshOptions& options);

}  // namespace vcp
