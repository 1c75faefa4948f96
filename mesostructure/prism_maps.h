// What maps from a prism of the shell to tile space make of a ray, in double precision, to compare them.
//
// A prism's corners have places in the tile, and what lies between them is a choice. Where each height over the base is
// a triangle whose corners go along the columns, sides are bilinear, and a ray is a curve in tile space (Ogaki 2023):
// that map is continuous, and takes no choice of diagonals. In the three tetrahedra of shell.h a ray is three lines,
// which meet. Wang et al. 2004, 3, take one line, from where the ray enters the prism to where it leaves it; their
// sides are two triangles each, of which the exit is found by planes alone: of a side's two planes the nearer where it
// is convex and the farther where it is concave, and of all faces the nearest.
#pragma once

#include <array>
#include <optional>
#include <span>

#include <glm/vec3.hpp>

#include "mesostructure/shell.h"

namespace vcp::meso {

/// The corners of a prism: of the base by number, then those above them.
struct PrismCorners {
    std::array<glm::dvec3, 6> world, tile;
};

/// The eight triangles that a prism ends in, by corner, seen from outside where the corners' numbers go round
/// counter-clockwise: base, top, and two a side. A side's diagonal goes from the base at the lower number, as shell.h
/// has it, so both prisms at a side cut it alike.
inline constexpr std::array<std::array<int, 3>, 8> kPrismFaces = {
    {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}, {2, 0, 5}, {0, 3, 5}}};

/// Takes a prism from its pieces: as shellPieces has them, one after the other, none left out.
PrismCorners prismOf(std::span<const ShellPiece, 3> pieces);

/// A place in a prism, in the world and in the tile by the curved map.
struct PrismPlace {
    glm::dvec3 world, tile;
};
/// `weights`: of the corners of the triangle at that height, together 1; `height`: from 0 to 1.
PrismPlace curvedPlace(const PrismCorners& prism, glm::dvec3 weights, double height);

/// Returns a place in the tile by the tetrahedra; nothing outside of the prism.
std::optional<glm::dvec3> linearPlace(std::span<const ShellPiece, 3> pieces, glm::dvec3 world);

/// What one line through a prism makes of a ray.
struct StraightPassage {
    double enter = 0, leave = 0;  ///< along the ray from the place, which is 0
    glm::dvec3 enterTile, leaveTile;
    double printedLeave = 0;  ///< as the paper finds it, with planes behind `enter` left out

    /// Returns the place's own place in the tile.
    [[nodiscard]] glm::dvec3 tile() const { return enterTile - enter / (leave - enter) * (leaveTile - enterTile); }
};
/// Follows a ray through a place both ways to the faces of the prism that it lies in; nothing where it lies in none.
std::optional<StraightPassage> straightPassage(const PrismCorners& prism, glm::dvec3 world, glm::dvec3 direction);

}  // namespace vcp::meso
