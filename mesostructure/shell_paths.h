// A path tracer on base surfaces with mesostructure, as tile_paths.h is one on a tile: what light from everywhere does
// there, by no table and no bands of light. Double precision, against the shapes themselves; it shares the definition
// of the shell with what is drawn (shellPieces), and neither the rays nor the marching.
//
// The bases are closed below their mesostructure; their backs are dark. Any thread may call const functions.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/mat3x3.hpp>

#include "mesostructure/shape.h"
#include "mesostructure/shell.h"
#include "mesostructure/tile_paths.h"

namespace vcp::meso {

class ShellPaths {
public:
    /// `shape` must outlive this. `height`: of the slab, world units.
    struct Surface {
        const Shape* shape = nullptr;
        BaseSurface base;
        double height = 0;
    };
    /// `albedo`: of all that is there, from 0 to 1.
    ShellPaths(const std::vector<Surface>& surfaces, double albedo);

    [[nodiscard]] double albedo() const { return albedo_; }
    /// Returns what a ray meets first, in world units. Unresolved: the back of a base, or what a shape cannot solve.
    [[nodiscard]] TileMeeting meet(glm::dvec3 origin, glm::dvec3 direction) const;
    /// As followPath.
    [[nodiscard]] TileEscape follow(TilePoint from, glm::dvec3 direction, PathRandom& random) const;

private:
    struct Piece {
        const Shape* shape;
        ShellPiece of;
        glm::dmat3 weights, tile;  ///< weights of corners 1 to 3 are weights * (p - v0); the tile's place likewise
    };
    struct Node {
        glm::dvec3 low, high;
        uint32_t first = 0, count = 0;  ///< pieces; without any: the first of two nodes
    };
    struct Passage {
        const Piece* piece;
        double enter, leave;
        int entered;  ///< the corner opposite to the face; -1: the ray starts within
        int left;
    };
    void split(uint32_t node);
    [[nodiscard]] std::vector<Passage> passages(glm::dvec3 origin, glm::dvec3 direction) const;
    [[nodiscard]] static bool passes(const Piece& piece, glm::dvec3 origin, glm::dvec3 direction, Passage& passage);

    std::vector<Piece> pieces_;
    std::vector<Node> nodes_;
    double albedo_, lift_ = 0;
};

}  // namespace vcp::meso
