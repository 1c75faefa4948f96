// Generalized displacement maps (Wang et al. 2004, 3): the distance along a ray to the solid, from every grid point of
// a tile and in every direction of a grid. View-dependent displacement maps (Wang et al. 2003) are the same from the
// slab's top alone, downwards.
//
// Points: x = i * extent.x / nodes.x and y likewise, which repeat, and z from the slab's bottom to its top, both
// included, so a ray that enters by the top starts at a sample. Directions: elevations theta from +z with half a step's
// offset, so none is at a pole or along the horizon, where no ray reaches top or bottom; azimuths phi from the x axis.
//
// A value is 0 inside the solid. Where a ray leaves the slab and meets nothing, the paper's d_max is replaced by the
// way to the boundary (its 4.1); whether there was a hit is a bit apart, which the paper lacks and has to guess.
//
// The table is the matrix that the paper factors: rows (x, y, phi), columns (theta, z); from the top alone, rows (x,
// y), columns (theta, phi).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include <glm/vec3.hpp>

#include "octree/io/result.h"

namespace vcp::meso {

struct DirectionGrid {
    int thetas = 16;         ///< 2 to 64
    int phis = 32;           ///< 4 to 64
    bool downwards = false;  ///< thetas cut the lower half alone

    [[nodiscard]] double theta(int i) const;
    [[nodiscard]] glm::dvec3 direction(int theta, int phi) const;
};

/// What a table samples. Any thread may call both; points are in the tile or on its borders.
struct TracedSolid {
    std::function<bool(glm::dvec3 point)> isInside;
    /// Returns how far the first entry into the solid is, from a point outside; nothing where the ray leaves the slab.
    std::function<std::optional<double>(glm::dvec3 point, glm::dvec3 direction)> distance;
};

struct DistanceTable {
    glm::ivec3 nodes{0};  ///< nodes.z == 1: from the top alone
    DirectionGrid directions;
    glm::dvec3 extent{0};         ///< of the tile
    float unit = 0;               ///< tile units of one step
    std::vector<uint16_t> steps;  ///< row by row
    std::vector<uint32_t> hits;   ///< a bit an entry, low first; each row begins a word

    [[nodiscard]] bool isOfTop() const { return nodes.z == 1; }
    [[nodiscard]] size_t rows() const;
    [[nodiscard]] size_t columns() const;
    [[nodiscard]] size_t row(int x, int y, int phi) const;
    [[nodiscard]] size_t column(int theta, int phi, int z) const;
    [[nodiscard]] size_t hitWords() const { return (columns() + 31) / 32; }  ///< of a row
    [[nodiscard]] bool isHit(size_t row, size_t column) const {
        return (hits[row * hitWords() + column / 32] >> (column % 32) & 1) != 0;
    }
    [[nodiscard]] float distance(size_t row, size_t column) const {
        return float(steps[row * columns() + column]) * unit;
    }
    [[nodiscard]] glm::dvec3 point(int x, int y, int z) const;
    [[nodiscard]] uint64_t bytes() const { return steps.size() * 2 + hits.size() * 4; }
};

inline constexpr int kMostNodes = 512;  ///< of a table along an axis

/// Makes a table without values. Errors: Usage (nodes or directions out of range), Limit (more than `memoryBytes`).
Result<DistanceTable> emptyTable(glm::ivec3 nodes, DirectionGrid directions, glm::dvec3 extent, uint64_t memoryBytes);

/// Fills the rows of the grid's columns from `first` to before `last`, of nodes.x * nodes.y. Disjoint ranges may be
/// filled by several threads.
void fillColumns(DistanceTable& table, const TracedSolid& solid, size_t first, size_t last);

}  // namespace vcp::meso
