// Procedural height fields and solids by name; periodic, seeded, the same on every machine up to the last bits of
// the maths library.
#pragma once

#include <functional>
#include <span>
#include <string_view>

#include "mesostructure/shape.h"

namespace vcp::meso {

/// Names: "fbm", "ridged", "hemispheres", "maze", "blocks", "bricks", "ripple", "needle", "edge", "bark", "cobble".
std::span<const std::string_view> heightFieldNames();
/// Makes a square map of `texels` an edge, from 8 to kMaxMapEdge. Errors: Usage (no such name, bad size).
Result<HeightMap> makeHeightField(std::string_view name, int texels, uint32_t seed);

/// The names are "bead", "beads", "ball", "chain", "weave", "bars", "scales", "kitten", "flakes", "gyroid", "sponge",
/// "blades".
std::span<const std::string_view> solidNames();

/// A solid by a formula. `field` is above 0 outside and changes by at most 1 a unit of length.
struct Solid {
    glm::dvec3 extent{1};
    std::function<double(glm::dvec3)> field;
};
/// Makes a solid by name. Errors: Usage (no such name).
Result<Solid> makeSolid(std::string_view name, uint32_t seed);

}  // namespace vcp::meso
