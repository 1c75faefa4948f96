// Triangles whose corners fall on one line of the lattice, or on one point.
//
// Where they belong to a closed surface, the triangles around them meet along that line and nothing is missing.
// A sliver on its own, or at a border, would vanish: it keeps a triangle of one lattice step along each part of
// its line that no other triangle has as an edge.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include <glm/vec3.hpp>

#include "builder/lattice/soup.h"

namespace vcp {

using Corners = std::array<glm::i32vec3, 3>;

/// Replaces the triangles without area in a bin's soup. The soup must hold all triangles at the corners that the bin
/// `owns`; what is kept along a line is kept in the bins that own one of its ends, the same in each. `samePage(p, q)`:
/// whether two lattice points lie in one page. `stepAt(p)`: vertices around a point lie on multiples of it. The result
/// does not depend on the soup's order. Returns the triangles that were replaced, each once, but for those with a
/// corner twice, and those that took their place: what a closed surface's edges are counted with, and without.
std::vector<Corners> keepCollapsed(std::vector<LatticeTriangle>& soup, const std::function<bool(glm::i32vec3)>& owns,
                                   const std::function<bool(glm::i32vec3, glm::i32vec3)>& samePage,
                                   const std::function<int(glm::i32vec3)>& stepAt);

}  // namespace vcp
