// Meshes on the lattice, from the meshes of test_meshes.h, and back.
#pragma once

#include <cmath>
#include <map>

#include "builder/indexed_mesh.h"
#include "builder/lattice_mesh.h"
#include "octree/leaf_math.h"

namespace vcp::test {

/// `mesh` in cells, on the lattice; welded, with normals.
inline LatticeMesh onLattice(const IndexedMesh& mesh) {
    LatticeMesh out;
    for (const glm::dvec3& p : mesh.positions) {
        const glm::dvec3 q = p * double(kLatticePerCell);
        out.positions.emplace_back(std::lround(q.x), std::lround(q.y), std::lround(q.z));
    }
    out.triangles = mesh.triangles;
    out.stray.assign(out.positions.size(), static_cast<float>(kLatticeRounding));
    weld(out);
    computeNormals(out);
    return out;
}

/// The other way: in cells, times `scale`.
inline IndexedMesh inCells(const LatticeMesh& mesh, double scale = 1) {
    IndexedMesh out;
    for (const glm::i32vec3& p : mesh.positions) out.positions.push_back(glm::dvec3(p) * (scale / kLatticePerCell));
    out.triangles = mesh.triangles;
    return out;
}

inline double areaOf(const IndexedMesh& mesh) {
    double area = 0;
    for (size_t k = 0; k < mesh.triangles.size(); ++k) {
        const auto t = mesh.corners(k);
        area += glm::length(glm::cross(t[1] - t[0], t[2] - t[0])) / 2;
    }
    return area;
}

/// How many edges are used how often.
inline std::map<int, int> edgeUses(const std::vector<std::array<uint32_t, 3>>& triangles) {
    std::map<std::pair<uint32_t, uint32_t>, int> uses;
    for (const auto& t : triangles)
        for (int i = 0; i < 3; ++i) ++uses[std::minmax(t[i], t[(i + 1) % 3])];
    std::map<int, int> counts;
    for (const auto& [edge, count] : uses) ++counts[count];
    return counts;
}

}  // namespace vcp::test
