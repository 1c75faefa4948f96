// The frames of a remeshed surface's base triangles, in which the normals of pixels are found
// (mesostructure/shared/remesh_normal.h).
#pragma once

#include <cstddef>
#include <vector>

#include <glm/vec4.hpp>

#include "mesostructure/remesh/remesh_surface.h"

namespace vcp::meso {

/// In double precision, for charts may be small.
using RemeshFrame = RemeshHeights<double>::RemeshFrame;

/// Returns the frame of a base triangle, world axes. Precondition: the surface is not cut.
RemeshFrame remeshFrame(const RemeshSurface& surface, size_t triangle);

/// Returns all of them as devices read them (shared/remesh_layout.h).
std::vector<glm::vec4> remeshFrames(const RemeshSurface& surface);

}  // namespace vcp::meso
