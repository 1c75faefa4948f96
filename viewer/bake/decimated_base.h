// A base of few triangles for a scan, with more of them where the scan would be no height field over it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "builder/measure/indexed_mesh.h"
#include "mesostructure/base_surface.h"
#include "octree/dataset_reader.h"
#include "octree/io/byte_reader.h"
#include "octree/io/result.h"

namespace vcp {

struct DecimatedBaseOptions {
    size_t triangles = 10'000;
    int texels = 1024;    ///< an edge of the maps
    double reach = 0;     ///< as BakeOptions
    double scanAway = 0;  ///< how far the mesh that is decimated is from the scan, world units
    uint64_t memoryBytes = uint64_t{4} << 30;
    std::function<bool(double)> progress = {};  ///< takes the part done; false cancels
};

struct DecimatedBase {
    meso::BaseSurface surface;
    /// Triangles without which it is made, of the scan or its own: a third one on an edge, or at a corner whose normals
    /// cancel.
    uint64_t leftOut = 0;
    double reach = 0;
    uint64_t scanVertices = 0;
    double unlike = 0;         ///< part of its area over which small maps find no height field
    double unlikeAtFirst = 0;  ///< that of the base of the first round
};

/// Decimates a scan, looks by small maps where it is no height field over the base, and decimates it anew with what
/// lies there counting more, up to three times and as long as that helps. The base has as many triangles in each round.
/// `dataset`: as bakeMaps; `scan`: its finest level, or that coarsened. Errors: those of decimated, makeAtlas and
/// bakeMaps; InvalidInput (nothing is left of it).
Result<DecimatedBase> decimateToFollow(const std::shared_ptr<const ByteReader>& reader, const Dataset& dataset,
                                       const IndexedMesh& scan, const DecimatedBaseOptions& options);

}  // namespace vcp
