// Binning: finds which triangles each subvolume of a level needs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "builder/lattice/finest_pages.h"
#include "builder/lattice/lattice_mesh.h"

namespace vcp {

/// How far around a page, in cells, it needs triangles for closest points: its corners' closest points lie within
/// sqrt(3) cells, and are searched in whole cells around them.
inline constexpr double kBinMarginCells = 2.25;

/// The triangles of each page: pages in Morton order, triangles in the mesh's order.
struct TriangleBins {
    std::vector<uint64_t> pages;  ///< Morton codes
    std::vector<uint64_t> begin;  ///< pages.size() + 1 offsets into `triangles`
    std::vector<uint32_t> triangles;

    [[nodiscard]] std::span<const uint32_t> of(size_t page) const {
        return std::span(triangles).subspan(begin[page], begin[page + 1] - begin[page]);
    }
};

/// The triangles of the pages of one level.
struct LevelBins {
    uint32_t level;
    TriangleBins bins;
};

/// Bins each triangle to every page that holds the mesh, widened by `margin` cells, that it overlaps, of those whose
/// first code of the deepest level is from `first` to before `end`. Returns the levels that have any, deepest first.
/// Uses the calling arena's threads.
std::vector<LevelBins> binTriangles(const LatticeMesh& mesh, const FinestPages& pages, double margin, uint64_t first,
                                    uint64_t end);

/// Bins each triangle to every page from code `first` to before `end` whose cube, widened by `margin` cells, it
/// overlaps.
/// Uses the calling arena's threads.
TriangleBins binTriangles(const LatticeMesh& mesh, const PageGrid& grid, double margin = kBinMarginCells,
                          uint64_t first = 0, uint64_t end = ~uint64_t{0});

}  // namespace vcp
