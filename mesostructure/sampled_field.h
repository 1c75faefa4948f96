// Signed distances of a solid at the grid points of a grid, 16 bits each, cut to a band; trilinear between them.
//
// What is stored is the distance less a twelfth of its second differences, so that the trilinear surface is right on
// average over a cell (quasi-interpolation, Condat et al. 2005). With the distances themselves it is right at the grid
// points and, by up to an eighth of the second differences, too high between them: what is convex shrinks, and rays at
// silhouettes miss.
#pragma once

#include <cstdint>
#include <vector>

#include "mesostructure/distance_map.h"

namespace vcp::meso {

struct SampledField {
    TileGrid grid;               ///< cells between the samples
    float unit = 0;              ///< tile units of one step
    std::vector<int16_t> steps;  ///< x fastest; cells.x * cells.y * (cells.z + 1): x and y repeat, z does not

    [[nodiscard]] int16_t step(glm::ivec3 point) const {
        return steps[size_t(wrapped(point.x, grid.cells.x)) +
                     size_t(grid.cells.x) *
                         (size_t(wrapped(point.y, grid.cells.y)) + size_t(grid.cells.y) * size_t(point.z))];
    }
    [[nodiscard]] uint64_t bytes() const { return steps.size() * sizeof(int16_t); }
};

inline constexpr int kBandCells = 4;  ///< distances are cut to so many of the largest edge of a cell

/// Samples a shape. Errors: Usage (no cells), Limit.
Result<SampledField> sampleField(const Shape& shape, glm::ivec3 cells);

/// Also marks the cells that the trilinear surface of the samples passes, which may stray from the shape's. The grid's
/// cells must divide the field's.
void occupyField(const SampledField& field, Occupancy& occupancy);

}  // namespace vcp::meso
