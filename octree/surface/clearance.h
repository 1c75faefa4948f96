// How far the empty boxes of a page can grow before they meet an occupied cell.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

namespace vcp {

/// The occupied cells of a page, and the same cells grown by 1, 2, ... cells. A page has up to 64 cells an edge.
class Clearance {
public:
    explicit Clearance(int cells);

    /// Marks the cells of a box (page space, whole cells, within the page).
    void occupy(glm::ivec3 lower, int edge);

    /// Returns by how many whole cells the box can grow on every side, clamped to the page, without meeting an occupied
    /// cell; the page's edge in cells when no cell is occupied. occupy() may not be called after the first call.
    int of(glm::ivec3 lower, int edge);

private:
    void grow();
    [[nodiscard]] bool meets(const std::vector<uint64_t>& rows, glm::ivec3 lower, int edge) const;
    [[nodiscard]] uint64_t columns(int x, int edge) const {
        return (edge >= 64 ? ~uint64_t{0} : (uint64_t{1} << edge) - 1) << x;
    }
    [[nodiscard]] size_t row(int y, int z) const { return size_t(y + 1 + side_ * (z + 1)); }

    int cells_, side_;
    std::vector<std::vector<uint64_t>> grown_;  ///< one bit a cell, one word a row along x; a border of empty rows
};

}  // namespace vcp
