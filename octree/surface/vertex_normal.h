// Normals of vertices from the triangles around them, in integers: the builder computes them from a mesh, the
// page codec predicts them from the triangles of a page, and where a page has all of a vertex' triangles the
// two agree to the last bit.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

namespace vcp {

using WideVector = glm::i64vec3;

/// Cross product of two edges of a triangle: its normal, twice its area long. Components of edges below 2^21.
WideVector areaNormal(glm::i32vec3 a, glm::i32vec3 b, glm::i32vec3 c);

/// Adds a triangle's normal to a vertex' sum, without orientation: the normal is turned to the side of the sum.
void addNormal(WideVector& sum, WideVector normal);

/// Returns for each vertex whether its triangles turn away from its normal by more than 40 degrees: any of them, or,
/// for a `share`, so many that they have 1 / share of the area around it. Scans are full of slivers that face anywhere,
/// and these alone make no crease.
std::vector<uint8_t> creases(std::span<const WideVector> normals, std::span<const WideVector> sums,
                             std::span<const std::array<uint32_t, 3>> triangles, int64_t share = 0);

/// Normals are kept to 12 + 12 bits of the octahedron's upper half (z >= 0), 0.07 degrees: they have no side.
inline constexpr uint32_t kNormalSteps = 4095;

/// Grid point of a normal, 0 to kNormalSteps on both axes. A sum of length 0 gets the z axis.
struct NormalGridPoint {
    uint32_t u, v;
};
NormalGridPoint normalGridPoint(WideVector sum);

/// Packs a normal (page_layout.h) from its grid point, and back: false where the code is not one of the grid.
uint32_t packGridNormal(NormalGridPoint point, bool crease);
bool gridPointOf(uint32_t code, NormalGridPoint& point);

/// Stands for a normal that is not known. It lies between the points of the grid, so no packed normal has this value.
inline constexpr uint32_t kUnknownNormal = 2;

/// Packs a direction of any length; kUnknownNormal where it has none: of length 0, or not finite.
uint32_t packDirection(glm::dvec3 direction);

}  // namespace vcp
