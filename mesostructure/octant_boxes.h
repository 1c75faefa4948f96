// Octant boxes: for each cell and each octant of directions, the extents of an empty box of cells that starts there. A
// ray leaves the box at once, by integer cells; the step rules of spheres are not needed. (The idea of boxes in one
// word is that of ISO-Viewer's extended anisotropic distances; grown here from the largest cube, axis by axis.)
#pragma once

#include <cstdint>
#include <vector>

#include "mesostructure/sampled_field.h"

namespace vcp::meso {

using f32::octantOf;

struct OctantBoxes {
    static constexpr int kMost = 31;  ///< cells beyond its own by which a box grows along an axis
    static constexpr uint16_t kOccupied = f32::kMesoBoxOccupied, kSmallCells = f32::kMesoSmallCells;

    TileGrid grid;
    /// Octant by octant, cells as in the grid. Bits 0-4, 5-9, 10-14: further cells that are empty along x, y, z; a box
    /// that reaches the slab's top or bottom goes on as if the outside were empty cells. Bit 15 (kOccupied): the
    /// cell is occupied; the others are 0 then, or what markSmallCells put there.
    std::vector<uint16_t> boxes;

    [[nodiscard]] uint64_t bytes() const { return boxes.size() * sizeof(uint16_t); }
};

OctantBoxes buildOctantBoxes(const Occupancy& occupancy);

/// Marks for each occupied cell which of its 2 x 2 x 2 small cells the field's surface passes, so that the others need
/// not be read: kSmallCells, and bits 0 to 7, x lowest. Removes all marks where the field has another number of cells
/// in a cell.
void markSmallCells(const SampledField& field, OctantBoxes& boxes);

}  // namespace vcp::meso
