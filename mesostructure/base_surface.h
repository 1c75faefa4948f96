// Base surfaces that mesostructure is laid on: triangles with a texture map in tile units. The shapes are made here;
// mesh files come from viewer/scene/base_mesh.h. What looks at their edges is in mesostructure/base/.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "octree/io/result.h"

namespace vcp::meso {

struct BaseSurface {
    std::vector<glm::dvec3> positions;  ///< world
    std::vector<std::array<uint32_t, 3>>
        triangles;  ///< counter-clockwise from outside; corners at one place share the number
    std::vector<std::array<glm::dvec2, 3>> uvs;  ///< of the triangles' corners, in tile units
};

/// The names are "quad", "box", "cylinder", "sphere", "torus", "teapot", and those of makeTubes: "vase", "bird",
/// "dinosaur" and "tree". All but the teapot, which is in its traditional units, fit [-1, 1]^3 or are a little larger,
/// the dinosaur [-2.2, 2.2]; z is up.
std::span<const std::string_view> baseSurfaceNames();

/// `tiles`: tile edges along the edge of the quad, of a side of the box, of a sixth of the sphere, of the cylinder's
/// height and diameter, once round the torus' tube, a quarter round the teapot, and as makeTubes has it. Errors: Usage
/// (no such name, tiles not above 0).
Result<BaseSurface> makeBaseSurface(std::string_view name, double tiles);

/// The torus of makeBaseSurface: the radius of its tube, that of its ring being 1, and the tiles round the ring for
/// each round the tube.
inline constexpr double kTorusTube = 0.45;
inline constexpr int kTorusRingTiles = 3;
/// Makes it of so many cells, two triangles each, round the ring and round the tube.
BaseSurface torusSurface(double tiles, glm::ivec2 cells);

/// Gives equal positions one number, in the order in which they first come.
void joinPositions(BaseSurface& surface);

/// Returns the world units of a tile's edge, averaged over the area; 0 where the map has no area.
double tileEdge(const BaseSurface& surface);

}  // namespace vcp::meso
