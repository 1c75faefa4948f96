// What is known of the mesh's surface in the cells of one page: cut from the page's triangles on the finest level, and
// folded from the eight pages below on coarser ones. No page needs its neighbours.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "builder/lattice/lattice_mesh.h"
#include "builder/slab/cell_surface.h"
#include "octree/vcp_writer.h"

namespace vcp {

/// The cells of a page's grid that have surface.
struct SurfaceCells {
    std::vector<uint32_t> codes;  ///< Morton codes within the page, ascending
    std::vector<CellSurface> cells;

    [[nodiscard]] size_t size() const { return codes.size(); }
};

/// The surface in a page: in its cells, and in the halves, quarters of their edges.
struct PageSurface {
    SurfaceCells cells, halves, quarters = {};
};

/// So many pieces of triangles are in memory at a time, unless they are all in half a cell.
inline constexpr size_t kMostPieces = 1 << 19;

/// Cuts triangles into the cells of a page and their halves; quarters stay empty. `triangles`: numbers in `mesh`, among
/// them all that touch the page at `page` (Morton position, in pages of 2^log2Cells cells). The result does not depend
/// on `mostPieces`.
PageSurface surfaceOf(const LatticeMesh& mesh, std::span<const uint32_t> triangles, glm::u32vec3 page,
                      uint32_t log2Cells, size_t mostPieces = kMostPieces);

/// Puts together the page above up to eight pages. `octants`: where each of them is, ascending.
PageSurface foldPages(std::span<const PageSurface> pages, std::span<const uint32_t> octants, uint32_t log2Cells);

/// Returns the coarser cells that hold these.
SurfaceCells foldCells(const SurfaceCells& eighths);

/// Returns cells as bytes, and the cells in such bytes.
std::vector<std::byte> bytesOf(const SurfaceCells& cells);
SurfaceCells surfaceCellsFrom(std::span<const std::byte> bytes);

/// Returns a page's surface as it is stored on temporary files, cells as `geometry` and halves as `colour`, and the
/// surface in what was stored; quarters are left out.
StoredPage storedSurface(const PageSurface& surface);
PageSurface surfaceFrom(const StoredPage& stored);

/// Returns the bytes that surfaceOf needs for triangles with so large areas and perimeters together, in cells: a piece
/// for each half cell that a triangle touches, and the cells themselves where the pieces come in parts.
constexpr uint64_t surfaceWorkBytes(uint64_t triangles, double area, double perimeter) {
    const double pieces = 7 * area + 3 * perimeter + 2 * double(triangles);
    if (pieces < double(kMostPieces)) return uint64_t(160 * pieces);
    return 160 * kMostPieces + (64 << 20) + 160 * triangles;
}

}  // namespace vcp
