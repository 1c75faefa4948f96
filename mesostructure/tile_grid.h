// Tile space and the grids in it.
//
// A mesostructure is one tile of a periodic slab: x in [0, 1), y in [0, extent.y), both repeated for ever, z in
// [0, extent.z]. One unit is the tile's edge along x: lengths, distances and ray parameters are in tile units.
// A TileGrid cuts the tile into cells; cells need not be cubes. Cells outside in x and y are those of a neighbouring
// tile; cells outside in z are empty.
#pragma once

#include <cmath>
#include <cstddef>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace vcp::meso {

/// Least and greatest number of cells along an axis of any grid or map, and the most cells of a grid in all.
inline constexpr int kMaxGridEdge = 4096;
inline constexpr size_t kMaxGridCells = size_t{1} << 28;

/// Cells are widened by this part of their edge wherever "does the surface touch it" is asked. It is far above what
/// single precision loses along a ray, so a ray whose rounded position lies in a neighbour still finds a marked cell.
inline constexpr double kCellSlack = 1e-3;

inline int wrapped(int i, int n) {
    const int rest = i % n;
    return rest < 0 ? rest + n : rest;
}

/// Moves the origin into the tile at 0, exactly: rays of far tiles lose no precision to their place.
inline glm::dvec3 inFirstTile(glm::dvec3 origin, glm::dvec3 extent) {
    origin.x -= extent.x * std::floor(origin.x / extent.x);
    origin.y -= extent.y * std::floor(origin.y / extent.y);
    return origin;
}

struct TileGrid {
    glm::ivec3 cells{1};
    glm::dvec3 cell{1};  ///< edges of a cell, tile units

    TileGrid() = default;
    TileGrid(glm::ivec3 count, glm::dvec3 extent) : cells(count), cell(extent / glm::dvec3(count)) {}

    [[nodiscard]] size_t count() const { return size_t(cells.x) * size_t(cells.y) * size_t(cells.z); }
    [[nodiscard]] glm::dvec3 extent() const { return cell * glm::dvec3(cells); }
    /// Returns a cell's index; x is fastest, x and y wrap, z must lie in the grid.
    [[nodiscard]] size_t index(glm::ivec3 at) const {
        return size_t(wrapped(at.x, cells.x)) +
               size_t(cells.x) * (size_t(wrapped(at.y, cells.y)) + size_t(cells.y) * size_t(at.z));
    }
    [[nodiscard]] glm::ivec3 at(size_t index) const {
        const auto nx = size_t(cells.x), ny = size_t(cells.y);
        return {int(index % nx), int(index / nx % ny), int(index / nx / ny)};
    }
    [[nodiscard]] glm::dvec3 lower(glm::ivec3 at) const { return glm::dvec3(at) * cell; }
    [[nodiscard]] glm::dvec3 centre(glm::ivec3 at) const { return (glm::dvec3(at) + 0.5) * cell; }
};

}  // namespace vcp::meso
