// The colours of a tile's hits, several pixels at a time.
#pragma once

#include <glm/vec3.hpp>

#include "render/host/picture_rays.h"
#include "render/host/tile_hits.h"
#include "render/shared/frame.h"

namespace vcp {

/// What is to be shaded at a tile's hits; elements as those of TileHits.
struct TileSurface {
    alignas(32) float normalX[kTilePixels], normalY[kTilePixels], normalZ[kTilePixels];  ///< unit, towards the viewer
    alignas(32) float red[kTilePixels], green[kTilePixels], blue[kTilePixels];  ///< encoded for the screen, 0 to 1
    /// How much of them is seen, 0 to 1. Of several lights the sun's are bits, over 255 (hit_light.h).
    alignas(32) float sun[kTilePixels], sky[kTilePixels];

    [[nodiscard]] glm::vec3 normal(int pixel) const { return {normalX[pixel], normalY[pixel], normalZ[pixel]}; }
};

/// Finds the normals of a tile's hits. A normal that leans away from its ray, near a silhouette, is bent back to it.
void findNormals(const PictureRays& rays, const TileHits& hits, TileSurface& surface);

/// Finds the colours of a surface, RGBA8, in the modes that are no false colours. `colours`: 32-byte aligned.
void shadeTile(const frame::FrameConstants& frame, const TileSurface& surface, uint32_t (&colours)[kTilePixels]);

}  // namespace vcp
