// Where the triangles of a base surface lie in a square map of texels: in an atlas that is made here, or where texture
// coordinates put them.
//
// The atlas: each triangle is a right-angled half of a square, its longest edge the hypotenuse, with 2^k steps of a
// texel along each edge (k from 1, by its area). Two halves share a block, and around each chart lies a texel
// of its own, so charts neither overlap nor touch. All edges run from texel to texel, so two triangles
// have their common edge in the same steps, or one of them in 2^i times as many: what is written along it can be made
// the same from both sides (conformEdges), and then surfaces have no cracks there.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mesostructure/base_surface.h"
#include "octree/io/result.h"

namespace vcp::meso {

struct TexelMap {
    int size = 0;  ///< texels an edge
    std::vector<std::array<glm::dvec2, 3>>
        places;              ///< of the triangles' corners, in texels; texel (i, j) lies at (i, j)
    std::vector<int> steps;  ///< of an atlas: texel steps along each edge of a triangle; else empty

    [[nodiscard]] bool isAtlas() const { return !steps.empty(); }
    [[nodiscard]] size_t texels() const { return size_t(size) * size_t(size); }
    /// Returns the map in tile units, as a height map has it: texel (i, j) lies at (i, j) / size.
    [[nodiscard]] std::vector<std::array<glm::dvec2, 3>> tileUvs() const;
    /// Returns the place of step s, from 0 to steps[triangle], along the edge from corner k. Precondition: an atlas.
    [[nodiscard]] glm::ivec2 onEdge(size_t triangle, int k, int s) const;
};

/// Returns the area of a triangle in the world.
double areaOf(const BaseSurface& surface, size_t triangle);

inline constexpr int kLeastChartSteps = 2, kMostChartSteps = 1024;

/// Makes an atlas of all triangles. `size`: texels an edge, 8 to kMaxGridEdge. Errors: Limit (the charts do not fit
/// even with kLeastChartSteps).
Result<TexelMap> makeAtlas(const BaseSurface& surface, int size);

/// Takes the surface's own coordinates, from 0 to 1, as other programs do: the middle of the texel at the lower left
/// is (0.5, 0.5) / size. Corners within half a texel of the map's border are moved to its outermost texels, for height
/// maps repeat: beyond lie the texels of the opposite border. Where triangles are large, all corners are moved to the
/// nearest texels: along the edges of the base heights bend as sharply as it does, which they can from texel to texel.
/// Errors: InvalidInput, with the triangle (coordinates that are missing, not finite, outside of
/// 0 to 1, or without an area although the triangle has one).
Result<TexelMap> givenMap(const BaseSurface& surface, int size);

inline constexpr uint32_t kNoTriangle = UINT32_MAX;

/// Returns the triangle that each texel belongs to, row by row: the one that it lies in, else the nearest within
/// `guard` texels, else kNoTriangle; of equals the first. Errors: InvalidInput, where a texel lies inside of two
/// triangles, with their numbers.
Result<std::vector<uint32_t>> ownersOf(const TexelMap& map, double guard);

/// Returns the weights of a triangle's corners at a place of the map; below 0 outside of it.
glm::dvec3 weightsAt(const std::array<glm::dvec2, 3>& corners, glm::dvec2 at);

/// A texel that is this little outside of a triangle lies in it.
inline constexpr double kOnEdge = 1e-9;

/// Returns the chart of each triangle: those that share an edge, and the map along it, are of one chart, which has the
/// number of one of them.
std::vector<uint32_t> chartsOf(const BaseSurface& surface, const TexelMap& map);

}  // namespace vcp::meso
