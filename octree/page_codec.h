// Pages in the file: a form of their bytes from which all that follows from the rest is left out, range coded.
//
//   byte 0     0: plain: a zstd frame of the page follows; 1: coded, as below
//   then       counts; types of the nodes; clearances as differences from what the types allow; runs of soft leaves; the
//              vector of each of their corners once, predicted from its neighbours; the distinct triangles of the
//              hard leaves, growing across their edges; vertices by the parallelogram rule; normals predicted from
//              the triangles. Nodes' numbers, leaves' triangle lists and the like are derived.
//
// Coding loses nothing, but the page that comes back has its groups, faces, triangle records, vertices and the corners
// of a triangle in the codec's own order. A page that is not as the builder makes them is stored plainly.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "octree/page.h"
#include "octree/result.h"

namespace vcp {

/// A page ready for the file, and what it becomes again: with colours, the two orders agree.
struct PackedPage {
    std::vector<std::byte> geometry, colour;
};

/// `colour` may be empty. The same bytes for the same page everywhere. Preconditions: both are a page that
/// parsePage accepts; 16-byte aligned.
PackedPage packPage(std::span<const std::byte> geometry, std::span<const std::byte> colour);

/// The page of `pageBytes` bytes. `packed` may be hostile: a few times pageBytes is allocated at most, and what
/// comes back still has to be checked by parsePage. Errors: InvalidInput.
Result<std::vector<uint4>> unpackGeometry(std::span<const std::byte> packed, uint64_t pageBytes);

/// The colour page of a checked page. Errors: InvalidInput.
Result<std::vector<uint4>> unpackColour(std::span<const std::byte> packed, uint64_t colourBytes, const PageView& page);

}  // namespace vcp
