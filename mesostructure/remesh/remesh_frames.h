// The frames of a remeshed surface's base triangles, in which the normals of pixels are found
// (mesostructure/shared/remesh_normal.h).
#pragma once

#include <cstddef>
#include <vector>

#include <glm/vec4.hpp>

#include "mesostructure/remesh/remesh_surface.h"

namespace vcp::meso {

/// Returns the frame of a base triangle, world axes. Precondition: the surface
/// is not cut.
template <class Real>
typename RemeshHeights<Real>::RemeshFrame remeshFrame(const RemeshSurface& surface, size_t triangle);

extern template RemeshHeights<float>::RemeshFrame remeshFrame<float>(const RemeshSurface&, size_t);
extern template RemeshHeights<double>::RemeshFrame remeshFrame<double>(const RemeshSurface&, size_t);

/// Returns all of them as devices read them (shared/remesh_layout.h).
std::vector<glm::vec4> remeshFrames(const RemeshSurface& surface);

}  // namespace vcp::meso
