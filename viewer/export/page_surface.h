// What one page has of the surface, as triangles.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "octree/io/byte_reader.h"
#include "octree/io/result.h"
#include "octree/page/strips.h"
#include "viewer/export/leaf_polygons.h"
#include "viewer/export/surface_cut.h"

namespace vcp {

inline constexpr uint64_t kNoPage = UINT64_MAX;

/// The whole triangles are those of the mesh, or of its level, all of whose corners have a home: a page has each that
/// touches it. What else the page holds, it holds alone: polygons of leaves, and triangles cut off at its walls. Box
/// and plane of the cut are those of `wants`: triangles outside are left out.
struct ExportedPage {
    uint64_t page = 0;
    std::vector<LatticePoint> points;
    std::vector<uint32_t> colours;  ///< RGBA8, of the points; empty without colour
    std::vector<uint64_t> homes;    ///< the page that each point belongs to, or kNoPage
    std::vector<Index3> whole;      ///< numbers of points
    PolygonMesh loose;              ///< world units
    double error = 0;               ///< bound on the distance to the mesh, both ways, world units

    /// Whether this page is the one that exports a whole triangle: the first of its corners' homes.
    [[nodiscard]] bool owns(const Index3& triangle) const {
        return std::min({homes[triangle[0]], homes[triangle[1]], homes[triangle[2]]}) == page;
    }
};

/// Reads and checks a page of the cut, and makes its triangles. Memory: some 200 bytes a triangle. Any thread. Errors:
/// those of readPage.
Result<ExportedPage> readPageSurface(const ByteReader& reader, const SurfaceCut& cut, uint64_t page, bool withColour);

}  // namespace vcp
