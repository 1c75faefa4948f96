// Rays of light: from hits to the sun and into the sky. Those of a tile begin near each other, and go through the scene
// together: parallel ones as a picture's do (sun_tile-inl.h), others in streams (ray_stream-inl.h).
#pragma once

#include <span>

#include <glm/vec3.hpp>

#include "render/host/host_scene.h"
#include "render/host/page_marks.h"

namespace vcp {

struct LightRay {
    glm::dvec3 origin;    ///< finest cells, from the root's lowest corner
    glm::vec3 direction;  ///< unit
    float reach;          ///< finest cells; what is farther does not matter
};

/// Finds how far each ray comes, in finest cells: below its reach where something is in its way, else infinite.
/// Parallel rays that pass within a ten-thousandth of a cell of an edge may find otherwise together than alone; all
/// others find the same to the last bit. Fastest where rays begin side by side, a tile's at once, in the order of its
/// pixels. `distances`: one a ray. `marks`, where given, gets the pages that they hit or begin in. Any thread.
void castLightRays(const HostScene& scene, std::span<const LightRay> rays, float* distances,
                   PageMarks* marks = nullptr);

}  // namespace vcp
