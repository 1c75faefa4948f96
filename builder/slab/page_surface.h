// What is known of the mesh's surface in the cells of one page: cut from the page's triangles where it holds the mesh,
// and folded from the eight pages below on coarser levels (surface_below.h). No page needs its neighbours.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "builder/lattice/lattice_mesh.h"
#include "builder/slab/cell_surface.h"

namespace vcp {

/// The cells of a page's grid that have surface.
struct SurfaceCells {
    std::vector<uint32_t> codes;  ///< Morton codes within the page, ascending
    std::vector<CellSurface> cells;

    [[nodiscard]] size_t size() const { return codes.size(); }
};

/// The quarters of cells that have surface.
struct SurfaceQuarters {
    std::vector<uint32_t> codes;  ///< Morton codes within the page, ascending
    std::vector<EighthBox> boxes;
    std::vector<glm::vec4> lights;  ///< sums of area * linear RGB, and area; empty where the mesh has no colour

    [[nodiscard]] size_t size() const { return codes.size(); }
};

/// The surface in a page: in its cells, and in the halves, quarters of their edges.
struct PageSurface {
    SurfaceCells cells, halves;
    SurfaceQuarters quarters;
};

/// So many pieces of triangles are in memory at a time, unless they are all in half a cell.
inline constexpr size_t kMostPieces = 1 << 19;

/// Cuts triangles into the halves of the cells of a page, and these into quarters. `triangles`: numbers in `mesh`,
/// among them all that touch the page at `page` (Morton position, in pages of 2^log2Cells cells). The result does not
/// depend on `mostPieces`.
PageSurface surfaceOf(const LatticeMesh& mesh, std::span<const uint32_t> triangles, glm::u32vec3 page,
                      uint32_t log2Cells, size_t mostPieces = kMostPieces);

/// Returns the surface in a page, from what is known of it in the quarters of its cells.
PageSurface foldSurface(const SurfaceCells& quarters, bool withColour);

/// Returns the coarser cells that hold these.
SurfaceCells foldCells(const SurfaceCells& eighths);

/// Returns the bytes that surfaceOf needs for triangles with so large areas and perimeters together, in cells: a piece
/// for each half cell that a triangle touches, and the cells themselves, with their quarters, where the pieces come in
/// parts. `halves`: the most half cells with surface, all of a page of 32^3 cells unless they are counted.
constexpr uint64_t surfaceWorkBytes(uint64_t triangles, double area, double perimeter, uint64_t halves = 1 << 18,
                                    size_t mostPieces = kMostPieces) {
    const double pieces = 7 * area + 3 * perimeter + 2 * double(triangles);
    if (pieces < double(mostPieces)) return uint64_t(240 * pieces);
    return 160 * mostPieces + 320 * halves + 160 * triangles;
}

/// Returns how many half cells of a page the boxes around triangles touch. Precondition: log2Cells < 6.
uint64_t halvesTouched(const LatticeMesh& mesh, std::span<const uint32_t> triangles, glm::u32vec3 page,
                       uint32_t log2Cells);

}  // namespace vcp
