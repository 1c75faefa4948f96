// Triangles parted until their edges are short, so that what is known at vertices alone (distances, colours) is known
// everywhere: a wall of two triangles has four vertices.
#pragma once

#include <cstdint>

#include "builder/measure/indexed_mesh.h"

namespace vcp {

/// Parts each edge that is longer than `longest` at its middle, in all triangles that have it, and again until none is.
/// Vertices that were there keep their numbers. Stops before there would be more than `most` triangles; edges may then
/// be longer. Texture coordinates are left out.
void shortenEdges(IndexedMesh& mesh, double longest, uint64_t most);

}  // namespace vcp
