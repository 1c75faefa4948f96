// The outline of what a mask leaves of a triangle.
//
// Along an edge, what is kept depends on the edge alone, so that triangles that share it agree to the last bit: it is
// halved until its pieces are shorter than a texel, or all of one kind. Inside, the triangle is cut into ever smaller
// similar ones, where there is something to find; in the smallest, a straight piece of outline parts the corners that
// are there from those that are not ("marching triangles": no case is ambiguous, and what the edges say is kept).
//
// Work is bounded: where there is too much to find, a coarser level of the mask is looked at.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include <glm/vec2.hpp>

#include "builder/mask/alpha_mask.h"
#include "builder/mask/triangle_weights.h"

namespace vcp {

/// A closed line with what is kept on its left, where corners 0, 1, 2 go round to the left.
struct MaskLoop {
    struct Point {
        Weights weights;
        bool isFixed;  ///< lies on an edge of the triangle
    };
    std::vector<Point> points;
};

struct MaskOutline {
    std::vector<MaskLoop> loops;  ///< they do not cross or touch
    uint32_t level = 0;           ///< of the mask, that was looked at
    bool keepsEdges = false;      ///< all of the triangle's edges are there

    /// Whether loops, simplified or not, are the triangle itself.
    [[nodiscard]] bool isWhole(const std::vector<MaskLoop>& left) const;
};

/// Finds the outline in a triangle, at a level of the mask that is no finer than `leastLevel`. `texels`: of its corners
/// (AlphaMask), finite. Nothing where there is too much to find even at the coarsest.
std::optional<MaskOutline> findOutline(const AlphaMask& mask, const std::array<glm::dvec2, 3>& texels,
                                       uint32_t leastLevel = 0);

}  // namespace vcp
