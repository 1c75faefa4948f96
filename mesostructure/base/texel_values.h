// Values in a map of texels over a base surface: gaps are filled chart by chart, and edges are made the same from both
// sides.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <glm/vec3.hpp>

#include "mesostructure/base/texel_map.h"

namespace vcp::meso {

inline bool isMissing(float value) { return std::isnan(value); }
inline bool isMissing(const glm::vec3& value) { return std::isnan(value.x); }

/// What the texels of a map belong to.
struct TexelCharts {
    const TexelMap& map;
    std::span<const uint32_t> owners;  ///< a triangle of each texel (ownersOf)
    std::span<const uint32_t> charts;  ///< of each triangle (chartsOf)
};

/// Gives missing values of texels that have an owner the mean of their neighbours in the same chart, from those that
/// have a value outwards. What no value reaches stays missing.
void fillMissing(const TexelCharts& of, std::span<float> values);
void fillMissing(const TexelCharts& of, std::span<glm::vec3> values);

/// Makes values along the edges of an atlas the same from both sides: at corners those of the first triangle that has
/// one; along an edge those of the triangle with fewer steps, linear between its texels for the other. Beyond the
/// edges the values go on straight, so that bilinear values along a hypotenuse are linear, too, and slopes at edges are
/// those within. Nothing else is changed; nothing at all without an atlas.
void conformEdges(const BaseSurface& surface, const TexelMap& map, std::span<float> values);
void conformEdges(const BaseSurface& surface, const TexelMap& map, std::span<glm::vec3> values);

}  // namespace vcp::meso
