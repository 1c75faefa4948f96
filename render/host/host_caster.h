// Casts the rays of a picture on the processor, tile by tile.
//
// A tile of 16 x 8 rays goes through the scene once, front to back by the side of each node that its origin is on.
// Eight children are compared with the tile's four sides at once. A leaf is decoded once a tile and met by the groups
// of rays that its box covers and that have no hit yet. Boxes do not overlap and come front to back, so the first hit
// of a ray is its hit. A cut's levels meet without a seam (render/shaders/cast.glsl has one).
#pragma once

#include <functional>
#include <string>

#include "render/host/host_scene.h"
#include "render/host/picture_rays.h"
#include "render/host/tile_hits.h"

namespace vcp {

struct HostCastOptions {
    unsigned threads = 0;               ///< 0: one a processor
    std::function<bool()> cancel = {};  ///< is asked between tiles, by several threads; true ends it with Cancelled
};

/// Calls `take` with the hits of each tile of the picture, from several threads at once and in any order; the hits are
/// valid during the call. Errors: Cancelled.
Result<void> castPicture(const HostScene& scene, const PictureRays& rays, const HostCastOptions& options,
                         const std::function<void(const TileHits&)>& take);

/// Calls `draw` with the upper left pixel of each tile of a picture, likewise. Errors: Cancelled.
Result<void> forEachTile(glm::ivec2 size, const HostCastOptions& options,
                         const std::function<void(glm::ivec2 corner)>& draw);

/// Casts the tile whose upper left pixel is hits.corner. Any thread.
void castTile(const HostScene& scene, const PictureRays& rays, TileHits& hits);

/// The name of the instruction set that castTile runs on.
std::string hostInstructionSet();

}  // namespace vcp
