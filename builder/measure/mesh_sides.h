// Finds on which side of a mesh a point lies: the side of the closest triangle, edge or vertex by its angle-weighted
// pseudonormal (Baerentzen and Aanaes 2005), which is right everywhere about a closed, consistently oriented mesh.
//
// Where the mesh is open, an edge has one triangle and the side is that of its plane: beyond a border the sign flips
// without a surface. Where neighbours are oriented against each other, it flips across their edge. That is what signed
// distances cost, and the benchmark shows it.
#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "builder/measure/mesh_bvh.h"

namespace vcp {

class MeshSides {
public:
    /// Vertices at equal positions count as one. `mesh` must outlive this.
    explicit MeshSides(const IndexedMesh& mesh);

    /// Whether p is behind the surface that `nearest` (of p) is on. Any thread.
    [[nodiscard]] bool isInside(glm::dvec3 p, const NearestPoint& nearest) const;

private:
    [[nodiscard]] glm::dvec3 pseudonormal(const NearestPoint& nearest) const;

    const IndexedMesh* mesh_;
    std::vector<uint32_t> joined_;  ///< for each position: the first one at the same place
    std::vector<glm::dvec3> vertexNormals_;
    std::unordered_map<uint64_t, glm::dvec3> edgeNormals_;
};

}  // namespace vcp
