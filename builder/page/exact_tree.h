// Builds the octree of a page whose leaves hold the mesh's own triangles: the finest level's.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "builder/lattice/lattice_mesh.h"
#include "builder/page/page_builder.h"

namespace vcp {

/// A leaf is split while it has more triangles than this, down to kMaxSubcellDepth halvings of a cell.
inline constexpr size_t kExactLeafTriangles = 16;
/// A larger leaf, in cells, is split while it has more than kWideLeafTriangles: rays skip what is empty.
inline constexpr int kWideLeafCells = 8;
inline constexpr size_t kWideLeafTriangles = 4;
/// No leaf is split where a triangle would be named more often than this: so a page's leaves name at most so many times
/// its triangles, however they lie.
inline constexpr double kMostRepetition = 12;
/// The leaves of a page that was not parted though it holds more triangles than a page should (kMostPageTriangles), in
/// heaps only, name no more than this, or its triangles twice.
inline constexpr uint64_t kManyRecords = 12 << 17;
/// Leaves with more triangles than this, which were left so large for that reason, are split all the same, the fullest
/// first, as long as the whole page keeps to it.
inline constexpr size_t kCrowdedLeafTriangles = 64;

/// How far around a page it needs triangles, in cells: those that only touch it count, and a step of the lattice is
/// room for rounding.
inline constexpr double kExactMarginCells = 1.0 / kLatticePerCell;

/// Builds a page's octree. Each leaf names all triangles that touch its closed box, by tests in integers. `triangles`:
/// numbers in `mesh`, ascending, among them all that touch the page at `page` (Morton position, in pages of 2^log2Cells
/// cells); they must outlive the tree.
/// `mostRecords`: as many records as a page can name; where there would be more, leaves are larger. With more triangles
/// than that there is no such tree.
PageTree buildExactTree(const LatticeMesh& mesh, std::span<const uint32_t> triangles, glm::u32vec3 page,
                        uint32_t log2Cells, size_t mostRecords = kLeafIndexMask);

/// Returns how often a page's leaves may name its triangles, in the mean.
constexpr double mostRepetitionOf(uint64_t triangles) {
    return std::clamp(double(kManyRecords) / double(std::max<uint64_t>(triangles, 1)), 2.0, kMostRepetition);
}

/// Returns the bytes that a page needs while it is built and coded, measured: of triangles, their vertices (those with
/// several normals or places in images count for each) and their records, which are mostRepetitionOf a triangle at
/// most. A tree alone needs less.
constexpr uint64_t exactPageWorkBytes(uint64_t triangles, uint64_t vertices, uint64_t records) {
    return (6 << 20) + 60 * triangles + 150 * vertices + 30 * records;
}

}  // namespace vcp
