// The shell over a base surface that mesostructure fills: a prism a base triangle, from the base along the directions
// of its corners (Hirche et al. 2004, Wang et al. 2004: three tetrahedra a prism, linear maps to texture space).
//
// Directions are normals averaged over the triangles at a position, weighted by angle, lengthened so that the faces'
// offset is the height. A side of a prism belongs to two prisms; its diagonal goes from the base at the corner of the
// lower number, so both cut it alike and the shell has neither gap nor overlap. In a tetrahedron world space and tile
// space are related linearly: straight rays stay straight, parameters scale.
//
// Where the surface is more sharply concave than the shell is high, columns would pass each other, and tetrahedra would
// be turned inside out. There columns are cut, the tile's height with them: the mesostructure keeps its measure, the
// shell ends lower, and what it ends in shows its cut.
//
// What a map or a surface may do to a shell is counted, not refused: triangles without area are left out; where the map
// has no area (the texture is smeared along it); mirrored maps, which need nothing; columns that are cut; tetrahedra
// that are turned inside out whatever is cut, where a surface folds within a triangle: pieces overlap, and the nearest
// wins; tetrahedra without volume, which are left out: where faces lie on their own backs there is no outside.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "mesostructure/base_surface.h"
#include "mesostructure/march_math.h"

namespace vcp::meso {

struct Shell {
    static constexpr uint32_t kNodeTexels = f32::kShellNodeTexels, kPieceTexels = f32::kShellPieceTexels,
                              kDepth = f32::kShellDepth;

    glm::dvec3 origin{0};        ///< what all coordinates are relative to: the middle of the base
    glm::dvec3 low{0}, high{0};  ///< box of the shell, world
    uint32_t nodes = 0, pieces = 0;
    uint64_t withoutArea = 0, withoutMap = 0, mirrored = 0;  ///< triangles
    uint64_t cut = 0;                                        ///< columns
    uint64_t inverted = 0, flat = 0;                         ///< pieces

    /// `nodes` nodes, then `pieces` tetrahedra, then a direction for each position, as shaders read them:
    ///   node    (low, first child or first piece) (high, pieces; 0: two children, one after the other)
    ///   piece   (v0, bits: 1 << i where the face opposite corner i is cut, kBase where the one opposite the last is
    ///   the base, and its part, f32::kShellPart)
    ///           3 x (row of R, coordinate of q0)    weights of corners 1 to 3 are R (p - v0)
    ///           3 x (row of T, position's number)   tile space is q0 + T (p - v0); q0 is in the first tile; the
    ///           positions of its prism's columns
    ///   direction   (unit normal of the base, 1), or 0 where the base turns sharply there
    /// A face is cut where it is on a border of the base, where the map jumps, or where it is the top over a column
    /// that was cut: solid shows its cut there. Bits have f32::kShellSmooth where no column is cut and none of the
    /// directions is 0.
    static constexpr uint32_t kBase = f32::kShellBaseFace;
    std::vector<glm::vec4> texels;
};

/// `height`: height of the shell over flat parts, world units; `extent`: extent of the tile, tile units; `offset`: how
/// far the shell's bottom lies over the base, along the same directions, world units; below 0 under it. Errors: Usage
/// (heights not above 0, an offset that is not finite, not a map of each triangle); InvalidInput (no triangle with
/// area, coordinates that are not finite, also in single precision); Limit (2^24 pieces).
Result<Shell> buildShell(const BaseSurface& surface, double height, glm::dvec3 extent, double offset = 0);

/// A tetrahedron of a shell, in double precision.
struct ShellPiece {
    /// As Shell::texels has them; the base's corners are first, each column's from below. World, from Shell::origin.
    std::array<glm::dvec3, 4> corners, tile;
    uint32_t bits = 0;                  ///< as Shell::texels has them
    std::array<uint32_t, 3> columns{};  ///< positions of the base
    [[nodiscard]] glm::dvec3 low() const {
        return glm::min(glm::min(corners[0], corners[1]), glm::min(corners[2], corners[3]));
    }
    [[nodiscard]] glm::dvec3 high() const {
        return glm::max(glm::max(corners[0], corners[1]), glm::max(corners[2], corners[3]));
    }
};
/// Returns the pieces that buildShell makes texels of, and fills `shell` with its origin and counts. Preconditions:
/// those that buildShell checks.
std::vector<ShellPiece> shellPieces(const BaseSurface& surface, double height, glm::dvec3 extent, double offset,
                                    Shell& shell);

/// Returns the direction of each position in heights, of at most 3: what a shell's corners are moved along. 0 where the
/// normals cancel, or where no triangle with area is.
std::vector<glm::dvec3> shellDirections(const BaseSurface& surface);

}  // namespace vcp::meso
