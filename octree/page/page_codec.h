// How pages are stored in the file: all that follows from the rest is left out, and what remains is range coded.
//
//   byte 0     0: plain: a zstd frame of the page follows; 1: coded, two streams (range_coder.h) follow; 2: as 1, with
//              open marks: of each slab leaf, and of each run of triangles that grows from a first one
//   nodes      types, breadth first; wall and dip codes; clearances as differences from what the types allow
//   faces      runs of soft leaves; the vector of each of their corners once, foretold by its neighbours
//   slabs      the vector of each slab leaf, foretold by the planes beside it; its octants, foretold by its plane
//   mesh       the distinct triangles of the hard leaves, growing across their edges; vertices by the parallelogram
//              rule; normals as differences from those of the triangles
//   colour     coded on its own: the colour of each corner, slab and vertex once, foretold by its neighbours. Byte 0
//              is 3 where the vertices have texture coordinates and materials, too, which follow (point_codec.h)
//
// The numbers of children, faces and slabs and the leaves' lists and strips of triangles are derived.
//
// Coding loses nothing, but the page that comes back has its groups, faces, vertices, triangles and the corners of a
// triangle in the codec's own order, and so as many entries of strips as that order asks for. A page that is not as the
// builder makes them is stored plainly.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "octree/io/result.h"
#include "octree/page/page_draft.h"

namespace vcp {

/// A page as it is stored.
struct PackedPage {
    std::vector<std::byte> geometry, colour;
    uint64_t geometryBytes = 0;  ///< bytes of the page that comes back
};

/// Packs `geometry`, a page, and `colour`, its colour page or nothing; both 16-byte aligned. The same page gives the
/// same bytes everywhere. What was coded is not decoded to see whether it comes back: encoder and decoder are the same
/// templates, and tests and a fuzz target prove them. Any thread.
PackedPage packPage(std::span<const std::byte> geometry, std::span<const std::byte> colour);

/// Packs a page that has no strips yet. Errors: InvalidInput (there is no such page).
Result<PackedPage> packPage(const PageDraft& draft, std::span<const std::byte> colour);

/// Returns the page, `pageBytes` long. `packed` may be hostile: nothing is allocated before its counts match pageBytes,
/// then at most a few times that much, and the result still has to be checked by parsePage. Errors: InvalidInput.
Result<std::vector<uint4>> unpackGeometry(std::span<const std::byte> packed, uint64_t pageBytes);

/// Returns the colour page of a checked page; as safe on hostile bytes. Errors: InvalidInput.
Result<std::vector<uint4>> unpackColour(std::span<const std::byte> packed, uint64_t colourBytes, const PageView& page);

}  // namespace vcp
