// What a page hands up, from which the page above it is made: the surface in its cells' halves, which are quarters of
// the cells above, and the slab leaves that the page above has in its place, one for each of its own cells.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "builder/slab/page_surface.h"
#include "octree/vcp_writer.h"

namespace vcp {

/// A slab leaf of the page above, before it is part of that page's octree: a cell of the page below, or a half of one.
struct CellSlab {
    uint32_t at = 0;                ///< Morton code among the halves of the page's cells; that of a cell's lowest half
    uint32_t code = 0;              ///< packed slab (octree/shared/page_layout.h)
    uint32_t colour = 0xffffffffu;  ///< RGBA8
    float error = 0;                ///< in its edges
    float colourError = 0;          ///< as ΔE (octree/vcp_file.h)
    float area = 0;                 ///< of its surface, in squares of a half's edge, where its colour error counts
    uint8_t octants = 0;            ///< those that hold surface
    uint8_t parts = 0;              ///< kinds of parts that its surface belongs to, as PageEntry's
    uint16_t isHalf = 0;            ///< 1: a half of a cell
};
static_assert(sizeof(CellSlab) == 28);

struct SurfaceBelow {
    SurfaceCells halves;
    std::vector<CellSlab> slabs;  ///< in Morton order
};

/// Puts together what up to eight pages hand up, one after the other. The page above has cells of twice the edge.
class PageFold {
public:
    /// The pages have so many halves of cells and slabs together.
    PageFold(uint32_t log2Cells, size_t halves, size_t slabs);

    /// Adds a page. `octant`: where it is; octants ascend.
    void add(const SurfaceBelow& below, uint32_t octant);

    SurfaceCells quarters;        ///< of the cells of the page above
    std::vector<CellSlab> slabs;  ///< `at` counts in these quarters

private:
    uint32_t log2Cells_;
};

/// Returns what temporary files keep: cells as `geometry`, without axes, which follow from the moments, slabs as
/// `colour`; coded where `isCoded`. Precondition: axes as chooseAxis has them.
StoredPage storedSurface(const SurfaceBelow& surface, bool isCoded);
/// Returns what was stored; none where it is not what was stored.
std::optional<SurfaceBelow> surfaceFrom(const StoredPage& stored);
/// Returns how many halves of cells, and slabs, are in what was stored in so many bytes, before these were coded.
size_t storedCells(uint64_t geometryBytes);
inline size_t storedSlabs(uint64_t colourBytes) { return colourBytes / sizeof(CellSlab); }

}  // namespace vcp
