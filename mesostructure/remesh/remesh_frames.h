// The frames of a remeshed surface's base triangles, in which the normals of pixels, and the starts of rays of light,
// are found (mesostructure/shared/remesh_normal.h).
#pragma once

#include <cstddef>
#include <vector>

#include <glm/vec4.hpp>

#include "mesostructure/remesh/remesh_surface.h"

namespace vcp::meso {

/// In double precision, for charts may be small.
using RemeshFrame = RemeshHeights<double>::RemeshFrame;

/// Returns the frame of a base triangle, world axes, with its place relative to the surface's origin. Precondition: the
/// surface is not cut.
RemeshFrame remeshFrame(const RemeshSurface& surface, size_t triangle);

/// Returns all of them as devices read them (shared/remesh_layout.h), with places relative to `origin`, world.
std::vector<glm::vec4> remeshFrames(const RemeshSurface& surface, glm::dvec3 origin);

}  // namespace vcp::meso
