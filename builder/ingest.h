// Ingest: mesh files -> one mesh on the finest level's lattice, and the frame that places it in the world.
#pragma once

#include <functional>
#include <vector>

#include <glm/vec3.hpp>

#include "builder/build.h"
#include "builder/lattice_mesh.h"
#include "octree/result.h"

namespace vcp {

/// Where the lattice lies in the world, and how many levels there are.
struct GridFrame {
    glm::dvec3 origin{0};  ///< lowest corner of the root page
    double cell = 0;       ///< finest cell edge, world units
    uint32_t levels = 1;
    uint32_t log2Cells = 5;  ///< cells an edge of a page
};

struct IngestedMesh {
    LatticeMesh mesh;
    GridFrame frame;
    glm::dvec3 boundsMin{0}, boundsMax{0};
    uint64_t triangles = 0;            ///< read
    uint64_t degenerateTriangles = 0;  ///< of them, without area in the file's own coordinates
    uint64_t vertices = 0;             ///< read
};

/// Reads all inputs (in memory). `cell` 0 chooses a cell from area and number of triangles.
/// `progress` is given the fraction read; false cancels.
Result<IngestedMesh> ingest(const BuildOptions& options, const std::function<bool(double fraction, uint64_t triangles)>& progress);

}  // namespace vcp
