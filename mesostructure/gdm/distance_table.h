// Generalized displacement maps (Wang et al. 2004, 3): the distance along a ray to the solid, from every grid point of
// a tile and in every direction of a grid. View-dependent displacement maps (Wang et al. 2003) are the same from the
// slab's top alone, downwards, over bases of several curvatures.
//
// Points: x = i * extent.x / nodes.x and y likewise, which repeat, and z from the slab's bottom to its top, both
// included, so a ray that enters by the top starts at a sample. Directions: elevations theta from +z with half a step's
// offset, so none is at a pole or along the horizon, where no ray reaches top or bottom; azimuths phi from the x axis.
//
// A value is 0 inside the solid. Where a ray leaves the slab and meets nothing, the paper's d_max is replaced by the
// way to the boundary (its 4.1); whether there was a hit is a bit apart, which the paper lacks and has to guess.
//
// Over a base that bends, a straight ray is a curve in tile space (mesostructure/gdm/bent_path.h). From the top alone,
// distances are along the curves over arcs of several curvatures, from -most to most in equal steps; a ray leaves the
// slab by the top where the base bends away from it first. Tile space is taken to be as long along the base as the
// world is, and curvature to be the same all along the ray.
//
// The table is the matrix that the paper factors: rows (x, y, phi), columns (theta, z); from the top alone, rows (x,
// y), columns (curvature, theta, phi).
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

/// Curvatures of a base along a ray. One sample is a flat base.
struct Curvatures {
    int samples = 1;  ///< odd, 1 to 17, so that a flat base is one
    double most = 0;  ///< slab heights over a radius: above 0, at most kMostCurvature; not read for one sample

    /// Returns a sample, above 0 where the base bends away from the slab, in slab heights over a radius.
    [[nodiscard]] double at(int i) const { return samples == 1 ? 0 : most * (2.0 * i / (samples - 1) - 1); }
    bool operator==(const Curvatures&) const = default;
};
inline constexpr int kMostCurvatureSamples = 17;
/// Over a base that bends inwards by more, two curvatures would bend a ray that enters by the top alike; at 1 its
/// normals would meet there.
inline constexpr double kMostCurvature = 0.5;

/// What a table samples. Any thread may call both; points are in the slab.
struct TracedSolid {
    std::function<bool(glm::dvec3 point)> isInside;
    /// Returns how far the first entry into the solid is, from a point outside; nothing where the ray leaves the slab,
    /// or where there is none within `reach`.
    std::function<std::optional<double>(glm::dvec3 point, glm::dvec3 direction, double reach)> distance;
};

struct DistanceTable {
    glm::ivec3 nodes{0};  ///< nodes.z == 1: from the top alone
    DirectionGrid directions;
    Curvatures curvatures;        ///< from the top alone; else one
    glm::dvec3 extent{0};         ///< of the tile
    float unit = 0;               ///< tile units of one step
    std::vector<uint16_t> steps;  ///< row by row
    std::vector<uint32_t> hits;   ///< a bit an entry, low first; each row begins a word

    [[nodiscard]] bool isOfTop() const { return nodes.z == 1; }
    [[nodiscard]] size_t rows() const;
    [[nodiscard]] size_t columns() const;
    [[nodiscard]] size_t row(int x, int y, int phi) const;
    /// `layer`: z, or from the top alone the sample of curvature.
    [[nodiscard]] size_t column(int theta, int phi, int layer) const;
    [[nodiscard]] int layers() const { return isOfTop() ? curvatures.samples : nodes.z; }
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

/// Makes a table without values. Errors: Usage (nodes, directions or curvatures out of range; curvatures of a table
/// that is not of the top alone), Limit (more than `memoryBytes`).
Result<DistanceTable> emptyTable(glm::ivec3 nodes, DirectionGrid directions, Curvatures curvatures, glm::dvec3 extent,
                                 uint64_t memoryBytes);

/// Fills the rows of the grid's columns from `first` to before `last`, of nodes.x * nodes.y. Disjoint ranges may be
/// filled by several threads.
void fillColumns(DistanceTable& table, const TracedSolid& solid, size_t first, size_t last);

}  // namespace vcp::meso
