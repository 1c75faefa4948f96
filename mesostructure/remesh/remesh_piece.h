// What the steps of remeshing hand on: corners in eye space and in the grid, and pieces of base triangles. For this
// room alone.
#pragma once

#include <array>

#include "mesostructure/remesh/remesh_math.h"

namespace vcp::meso {

template <class Real>
using RemeshCorner = typename RemeshMath<Real>::RemeshCorner;

template <class Real>
struct RemeshPiece {
    std::array<RemeshCorner<Real>, 3> corners{};
    std::array<typename RemeshMath<Real>::RemeshSeam, 3> seams{};  ///< of the edges from corner k to the next
    int halvings = 0;
    uint32_t triangle = 0;  ///< of the base
    glm::ivec3 parts{0};    ///< of the edges from corner k to the next, at most their cells; 0: their cells
    glm::ivec4 levels{0};   ///< of the heights, where access is to the map: along these edges, and within
};

}  // namespace vcp::meso
