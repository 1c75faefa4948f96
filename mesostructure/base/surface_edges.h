// The edges of a surface: whether it is closed, how many parts it has, where its map has seams.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "mesostructure/base_surface.h"

namespace vcp::meso {

struct SurfaceEdges {
    uint64_t triangles = 0;  ///< with three different corners; only these count
    uint64_t all = 0;        ///< edges
    uint64_t border = 0;     ///< edges with a triangle on one side only; 0: the surface is closed
    uint64_t seams = 0;      ///< edges with a triangle on both sides whose texture coordinates differ
    uint64_t parts = 0;      ///< connected by edges
    uint32_t firstBorderTriangle = 0;
    std::string firstBorder;  ///< "from (x, y, z) to (x, y, z)"; empty where there is no border
};

/// Looks at the edges of a surface whose corners are joined (joinPositions). The triangles may be hostile, with numbers
/// in range. Errors: InvalidInput, with triangle and place, where an edge has three triangles, or two that run along it
/// in one direction. Parts may touch at a corner.
Result<SurfaceEdges> edgesOf(const BaseSurface& surface);

/// Returns for each edge of triangle i, from corner k to the next, at 3 i + k, 3 j + l of the other triangle that has
/// it; kNoEdge where there is none. Each edge has two triangles at most, which run along it in different directions.
inline constexpr uint32_t kNoEdge = ~uint32_t{0};
std::vector<uint32_t> oppositeEdges(const std::vector<std::array<uint32_t, 3>>& triangles, size_t positions);

}  // namespace vcp::meso
