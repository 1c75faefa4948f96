// Makes the triangles of a triangulation as little thin as its points allow.
#pragma once

#include <array>

#include <glm/vec2.hpp>

#include "builder/mask/mask_cutter.h"

namespace vcp {

/// Turns edges between two triangles until each is as it is in a Delaunay triangulation in texels (Lawson 1977); the
/// outline stays. `texels`: of the corners that the weights belong to, finite. `parts`: no point lies on another's
/// edge.
void makeDelaunay(const std::array<glm::dvec2, 3>& texels, MaskParts& parts);

}  // namespace vcp
