// What is known of the mesh's surface in one cell of any level. From it come the cell's slab
// (octree/shared/page_layout.h) and, from eight of them, what is known in the cell of the next coarser level.
//
// Bounds are bounds: whatever is folded, all of the mesh's surface in the cell is within them. The rest are sums over
// the surface's area, so that coarser cells hold means of the mesh itself.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <glm/common.hpp>
#include <glm/gtc/type_precision.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

namespace vcp {

/// Coordinates count from the cell's centre, in its edges: from -1/2 to 1/2.
struct CellSurface {
    glm::vec3 lower{0}, upper{0};   ///< corners of a box that holds the surface
    glm::vec3 axis{0};              ///< unit: the direction nearest to the surface's normals, either way
    float first = 0, last = 0;      ///< the surface is between these along the axis
    float area = 0;                 ///< in squares of the edge
    std::array<float, 6> moment{};  ///< sums of area n n^T over the surface's normals n: xx, yy, zz, yz, zx, xy
    glm::vec4 light{0};             ///< sum of area * (linear RGB, alpha)
    uint32_t parts = 0;             ///< kinds of parts that it belongs to, as PageEntry's
};

/// A box that holds the surface in an eighth of a cell, in 1/255 of the eighth's edge from its lowest corner.
struct EighthBox {
    glm::u8vec3 lower{255}, upper{0};

    EighthBox() = default;
    /// Rounds a box outwards; coordinates as in CellSurface.
    EighthBox(glm::vec3 least, glm::vec3 most)
        : lower(glm::clamp(glm::floor((least + 0.5f) * 255.0f), 0.0f, 255.0f)),
          upper(glm::clamp(glm::ceil((most + 0.5f) * 255.0f), 0.0f, 255.0f)) {}
};

/// The values between which something lies.
struct Extent {
    double first, last;
};

/// Returns bounds of dot(n, x) over the surface, from the box and the slab along the axis together.
Extent extentAlong(const CellSurface& cell, glm::dvec3 n);

/// Returns the centre of an octant x + 2y + 4z of a cell, from the cell's centre, in its edges.
inline glm::dvec3 octantCentre(uint32_t octant) {
    return glm::dvec3(octant & 1u, octant >> 1 & 1u, octant >> 2 & 1u) / 2.0 - 0.25;
}

/// Returns bounds of dot(n, x) over the surface of the eighths of a cell. `octants`: where each one is.
Extent extentAlong(std::span<const CellSurface> eighths, std::span<const uint32_t> octants, glm::dvec3 n);

/// Returns what is known in the cell of which these are the eighths that have surface. `octants`: where each one is.
CellSurface foldEighths(std::span<const CellSurface> eighths, std::span<const uint32_t> octants);

/// Sets `axis` from the moment; where the surface has no area, to z.
void chooseAxis(CellSurface& cell);

/// Returns how far the normals are from the axis: the mean of their squared sines, 0 to 2/3.
double normalSpread(const CellSurface& cell);

/// Returns the sum of area * linear RGB, and the area.
inline glm::vec4 litArea(const CellSurface& cell) { return {cell.light.x, cell.light.y, cell.light.z, cell.area}; }

/// Returns the mean light as a stored colour; white where the surface has no area.
uint32_t meanColour(const CellSurface& cell);

}  // namespace vcp
