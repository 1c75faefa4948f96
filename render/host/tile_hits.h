// What the rays of one tile hit.
#pragma once

#include <bitset>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "octree/page/strips.h"

namespace vcp {

/// The depth, or the distance along a ray, where nothing is hit.
inline constexpr float kNoDepth = std::numeric_limits<float>::infinity();

inline constexpr int kTileWidth = 16, kTileHeight = 8, kTilePixels = kTileWidth * kTileHeight;

/// A soft or slab leaf, or a triangle of a hard leaf, that rays of the tile hit.
struct HitLeaf {
    uint32_t page;         ///< of the scene (HostScene::page)
    uint32_t node;         ///< the leaf's node word
    Index3 corners = {};   ///< the triangle's vertices a, b and c in the page; of hard leaves only
    glm::vec3 flat{0};     ///< (b - a) x (c - a); likewise
    glm::uvec3 corner{0};  ///< the leaf's lowest corner, subcells; of soft and slab leaves only
    uint32_t bits = 0;     ///< log2 of the leaf's edge in subcells; of these, too
};

/// The work of a tile's rays, which go in groups of 4 x 2 or 4 x 1 (ray_group-inl.h): what was done until each ended.
struct TileWork {
    uint32_t steps[kTilePixels];    ///< nodes visited that the ray's group may meet
    uint32_t cells[kTilePixels];    ///< leaves that the group was cast at
    uint32_t fetches[kTilePixels];  ///< steps, and reads of at most 16 bytes in those leaves
};

/// The first hits of a tile's rays. Element y * kTileWidth + x of an array belongs to pixel corner + (x, y); those
/// outside of the picture say nothing.
struct TileHits {
    glm::ivec2 corner{0};
    glm::ivec2 size{0};                      ///< pixels of the tile that are in the picture
    bool any = false;                        ///< false: no ray hit, and nothing below is written
    alignas(32) float depth[kTilePixels];    ///< world units; infinite where a ray hit nothing
    alignas(32) uint32_t leaf[kTilePixels];  ///< element of `leaves`; undefined where a ray hit nothing
    /// The hit in leaf space where a soft or slab leaf is hit; else the weights of the triangle's second and third
    /// vertex, and 0.
    alignas(32) float x[kTilePixels], y[kTilePixels], z[kTilePixels];
    /// A number with the sign of the side that the ray came from: of soft leaves that of sideBefore
    /// (shared/leaf_math.h), of triangles 1 for that of (b - a) x (c - a).
    alignas(32) float side[kTilePixels];
    /// The surface's normal: of any length, on the side that the ray comes from, or near a silhouette leaning away a
    /// bit.
    alignas(32) float normalX[kTilePixels], normalY[kTilePixels], normalZ[kTilePixels];
    std::bitset<kTilePixels> onCap;  ///< where the cap of a section is hit (section_caps.h)
    std::vector<HitLeaf> leaves;
    float widestSlab = 0;              ///< edge of the largest slab leaf among them, finest cells
    std::bitset<kTilePixels> blended;  ///< where the normal and `colour` are blends of slabs (slab_blend.h)
    glm::vec4 colour[kTilePixels];     ///< undefined elsewhere
    std::optional<TileWork> work;      ///< where there is one, it is filled, for rays that hit nothing, too
};

}  // namespace vcp
