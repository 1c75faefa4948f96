// How finely the triangles of a page show images: which of an image's levels a view needs follows from it.
#pragma once

#include <cstdint>
#include <vector>

#include "octree/image/image_need.h"
#include "octree/image/image_tables.h"
#include "octree/page/page.h"

namespace vcp {

/// Returns what a checked page needs, each image once; nothing where it has no points. Materials that there are not
/// count for none.
std::vector<ImageNeed> imageNeeds(const ImageTables& tables, const PageView& page);

/// Returns the finest level that a need asks for where pixels are so wide, cells of the page: no footprint of a pixel
/// there (octree/shared/image_lookup.h) reads a finer one.
uint32_t finestNeeded(float texelsPerCell, double pixelEdge, uint32_t levels);

}  // namespace vcp
