// C0 quadrics (Mehra and Kumar, 3.1 "Quadratic surface" and appendix B): in each occupied cell the surface is a few
// triangles and bilinear patches whose corners lie on the cell's edges. Neighbours share the points on their edges and
// the lines between them on their faces, so the surface is continuous.
//
// The points come from one of two ways. Direct (ours): where the shape's sign differs at the ends of an edge, the
// crossing is found on the edge itself; faces with four points are joined by the bilinear function of their corners
// (asymptotic decider, Nielson and Hamann 1991), the same from both sides. Fitted (the paper's): a quadric is fitted
// to samples of the surface in each cell and half a cell around it, under Taubin's constraint (1991: the mean squared
// gradient is 1; the paper prints none, and then 0 is the best fit); its crossings with the edges are averaged over
// the cells that share the edge, and ordered by their angle.
//
// More than 4 points are cut into bilinear patches and a triangle. A patch is kept as an implicit quadric in the
// cell's own coordinates [0, 1]^3, largest coefficient 1, with the linear forms of its parameters u and v that say
// what part of the unbounded quadric is the patch.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mesostructure/distance_map.h"
#include "mesostructure/march_math.h"

namespace vcp::meso {

using f32::crossPatch, f32::Patch, f32::patchGradient;
static_assert(sizeof(Patch) == 76 && offsetof(Patch, u) == 40 && offsetof(Patch, v) == 56 &&
              offsetof(Patch, isTriangle) == 72);

enum class CrossingRule { Direct, Fitted };

/// The patches of a grid's cells. The cell at index i has patches where bit i % 32 of ranks[i / 32] is set; its row is
/// base + the number of set bits below, and rows[row] = first patch * 16 + number of patches.
struct PatchSet {
    struct Rank {
        uint32_t mask = 0, base = 0;
    };
    static constexpr uint32_t kMostInCell = 15;

    TileGrid grid;
    std::vector<Rank> ranks;
    std::vector<uint32_t> rows;
    std::vector<Patch> patches;
    uint32_t cellsWithout = 0;  ///< occupied cells without a patch: sheets thinner than a cell, or grazed cells

    [[nodiscard]] std::span<const Patch> of(size_t cell) const;
    [[nodiscard]] uint64_t bytes() const {
        return ranks.size() * sizeof(Rank) + rows.size() * 4 + patches.size() * sizeof(Patch);
    }
};

/// Builds the patches. Errors: Limit (2^28 patches).
Result<PatchSet> buildPatches(const Shape& shape, const Occupancy& occupancy, CrossingRule rule);

/// Appends the patches through a loop of 3 to 12 points in a cell's coordinates; none where they have no area.
void appendPatches(std::span<const glm::dvec3> loop, std::vector<Patch>& patches);

/// Returns the quadric A..J of least Taubin distance to points, or a plane where they lie in one. At least 3 points.
std::array<double, 10> fitQuadric(std::span<const glm::dvec3> points);

}  // namespace vcp::meso
