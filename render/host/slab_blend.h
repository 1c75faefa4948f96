// Slab leaves that are wide in the picture are seen through a blend with the slabs about them
// (octree/shared/slab_blend.h), once a pixel.
#pragma once

#include "render/host/host_scene.h"
#include "render/host/tile_hits.h"

namespace vcp {

/// A pixel's edge at a depth along its ray, both in finest cells: edge + perDepth * depth.
struct PixelEdge {
    float edge, perDepth;
};

/// Blends the normals of a tile's hits on slab leaves that are wider than a pixel, and their colours where pages have
/// them (TileHits::blended).
void blendSlabs(const HostScene& scene, PixelEdge pixel, TileHits& hits);

}  // namespace vcp
