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
//
// Gradients jump from patch to patch. So each point on an edge has a normal, which its patches share and blend by u and
// v. Direct: the shape's. Fitted: the mean of the gradients of the quadrics that the point is the mean of. Where a
// patch turns away from that by more than 30 degrees there is a sharp edge, and its corner keeps its own gradient.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mesostructure/distance_map.h"
#include "mesostructure/march_math.h"

namespace vcp::meso {

using f32::blendNormals, f32::crossPatch, f32::Patch, f32::patchGradient;
static_assert(sizeof(Patch) == 76 && offsetof(Patch, u) == 40 && offsetof(Patch, v) == 56 &&
              offsetof(Patch, isTriangle) == 72);

enum class CrossingRule { Direct, Fitted };

/// Unit normals in tile space at a patch's (u, v) = (0, 0), (1, 0), (1, 1) and (0, 1), on the side of its gradient: in
/// octahedral coordinates, x in the low 16 bits and y in the high ones. The third of a triangle is 0.
using PatchNormals = std::array<uint32_t, 4>;

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
    std::vector<PatchNormals> normals;  ///< of each patch; empty in assets of before: its gradient is the normal
    uint32_t cellsWithout = 0;          ///< occupied cells without a patch: sheets thinner than a cell, or grazed cells

    [[nodiscard]] std::span<const Patch> of(size_t cell) const;
    [[nodiscard]] uint64_t bytes() const {
        return ranks.size() * sizeof(Rank) + rows.size() * 4 + patches.size() * sizeof(Patch) +
               normals.size() * sizeof(PatchNormals);
    }
};

/// Builds the patches. Errors: Limit (2^28 patches).
Result<PatchSet> buildPatches(const Shape& shape, const Occupancy& occupancy, CrossingRule rule);

/// The points of a loop at a patch's corners, in the order of PatchNormals; a triangle has no third one: -1.
using PatchCorners = std::array<int, 4>;

/// Appends the patches through a loop of 3 to 12 points in a cell's coordinates, and their corners; none where they
/// have no area.
void appendPatches(std::span<const glm::dvec3> loop, std::vector<Patch>& patches, std::vector<PatchCorners>& corners);

/// Packs a direction as PatchNormals does; (0, 0, 1) where it has no length.
uint32_t packNormal(glm::dvec3 direction);

/// Returns the quadric A..J of least Taubin distance to points, or a plane where they lie in one. At least 3 points.
std::array<double, 10> fitQuadric(std::span<const glm::dvec3> points);

}  // namespace vcp::meso
