// Finds which cells of a grid a triangle meets: the separating axis test of BoxOverlap, set up once for all cells.
#pragma once

#include <cstdint>
#include <vector>

#include "builder/lattice/triangle_geometry.h"

namespace vcp {

/// Tests closed unit cells, and the same widened by a margin; both are widened by 1e-9 too, so that touching counts.
class CellOverlap {
public:
    CellOverlap(const Triangle3& triangle, double margin);

    /// The cells that the triangle's bounding box meets with the margin.
    [[nodiscard]] glm::ivec3 lower() const { return nearLow_; }
    [[nodiscard]] glm::ivec3 upper() const { return nearHigh_; }

    static constexpr uint8_t kNear = 1, kTouches = 2;
    /// Sets for each cell from `low` to `high`, x running fastest, whether the triangle comes near, or even touches the
    /// cell itself; 0 for neither. Precondition: lower() <= low, high <= upper().
    void classify(glm::ivec3 low, glm::ivec3 high, std::vector<uint8_t>& cells) const;

private:
    static constexpr int kAxes = 12;  // the normal, 9 products of edges, 2 that never separate

    glm::ivec3 nearLow_, nearHigh_, touchLow_, touchHigh_;
    // A cell of centre c meets the triangle where low <= axis . c <= high on all axes.
    struct Interval {
        alignas(64) double low[kAxes], high[kAxes];
    };
    alignas(64) double x_[kAxes] = {}, y_[kAxes] = {}, z_[kAxes] = {};
    Interval near_, touch_;
};

}  // namespace vcp
