// What is seen of a hit: its normal and colour.
#pragma once

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "render/host/host_scene.h"
#include "render/host/tile_hits.h"

namespace vcp {

/// `normal`: of any length, on the side that the ray comes from; near a silhouette it may lean away a little.
/// `colour`: from 0 to 1; zero where the dataset has none.
struct HitSurface {
    glm::vec3 normal;
    glm::vec4 colour;
};

/// Returns the colour alone of such a hit, without regard to images (hit_colours.h).
glm::vec4 colourAt(const HostScene& scene, const TileHits& hits, int pixel);

/// `pixel`: element of the arrays of `hits` at which there is a hit; `direction`: of its ray, of any length.
HitSurface surfaceAt(const HostScene& scene, const TileHits& hits, int pixel, glm::vec3 direction);

}  // namespace vcp
