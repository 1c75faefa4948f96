// Draws pictures larger than the device draws at once: tile after tile, each with the pages that it wants, handed on in
// bands of rows.
//
// A tile shows what the same part of the whole shows, to the rounding of rays; where the budget is too small for the
// whole, tiles have more of it each. Occlusion is averaged over neighbouring pixels, so tiles overlap by some.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include <glm/vec3.hpp>

#include "octree/io/result.h"
#include "render/picture_renderer.h"

namespace vcp {

struct TiledPictureOptions {
    uint32_t tile = 2048;  ///< edge in pixels, at least 16
    uint32_t samples = 1;  ///< of a pixel; samplesOf (render/pixel_samples.h) says where there are fewer
    bool depth = false, normals = false;
    /// Called with the error of a page that cannot be read and is drawn from its parent; empty: that ends the picture.
    std::function<void(const Error& problem)> problem;
    /// Asked while a tile is drawn (PictureRenderer::render and refine); true ends the picture with Cancelled.
    std::function<bool()> cancel;
};

/// Rows of the picture, over its whole width, from the upper one on.
struct PictureBand {
    Picture picture;
    std::vector<float> depth;        ///< where asked for
    std::vector<glm::vec3> normals;  ///< where asked for
};

struct TiledPictureStats {
    uint64_t tiles = 0, rays = 0, hitPixels = 0;
    double ms = 0;  ///< time of drawing alone, of each tile's last frame and its samples, as are the rays
    double errorPixels = 0, colourPixels = 0;  ///< largest over the tiles
    double remeshedPixels = 0;                 ///< likewise, as in FrameStats, and the next
    uint64_t uncertifiedPatches = 0;
    uint32_t missingHeights = 0;
    UpdateResult update;  ///< the last tile's
    bool onHost = false;  ///< likewise, as in FrameStats
};

/// A picture in the making, tile by tile. What it is given must stay until it is done.
class TiledPicture {
public:
    using Take = std::function<Result<void>(PictureBand&)>;

    /// `request`: its width and height may be up to 2^20 here. `take` gets each band, and may change it.
    TiledPicture(PictureRenderer& renderer, const FrameRequest& request, const TiledPictureOptions& options, Take take)
        : renderer_(&renderer), whole_(request), options_(options), take_(std::move(take)) {}

    /// Takes in pages and draws the next tile, or adds a sample to it, where all that it is known to want is there;
    /// never waits for reads. Returns true when the last band was taken. Errors: those of PictureRenderer; those of
    /// `take`; the first page that cannot be read.
    Result<bool> step();
    /// Whether pages were missing in the last step().
    [[nodiscard]] bool isWaiting() const { return isWaiting_; }
    [[nodiscard]] double fraction() const;
    [[nodiscard]] const TiledPictureStats& stats() const { return stats_; }

private:
    struct Rect {
        uint32_t x, y, width, height;
    };
    [[nodiscard]] Rect inner() const;
    [[nodiscard]] Rect outer() const;
    /// Takes a tile's frame as its first sample.
    void begin(const FrameStats& tile);
    Result<void> addSample();
    [[nodiscard]] FrameRequest tileRequest() const;
    Result<void> copyTile(const Rect& outer, const Rect& inner);

    PictureRenderer* renderer_;
    FrameRequest whole_;
    TiledPictureOptions options_;
    Take take_;
    uint32_t x_ = 0, y_ = 0;  // place of the next tile
    PictureBand band_;
    bool isWaiting_ = false;
    std::optional<FrameStats> drawn_;  // of the tile, as it was drawn last
    uint32_t samples_ = 0;             // that the tile has
    uint64_t tileHits_ = 0;            // of the tile
    TiledPictureStats stats_;
};

}  // namespace vcp
