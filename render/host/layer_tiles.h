// One layer of a picture, tile by tile: what the camera's rays hit, in which colours, and where rays of light begin
// there. Any thread, but for the constructor.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/gtc/quaternion.hpp>

#include "render/host/host_picture.h"
#include "render/host/light_rays.h"
#include "render/host/section_cut.h"
#include "render/host/tile_channels.h"
#include "render/host/tile_hits.h"
#include "render/host/tile_shading.h"
#include "render/host/wireframe.h"

namespace vcp {

/// Calls visit(pixel of the picture, element of the tile's arrays) for each pixel of a tile in a picture of `size`.
template <class Visit>
void forEachPixel(glm::ivec2 size, glm::ivec2 corner, const Visit& visit) {
    const glm::ivec2 part = glm::min(size - corner, glm::ivec2(kTileWidth, kTileHeight));
    for (int y = 0; y < part.y; ++y)
        for (int x = 0; x < part.x; ++x) visit(corner + glm::ivec2(x, y), y * kTileWidth + x);
}

/// Returns a part of 0 to 1 as 0 to 255.
inline uint8_t unormByte(float part) { return uint8_t(std::lround(255 * part)); }

void setAlbedo(TileSurface& surface, int i, glm::vec4 colour);

/// Returns how much sky is seen at a pixel, averaged over the pixels around whose depths differ by at most `reach`:
/// each pixel of a square of 4 x 4 has its own directions. `sky`: of each pixel, 0 to 255.
float skyAround(std::span<const float> depth, std::span<const uint8_t> sky, glm::ivec2 size, glm::ivec2 pixel,
                float reach);

/// Pixels from `first` on, and none from `end` on.
struct PixelBox {
    glm::ivec2 first{0}, end{0};

    /// Whether a tile has some of them. `corner`: its upper left pixel.
    [[nodiscard]] bool meets(glm::ivec2 corner) const {
        return corner.x < end.x && corner.y < end.y && corner.x + kTileWidth > first.x &&
               corner.y + kTileHeight > first.y;
    }
};

/// Returns the pixels of a picture of `size` in which the pages of a scene may be seen: no other ray meets their boxes.
PixelBox pixelsOf(const HostScene& scene, const PictureRays& rays, glm::ivec2 size);

class LayerTiles {
public:
    /// `size`: of the picture.
    LayerTiles(const HostLayer& layer, glm::ivec2 size);

    /// Casts the tile whose upper left pixel is hits.corner, with caps, and marks pages.
    void cast(TileHits& hits) const;
    /// Finds the colours of a tile's hits without light.
    void findAlbedo(const TileHits& hits, TileSurface& surface) const;
    /// Finds the same of those that are not on caps, RGBA8; the other elements stay what they are.
    void findOwnColours(const TileHits& hits, uint32_t (&colours)[kTilePixels]) const;
    /// Finds what channels of materials say at a tile's hits; nothing where none are shown.
    [[nodiscard]] std::vector<PixelChannels> findChannels(const TileHits& hits, const TileSurface& surface) const;
    void setClay(TileSurface& surface) const;
    /// Returns the line of the wireframe at a hit.
    [[nodiscard]] HitLine lineOf(const TileHits& hits, glm::ivec2 pixel, int i) const;

    /// Whether hits are shown in their own colours.
    [[nodiscard]] bool isColoured() const { return isColoured_; }
    /// Whether some hits may have channels of materials.
    [[nodiscard]] bool hasChannels() const { return hasChannels_; }
    /// The rotation from the dataset's axes to the world's.
    [[nodiscard]] const glm::quat& turn() const { return turn_; }
    [[nodiscard]] HostHit hitOf(const TileHits& hits, int i) const;
    [[nodiscard]] PageMarks* lightMarks() const { return layer_.marks != nullptr ? &layer_.marks->byLight : nullptr; }

    [[nodiscard]] float depthInCells(float depth) const { return float(double(depth) / layer_.scene.grid().cell); }
    /// A pixel's edge at a depth; both in finest cells.
    [[nodiscard]] float pixelEdgeAt(float depth) const {
        return layer_.frame.pixelEdge + layer_.frame.pixelEdgePerDepth * depth;
    }
    /// By how much rays of light begin above a hit at a depth, both in finest cells: more than the picture's own error
    /// and the roundings.
    [[nodiscard]] float liftAt(float depth) const { return 0.15f + layer_.frame.lightLift * pixelEdgeAt(depth); }

    /// Returns a point above a hit, in finest cells from the root's lowest corner. `depth` and `lift`: finest cells;
    /// `normal`: in the dataset's axes.
    [[nodiscard]] glm::dvec3 above(glm::ivec2 pixel, double depth, float lift, glm::vec3 normal) const;
    /// Returns a ray of light, no farther than section planes leave it. All in finest cells.
    [[nodiscard]] LightRay lightRay(glm::dvec3 origin, glm::vec3 direction, float reach) const;

private:
    /// A pixel's ray, in finest cells from the root's lowest corner.
    struct CellRay {
        glm::dvec3 origin, direction;
    };
    [[nodiscard]] CellRay rayOf(glm::ivec2 pixel) const;
    [[nodiscard]] PageMarks* cameraMarks() const { return layer_.marks != nullptr ? &layer_.marks->byCamera : nullptr; }
    /// Marks the page that a pixel's ray begins in: it may miss it and hit what is below.
    void markBegin(glm::ivec2 pixel) const;
    void markPages(const TileHits& hits) const;
    void fade(TileHits& hits) const;
    /// A pixel's edge at a depth in world units.
    [[nodiscard]] PixelEdges pixelEdges() const;

    const HostLayer& layer_;
    const glm::ivec2 size_;
    const bool isColoured_, hasChannels_;
    const glm::quat turn_;
    const std::vector<SectionCut> sections_;  // finest cells from the root's lowest corner
    const bool beginInEye_;                   // all rays begin at one point
    const PixelBox pixels_;                   // where something of it may be seen
};

}  // namespace vcp
