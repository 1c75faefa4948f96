// 32-bit packing of vectors to the closest point, of vertices and of normals.
//
// Two packings of a VCP: the default (11 bits distance, 10 + 10 bits octahedral direction, 1 bit sign;
// decoded by octree/shared/leaf_math.h) and the paper's (13 bits square root of the distance, 9 + 10 bits
// spherical angles; Demir and Westermann 2015, section 4.1). Directions err by 0.084 degrees in the mean
// against 0.122 (at most 0.236 against 0.247); the default needs no trigonometry to decode and carries a sign.
#pragma once

#include <cstdint>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace vcp {

/// Packs a distance (in leaf edges, 0 to kPackedDistanceRange, clamped), the unit direction from the closest
/// point to the corner, and on which side of the leaf's surface the corner lies. The direction is kept where
/// the distance is 0. Precondition: |direction| = 1 +- 1e-6.
uint32_t packVector(double distance, glm::dvec3 direction, bool negative);

/// The same vector with the corner on the other side.
inline uint32_t flipSide(uint32_t code) { return code ^ 0x80000000u; }

/// The paper's packing of v = closest point - corner, with |v| clamped to `range`. A zero vector loses its
/// direction, as in the paper.
uint32_t packVectorSpherical(glm::dvec3 v, double range);
glm::dvec3 unpackVectorSpherical(uint32_t code, double range);

/// Packs the direction of a slab leaf's planes into 20 bits: the code whose direction (decodeDirection) or its opposite
/// is nearest. Of n and -n, which mean the same planes, it codes the one whose component of largest magnitude, the
/// first of these, is positive. Precondition: |n| = 1 +- 1e-6.
uint32_t packSlabDirection(glm::dvec3 n);

/// Packs the thinnest slab that holds first - kSlabSlack <= n . (x - c) <= last + kSlabSlack; n: the direction that
/// `direction`, from packSlabDirection, decodes to; c: the leaf's centre; x in leaf space, so all in leaf edges. What
/// lies beyond the leaf's corners is cut off. Precondition: first <= last.
uint32_t packSlab(uint32_t direction, double first, double last);

/// The node word of a slab leaf. Preconditions: octants is 1 to 255, vector at most kSlabVectorMask.
uint32_t slabNode(uint32_t octants, uint32_t vector);

/// Octahedral normal in 16 + 16 bits; `crease` goes to the lowest bit (kNormalCreaseBit).
uint32_t packNormal(glm::dvec3 normal, bool crease);

/// Three 21-bit fields, x in the lowest bits of the first word. Precondition: each below 2^21.
glm::u32vec2 pack21(uint32_t x, uint32_t y, uint32_t z);
glm::u32vec3 unpack21(glm::u32vec2 code);

}  // namespace vcp
