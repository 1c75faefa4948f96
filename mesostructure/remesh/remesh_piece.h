// What the steps of remeshing hand on: corners in eye space and in the grid, and pieces of base triangles. For this
// room alone.
#pragma once

#include <array>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mesostructure/remesh/remesh_math.h"
#include "mesostructure/remesh/remesher.h"

namespace vcp::meso {

/// A corner of a piece. What is interpolated over the piece is the part up to `height`.
template <class Real>
struct RemeshCorner {
    glm::vec<3, Real> position{0}, direction{0};  ///< eye space
    glm::vec<2, Real> uv{0};
    Real density = 0;  ///< texels a world unit
    Real height = 0;   ///< of the corner itself, the same in all pieces
    Real weight = 1;   ///< 1 / depth: what perspective interpolates with
    glm::ivec3 grid{0};
};

/// The coordinates of an edge's other side, from its start to its end.
template <class Real>
struct RemeshSeam {
    bool is = false;
    std::array<glm::vec<2, Real>, 2> uvs{};
};

template <class Real>
struct RemeshPiece {
    std::array<RemeshCorner<Real>, 3> corners;
    std::array<RemeshSeam<Real>, 3> seams;  ///< of the edges from corner k to the next
    int halvings = 0;
};

/// Derivatives of a base triangle's places and directions by its texture coordinates; eye space.
template <class Real>
struct RemeshFrame {
    glm::vec<3, Real> byU{0}, byV{0}, directionByU{0}, directionByV{0};
    glm::vec<3, Real> flat{0};  ///< the triangle's own normal
    Real turned = 0;            ///< sign of a product of derivatives that points outwards; 0 where the map has no area
};

/// What stays the same over a frame.
template <class Real>
struct RemeshFrameView {
    using Math = RemeshMath<Real>;
    const RemeshSurface& surface;
    RemeshOptions options;
    typename Math::RemeshGrid grid;
    Real cellSize;  ///< world units of a cell at depth 1, or at any of parallel rays

    /// Returns the height at a place, of a point of the surface at `position`.
    [[nodiscard]] Real heightAt(glm::vec<2, Real> uv, const glm::vec<3, Real>& position,
                                const glm::vec<3, Real>& direction, Real density) const {
        const HeightLevels& heights = *surface.heights;
        const Real texels = texelsAt(position, density);
        const Real centre = heights.height(uv, texels);
        if (options.access == HeightAccess::Sample || !(texels > 1)) return centre;
        // The footprint is stretched to a square, which the edge alone allows; its samples are half a cell away.
        const Real half = Real(0.5) * texels / Real(heights.levels().front().size.x);
        const glm::vec<3, Real> seenAlong = grid.isParallel != 0u ? glm::vec<3, Real>(0, 0, 1) : position;
        const bool isBehind = glm::dot(direction, seenAlong) > 0;
        Real most = centre;
        for (const Real x : {-half, half})
            for (const Real y : {-half, half}) {
                const Real sample = heights.height(uv + glm::vec<2, Real>(x, y), texels);
                most = isBehind ? std::min(most, sample) : std::max(most, sample);
            }
        return most;
    }
    /// Returns the edge of a cell there, in texels.
    [[nodiscard]] Real texelsAt(const glm::vec<3, Real>& position, Real density) const {
        return density * cellSize * Math::remeshDepth(grid, position);
    }
};

}  // namespace vcp::meso
