// The outline of what a mask leaves of a triangle.
//
// Along an edge, what is kept depends on the edge alone, so that triangles that share it agree to the last bit: it is
// halved until its pieces are shorter than a texel, or all of one kind. Inside, the triangle is cut into ever smaller
// similar ones, where there is something to find; in the smallest, a straight piece of outline parts the corners that
// are there from those that are not ("marching triangles": no case is ambiguous, and what the edges say is kept). The
// chains of such pieces are then simplified (Douglas and Peucker 1973) to within half a texel.
//
// Work is bounded: where there is too much to find, a coarser level of the mask is looked at; where there are too many
// points, they are simplified with ever larger tolerances.
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

class MaskOutline {
public:
    /// Finds the outline in a triangle. `texels`: of its corners (AlphaMask), finite. Nothing where the mask repeats so
    /// often along an edge that it cannot be cut: the triangle stays whole.
    static std::optional<MaskOutline> find(const AlphaMask& mask, const std::array<glm::dvec2, 3>& texels);

    /// The loops, simplified with `tolerance` (texels); each call goes on from the one before. They may touch or cross.
    void simplify(double tolerance);

    [[nodiscard]] const std::vector<MaskLoop>& loops() const { return loops_; }
    /// Tolerance of half a texel, less what the outline is off already; texels of the level that was looked at.
    [[nodiscard]] double leastTolerance() const { return leastTolerance_; }
    /// About how many triangles they make.
    [[nodiscard]] size_t triangles() const;
    /// Whether they are the triangle itself.
    [[nodiscard]] bool isWhole() const { return loops_.size() == 1 && loops_[0].points.size() == 3 && allKept_; }

private:
    std::array<glm::dvec2, 3> texels_;
    std::vector<MaskLoop> loops_;
    double leastTolerance_ = 0;
    bool allKept_ = false;
};

}  // namespace vcp
