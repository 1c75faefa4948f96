// Pictures larger than the device draws at once: tile after tile, each with the pages that it wants, handed on in
// bands of rows.
//
// A tile shows what the same part of the whole shows, to the rounding of rays; where the budget is too small for the
// whole, tiles have more of it each. Occlusion is averaged over neighbouring pixels, so tiles overlap by some.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include <glm/vec3.hpp>

#include "octree/result.h"
#include "render/renderer.h"

namespace vcp {

struct TiledPictureOptions {
    uint32_t tile = 2048;  ///< edge in pixels, at least 16
    bool depth = false, normals = false;
    /// Told the fraction done after each tile and while pages load; false cancels. May be empty.
    std::function<bool(double fraction)> progress;
};

/// Rows of the picture, over its whole width, from the upper one on.
struct PictureBand {
    Picture picture;
    std::vector<float> depth;          ///< where asked for
    std::vector<glm::vec3> normals;    ///< where asked for
};

struct TiledPictureStats {
    uint64_t tiles = 0, rays = 0, hitPixels = 0;
    double ms = 0;  ///< of drawing alone
    double errorPixels = 0;      ///< largest of the tiles'
    bool settled = true;         ///< all of them
    UpdateResult update;         ///< of the last tile
};

/// Draws `request`, whose width and height may be up to 2^20 here, and hands each band to `take`. Errors: those of
/// Renderer; those of `take`; the first page that cannot be read; Cancelled.
Result<TiledPictureStats> drawTiled(Renderer& renderer, const FrameRequest& request, const TiledPictureOptions& options,
                                    const std::function<Result<void>(const PictureBand&)>& take);

}  // namespace vcp
