// Points on surfaces with mesostructure, for measuring: a ray of the world is marched by the processor, whatever drew
// the picture.
#pragma once

#include <optional>
#include <span>

#include <glm/vec3.hpp>

#include "render/frame_request.h"
#include "render/meso_surface.h"

namespace vcp {

struct SurfacePoint {
    glm::dvec3 position;          ///< world
    glm::vec3 normal;             ///< unit, towards the ray's origin
    double depth = 0;             ///< distance from the ray's origin, world units
    std::optional<double> error;  ///< bound of how far the asset's surface may be; world units; none: nothing is known
};

/// Returns the first point that a ray meets on what section planes keep of the surfaces; nothing where it meets none.
/// Remeshed surfaces are left out. `direction`: unit. `moved`: as FrameRequest::surfacesMoved.
std::optional<SurfacePoint> pickOnSurfaces(std::span<const MesoSurface> surfaces, glm::dvec3 origin,
                                           glm::dvec3 direction, std::span<const SectionPlane> sections = {},
                                           std::span<const glm::dvec3> moved = {});

}  // namespace vcp
