// A mesh stream of what masks leave of another.
#pragma once

#include <memory>

#include "builder/mask/mask_cutter.h"
#include "builder/stream/mesh_stream.h"

namespace vcp {

/// Returns `stream` where none of its materials cuts anything. Else what it has without masks comes first, as it is,
/// and then the parts of the triangles that have one, with vertices of their own. These triangles and all vertices are
/// held in memory until then: this is for meshes that are read into memory anyway. Materials must be known before the
/// first chunk. `memoryBytes`: for masks (MaskCutter). Errors of next(): as those of `stream`, and InvalidInput (a
/// triangle names a vertex that never came).
std::unique_ptr<MeshStream> maskedStream(std::unique_ptr<MeshStream> stream, uint64_t memoryBytes);

}  // namespace vcp
