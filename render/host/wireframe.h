// The lines in which a picture shows leaves and triangles (render/shared/wireframe.h), for one pixel.
#pragma once

#include <glm/vec3.hpp>

#include "octree/surface/leaf_math.h"
#include "render/host/host_scene.h"
#include "render/host/tile_hits.h"

namespace vcp {

namespace f32 {
#define INLINE inline
#include "render/shared/wireframe.h"
#undef INLINE
}  // namespace f32

/// How much of a line is seen at a hit, 0 to 1, and of what it is.
struct HitLine {
    float part = 0;
    bool isTriangles = false;  ///< of the edges of triangles; else of the walls of leaves
};

/// `pixel`: element of the arrays of `hits` at which there is a hit, on no cap; `direction`: of its ray, unit, in the
/// dataset's axes; `pixelEdge`: of a pixel at the hit, finest cells.
HitLine lineAt(const HostScene& scene, const TileHits& hits, int pixel, glm::vec3 direction, float pixelEdge);

/// Draws the line over a colour, RGBA8.
uint32_t withLine(uint32_t colour, const HitLine& line);

}  // namespace vcp
