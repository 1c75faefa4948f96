// How the pieces and levels of a remeshed surface are stored for devices: as texels of four words
// (mesostructure/remesh/remesh_pieces.h writes them, render/shaders/remesh_piece.glsl reads them).
//
// quad      of a piece
//  0 to  2  corners: position, 1 / depth
//  3 to  5  corners: direction, texels a world unit
//  6 to  8  corners: cell of the grid, height
//  9, 10    coordinates of corners 0, 1, 2; bit k: edge k has a seam, and from bit 3 on the base triangle's number;
//           parts of edges 0, 1, 2, 10 bits each, low first, 0: an edge has as many as cells
// 11 to 13  seams: coordinates of the edge's other side, at its start and its end
// 14        levels of the map's heights: along edges 0, 1, 2, and within
CONSTANT uint kRemeshPieceQuads = 15u;

// Levels are in tiles (mesostructure/remesh/height_tiles.h). Of each level a quad: the number of the word in which its
// first tile's entry is, its width and height, its texels in a tile unit along y. Then the entries, a word a tile, row
// by row, level after level: the quad at which its heights begin, and above kRemeshQuadBits the level itself; where the
// tile is not there, a coarser level, which is there wherever the tile would be, and a texel about it. Then the heights
// of tiles in any order, eight of 16 bits a quad, the first in a word's low half. A tile has one more row and column
// than it is wide, which are its neighbours' first.
CONSTANT int kRemeshTileShift = 7;
CONSTANT int kRemeshTileEdge = 128;
CONSTANT uint kRemeshTileQuads = 2081u;
CONSTANT uint kRemeshQuadBits = 27u;

// Of base triangles (RemeshFrame), after a quad of which the first number is that of the levels:
//
// quad      of a triangle
//  0, 1     derivatives by u and by v of places; the coordinates u and v of the first corner
//  2, 3     of directions; 2: turned
//  4, 5     direction of the first corner; the triangle's own normal
//  6        place of the first corner
//  3 to 6   behind these, a number each: where the other two corners are from the first, over the map
CONSTANT uint kRemeshFrameQuads = 7u;
