// What is seen of a hit: its normal and colour.
#pragma once

#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "render/host/host_scene.h"
#include "render/host/tile_hits.h"

namespace vcp {

/// Returns a colour in 8 bits a channel, RGBA8, as a device's passes keep it.
inline uint32_t packedColour(glm::vec4 colour) {
    // Not glm's: where rounding is no instruction, that calls a function for each channel.
    const glm::vec4 steps = glm::min(glm::max(glm::vec4(0), colour), 1.0f) * 255.0f + 0.5f;
    return uint32_t(steps.x) | uint32_t(steps.y) << 8 | uint32_t(steps.z) << 16 | uint32_t(steps.w) << 24;
}

/// `normal`: of any length, on the side that the ray comes from; near a silhouette it may lean away a little.
/// `colour`: from 0 to 1; zero where the dataset has none.
struct HitSurface {
    glm::vec3 normal;
    glm::vec4 colour;
};

/// Returns the colour alone of such a hit, without regard to images (tile_colours.h).
glm::vec4 colourAt(const HostScene& scene, const TileHits& hits, int pixel);

/// `pixel`: element of the arrays of `hits` at which there is a hit; `direction`: of its ray, of any length.
HitSurface surfaceAt(const HostScene& scene, const TileHits& hits, int pixel, glm::vec3 direction);

}  // namespace vcp
