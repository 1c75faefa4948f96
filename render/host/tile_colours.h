// The colours of a tile's hits without light, from images where their triangles have some, several pixels at a time.
#pragma once

#include <cstdint>

#include "render/host/host_scene.h"
#include "render/host/picture_rays.h"
#include "render/host/tile_hits.h"

namespace vcp {

/// A pixel's edge at a depth, in finest cells; depths are in world units.
struct PixelEdges {
    float edge = 0, perDepth = 0;
};

/// Finds the colours of the hits that are not on caps, RGBA8; the other elements stay what they are. Any thread.
void findColours(const HostScene& scene, const PictureRays& rays, const PixelEdges& edges, const TileHits& hits,
                 uint32_t (&colours)[kTilePixels]);

}  // namespace vcp
