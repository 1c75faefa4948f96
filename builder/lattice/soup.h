// The records that pass between the stages of a build: triangles that stand alone, without indices. A vertex is its
// position; its attributes travel with every triangle that has it.
#pragma once

#include <cstdint>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "octree/surface/vertex_normal.h"

namespace vcp {

/// A triangle as the mesh has it, world units. Real: float where that holds the file's numbers exactly.
template <class Real>
struct WorldTriangle {
    glm::vec<3, Real> corner[3];
    uint32_t colour[3];  ///< RGBA8; white where the mesh has none
    glm::vec2 uv[3];
    uint32_t material;  ///< number among the soup's materials, from 1; 0: none
    uint32_t normal[3] = {kUnknownNormal, kUnknownNormal, kUnknownNormal};  ///< the mesh's own (packDirection)
    uint32_t reserved = 0;
};
static_assert(sizeof(WorldTriangle<float>) == 92 && sizeof(WorldTriangle<double>) == 128);

/// Parts of a mesh that are known to be closed or open, and the first number of those that are not known yet
/// (builder/level/closed_parts.h).
inline constexpr uint32_t kClosedPart = 0, kOpenPart = 1, kFirstUndecidedPart = 2;

/// A triangle on a level's lattice.
struct LatticeTriangle {
    glm::i32vec3 corner[3];
    uint32_t colour[3];
    uint32_t normal[3];  ///< packNormal with crease flag; unknown before the vertices' pass
    float stray;         ///< cells: how far its points may be from the mesh's, both ways
    uint32_t part = 0;   ///< that it belongs to: unknown before the vertices' pass, and on coarser levels
    uint32_t own[3] = {kUnknownNormal, kUnknownNormal, kUnknownNormal};  ///< the mesh's own normals (packDirection)
};
static_assert(sizeof(LatticeTriangle) == 80);

/// Where a triangle of the deepest level's lattice is in an image, for triangles that have one. It travels by itself,
/// and finds its triangle by the corners.
struct TexturedTriangle {
    glm::i32vec3 corner[3];
    glm::i32vec2 point[3];  ///< of the corners, as TexturePoint (octree/page/page.h) has it
    uint32_t material;      ///< likewise
};
static_assert(sizeof(TexturedTriangle) == 64);

}  // namespace vcp
