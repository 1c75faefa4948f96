// A base surface as glTF has it: a vertex for each position and place of the map, with normal and tangent, and the
// frames between them that its normal map is relative to.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mesostructure/base/texel_map.h"

namespace vcp {

struct BaseFrames {
    struct Vertex {
        uint32_t position = 0;  ///< of the surface
        glm::dvec2 place{0};    ///< texels
        glm::dvec3 normal{0};   ///< unit
        glm::dvec3 tangent{0};  ///< unit, at right angles to the normal: where the map goes to the right
        double side = 1;        ///< of cross(normal, tangent): where the map goes up
    };
    std::vector<Vertex> vertices;
    std::vector<std::array<uint32_t, 3>> triangles;

    /// Returns tangent, bitangent and normal between the corners of a triangle. The tangent and normal have unit
    /// length.
    [[nodiscard]] glm::dmat3 at(size_t triangle, glm::dvec3 weights) const;
};

/// `directions`: of each position, any length above 0 (meso::shellDirections).
BaseFrames framesOf(const meso::BaseSurface& surface, const meso::TexelMap& map,
                    const std::vector<glm::dvec3>& directions);

}  // namespace vcp
