// The surface of a dataset in few enough triangles to be held and decimated in memory, out of core.
//
// The triangles are streamed in the order of the pages and cut into runs that fit the memory. A run is simplified by
// meshoptimizer: edges collapse by quadric errors, but corners on its border stay, so that runs meet edge by edge.
// Where the borders are too many, neighbouring runs are joined and simplified again, now over the borders between them.
//
// The simplifier does not ask whether the surface stays a manifold. What lies back to back is left out, and
// sheets that touch are parted (mesostructure/base/manifold_part.h), which keeps closed what was; where borders of runs
// are pinched, triangles are left out. It takes a thirtieth of the time of meso::decimated, which does ask, and by
// which the base is made of what is left.
//
// Runs are simplified on all threads. What comes out depends on the memory, and by that on the number of threads.
#pragma once

#include <cstdint>
#include <functional>

#include "builder/measure/indexed_mesh.h"
#include "octree/io/byte_reader.h"
#include "octree/io/result.h"
#include "viewer/export/surface_cut.h"

namespace vcp {

struct CoarseningOptions {
    uint64_t triangles = 2'000'000;  ///< about so many are left
    uint64_t memoryBytes = uint64_t{4} << 30;
    /// Called from one thread with the part that is done; false cancels. May be empty.
    std::function<bool(double)> progress = {};
};

struct CoarsenedScan {
    IndexedMesh mesh;
    uint64_t vertices = 0;  ///< of the scan
    uint64_t leftOut = 0;   ///< triangles on edges of more than two, of the scan or simplified
    double away = 0;        ///< greatest distance of samples of the scan from the mesh, world units
};

/// Coarsens the finest level. `cut`: all of it, and the mesh itself (SurfaceCut::isMesh). Errors: those of
/// streamFacets; Limit, where too much is left, as of many small parts; Cancelled.
Result<CoarsenedScan> coarsenScan(const ByteReader& reader, const SurfaceCut& cut, const CoarseningOptions& options);

}  // namespace vcp
