// What the triangles of a page show of images, and how finely: which tiles of an image a view needs follows from it.
#pragma once

#include <cstdint>
#include <vector>

#include "octree/image/image_need.h"
#include "octree/image/image_pieces.h"
#include "octree/page/page.h"

namespace vcp {

/// Returns what a checked page needs; nothing where it has no points. Of a large image there are several needs: of
/// triangles that are near each other and show it about as finely. Materials that there are not count for none.
std::vector<ImageNeed> imageNeeds(const ImageTables& tables, const PageView& page);

/// Returns the level, with its fraction, that a need asks for where pixels are so wide, cells of the page: no footprint
/// of a pixel there (octree/shared/image_lookup.h) reads a finer one than its whole part, nor where it is below 0, one
/// than the finest.
double levelNeeded(float texelsPerCell, double pixelEdge, uint32_t levels);

/// Returns into how many blocks an image is divided along both axes: along the longer one they are kFirstEdge texels or
/// more.
uint32_t blocksAcross(const ImageRow& image);

/// Returns the pieces of a level that pixels read where the level is the finest that the need asks for, or the next
/// one: each once, ascending.
std::vector<uint32_t> piecesNeeded(const ImagePieces& pieces, const ImageNeed& need, uint32_t level);

}  // namespace vcp
