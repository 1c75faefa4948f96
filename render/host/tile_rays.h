// The rays of a tile of a picture, in the grid of the scene: in finest cells, about the tile's middle.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "render/host/host_scene.h"
#include "render/host/picture_rays.h"
#include "render/host/tile_hits.h"
#include "render/shared/frame.h"

namespace vcp {

/// Where pixel 0 of a tile is, from its middle.
inline constexpr float kFirstColumn = 0.5f - 0.5f * kTileWidth, kFirstRow = 0.5f - 0.5f * kTileHeight;

/// The ray of the tile's pixel i columns and j rows from its middle begins at origin + i originPerX + j originPerY and
/// runs along direction + i directionPerX + j directionPerY. The middle's direction has unit length.
struct TileRays {
    glm::dvec3 origin, originPerX, originPerY;  ///< finest cells, from the root's lowest corner
    glm::dvec3 direction, directionPerX, directionPerY;
    bool isParallel;
    std::vector<SectionCut> sections;  ///< finest cells, relative to the middle's origin
    /// How far rays are from the middle, pixels.
    glm::vec2 reach{-kFirstColumn, -kFirstRow};
    /// How far rays of a group are at most from its middle, pixels; groups are kGroupWidth wide, and two rows high or
    /// one.
    glm::vec2 halfGroup{1.5f, 0.5f};
    bool hasSpans = false;  ///< rays begin and end where RayGroup says
};
TileRays tileRays(const PictureRays& rays, const HostGrid& grid, glm::ivec2 corner);

/// Groups of rays are four pixels wide; how high they are depends on the machine.
inline constexpr int kGroupWidth = 4, kGroupColumns = kTileWidth / kGroupWidth;
inline constexpr int kMaxTilePlanes = kGroupColumns + kTileHeight;

/// Planes through rays: n . x + w, where x is relative to the tile's origin and |n| = 1. `sum`: |n.x| + |n.y| + |n.z|.
struct TilePlanes {
    alignas(32) float x[kMaxTilePlanes], y[kMaxTilePlanes], z[kMaxTilePlanes], w[kMaxTilePlanes], sum[kMaxTilePlanes];
};
/// The planes before and behind the columns of groups, and then the rows: a box wholly below a plane of `first`, or
/// wholly above one of `last`, is met by no ray of that column or row.
struct TileSides {
    TilePlanes first, last;
};
TileSides tileSides(const TileRays& rays, int groupHeight);

/// Single precision rounds a place by at most so many times its distance, with all that is computed from it.
inline constexpr float kPlaceRounding = 0x1p-21f;

/// The rays as a leaf sees them: in leaf space, from points near to it, so that single precision suffices however far
/// the eye is. Ray (i, j) runs from start + i startPerX + j startPerY, at distance `tau`, along its direction.
struct LeafRays {
    glm::vec3 start, startPerX, startPerY;
    float distance;  ///< from the tile's origin to `start`, finest cells; multiplied with the ray's direction
    float tauMin;    ///< the rays begin here: -distance, in leaf edges
    float edge;      ///< finest cells
    float rounding;  ///< of points on the rays within the leaf, leaf edges
    int cutCount;    ///< number of section planes that cut the leaf's box
    bool hasSpans;   ///< as of TileRays
    glm::vec4 cuts[frame::kMaxSections];  ///< in leaf space: what has dot(xyz, p) >= w is kept
};
/// `lowest`: the leaf's lowest corner relative to the tile's origin, and `edge`: its edge, both in finest cells.
LeafRays leafRays(const TileRays& rays, glm::dvec3 lowest, double edge);

/// Notes which section planes cut such a leaf; leafRays notes none. Returns false where they leave nothing of it.
bool cutLeaf(const TileRays& rays, glm::dvec3 lowest, double edge, LeafRays& leaf);

}  // namespace vcp
