#include "mesostructure/octant_boxes.h"

#include <algorithm>

#include <glm/common.hpp>

namespace vcp::meso {

namespace {

constexpr int kMost = OctantBoxes::kMost;

/// Counts the occupied cells of any box that starts in the tile and reaches up to kMost + 1 cells beyond it: a summed
/// volume.
class BoxCount {
public:
    explicit BoxCount(const Occupancy& occupancy)
        : size_(occupancy.grid.cells + 2 * kMargin + 1), sums_(size_t(size_.x) * size_t(size_.y) * size_t(size_.z)) {
        for (int z = 1; z < size_.z; ++z)
            for (int y = 1; y < size_.y; ++y)
                for (int x = 1; x < size_.x; ++x)
                    sums_[slot(x, y, z)] =
                        uint32_t(occupancy.at(glm::ivec3(x, y, z) - 1 - kMargin)) + sums_[slot(x - 1, y, z)] +
                        sums_[slot(x, y - 1, z)] + sums_[slot(x, y, z - 1)] - sums_[slot(x - 1, y - 1, z)] -
                        sums_[slot(x, y - 1, z - 1)] - sums_[slot(x - 1, y, z - 1)] + sums_[slot(x - 1, y - 1, z - 1)];
    }
    /// Whether the cells from `a` to `b`, both included, in either order, are empty.
    bool isEmpty(glm::ivec3 a, glm::ivec3 b) const {
        const glm::ivec3 low = glm::min(a, b) + kMargin, high = glm::max(a, b) + kMargin + 1;
        return sums_[slot(high.x, high.y, high.z)] - sums_[slot(low.x, high.y, high.z)] -
                   sums_[slot(high.x, low.y, high.z)] - sums_[slot(high.x, high.y, low.z)] +
                   sums_[slot(low.x, low.y, high.z)] + sums_[slot(low.x, high.y, low.z)] +
                   sums_[slot(high.x, low.y, low.z)] - sums_[slot(low.x, low.y, low.z)] ==
               0;
    }

private:
    static constexpr int kMargin = kMost + 1;
    size_t slot(int x, int y, int z) const {
        return size_t(x) + size_t(size_.x) * (size_t(y) + size_t(size_.y) * size_t(z));
    }
    glm::ivec3 size_;
    std::vector<uint32_t> sums_;  ///< modulo 2^32: differences are exact
};

/// Grows the largest cube, then each axis in turn by one cell while the box stays empty.
glm::ivec3 grow(const BoxCount& count, glm::ivec3 at, glm::ivec3 sign) {
    int low = 0, high = kMost;
    while (low < high) {
        const int middle = (low + high + 1) / 2;
        if (count.isEmpty(at, at + sign * middle))
            low = middle;
        else
            high = middle - 1;
    }
    glm::ivec3 extent(low);
    for (bool grows = true; grows;) {
        grows = false;
        for (int axis = 0; axis < 3; ++axis) {
            if (extent[axis] == kMost) continue;
            glm::ivec3 near = at, far = at + sign * extent;
            near[axis] = far[axis] = at[axis] + sign[axis] * (extent[axis] + 1);
            if (!count.isEmpty(near, far)) continue;
            ++extent[axis];
            grows = true;
        }
    }
    return extent;
}

}  // namespace

OctantBoxes buildOctantBoxes(const Occupancy& occupancy) {
    const TileGrid& grid = occupancy.grid;
    OctantBoxes result{grid, std::vector<uint16_t>(8 * grid.count())};
    const BoxCount count(occupancy);
    for (int octant = 0; octant < 8; ++octant) {
        const glm::ivec3 sign(octant & 1 ? -1 : 1, octant & 2 ? -1 : 1, octant & 4 ? -1 : 1);
        for (size_t i = 0; i < grid.count(); ++i) {
            uint16_t& box = result.boxes[size_t(octant) * grid.count() + i];
            if (occupancy.cells[i] != 0) {
                box = OctantBoxes::kOccupied;
                continue;
            }
            const glm::ivec3 extent = grow(count, grid.at(i), sign);
            box = uint16_t(extent.x | extent.y << 5 | extent.z << 10);
        }
    }
    return result;
}

void markSmallCells(const SampledField& field, OctantBoxes& boxes) {
    const TileGrid& grid = boxes.grid;
    const bool fits = field.grid.cells == 2 * grid.cells;
    for (size_t i = 0; i < grid.count(); ++i) {
        if ((boxes.boxes[i] & OctantBoxes::kOccupied) == 0) continue;
        uint16_t box = uint16_t(OctantBoxes::kOccupied | (fits ? OctantBoxes::kSmallCells : 0));
        for (int small = 0; fits && small < 8; ++small) {
            const glm::ivec3 at = 2 * grid.at(i) + glm::ivec3(small & 1, small >> 1 & 1, small >> 2);
            int inside = 0;
            for (int corner = 0; corner < 8; ++corner)
                inside += field.step(at + glm::ivec3(corner & 1, corner >> 1 & 1, corner >> 2)) <= 0;
            if (inside != 0 && inside != 8) box = uint16_t(box | 1 << small);
        }
        for (int octant = 0; octant < 8; ++octant) boxes.boxes[size_t(octant) * grid.count() + i] = box;
    }
}

}  // namespace vcp::meso
