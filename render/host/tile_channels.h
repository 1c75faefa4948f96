// The hits of a tile whose materials have channels: what these say there, and the light on them. Other hits are lit by
// tile_shading.h alone.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

#include "render/host/host_scene.h"
#include "render/host/picture_rays.h"
#include "render/host/tile_colours.h"
#include "render/host/tile_hits.h"
#include "render/host/tile_shading.h"
#include "render/shared/frame.h"

namespace vcp {

/// What the channels of a material say at a hit, whose albedo and light are those of TileSurface.
struct HitChannels {
    glm::vec3 normal;      ///< unit, towards the viewer
    glm::vec3 towardsEye;  ///< unit
    glm::vec3 emission;    ///< light
    float roughness = 0, metalness = 0;
};

/// One of them, and the element of the tile's arrays that it is of.
struct PixelChannels {
    int pixel = 0;
    HitChannels channels;
};

/// Finds what channels say at the hits of a tile that have some; others, and those on caps, are left out. `surface`:
/// with its normals. Any thread.
std::vector<PixelChannels> findChannels(const HostScene& scene, const PictureRays& rays, const PixelEdges& edges,
                                        const TileHits& hits, const TileSurface& surface);

/// Gives hits with channels their colours, RGBA8, with all that `surface` says of them but the normal. Precondition:
/// frame.shadingMode is kShadeLit.
void shadeChannels(const frame::FrameConstants& frame, const TileSurface& surface,
                   const std::vector<PixelChannels>& channels, uint32_t (&colours)[kTilePixels]);

}  // namespace vcp
