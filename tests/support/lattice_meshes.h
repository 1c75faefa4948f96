// Meshes on the lattice, from the meshes of test_meshes.h, and back.
#pragma once

#include <cmath>
#include <map>

#include "builder/lattice/lattice_mesh.h"
#include "builder/lattice_soup.h"
#include "builder/measure/indexed_mesh.h"
#include "octree/surface/leaf_math.h"

namespace vcp::test {

/// The triangles of `mesh` (in cells) on the lattice, snapped and cut as the builder does it. `colours`: of the
/// vertices, or none.
inline std::vector<LatticeTriangle> soupOf(const IndexedMesh& mesh, const std::vector<uint32_t>& colours = {}) {
    const LatticeSnapper snapper({.origin = glm::dvec3(0), .cell = 1});
    std::vector<LatticeTriangle> soup;
    for (size_t k = 0; k < mesh.triangles.size(); ++k) {
        WorldTriangle<double> t{};
        for (int i = 0; i < 3; ++i) {
            t.corner[i] = mesh.positions[mesh.triangles[k][i]];
            t.colour[i] = colours.empty() ? 0xffffffffu : colours[mesh.triangles[k][i]];
        }
        snapper.add(t, [&](const LatticeTriangle& piece) {
            if (hasArea(piece.corner[0], piece.corner[1], piece.corner[2])) soup.push_back(piece);
        });
    }
    return soup;
}

/// A mesh as the soup it is the mesh of.
inline std::vector<LatticeTriangle> soupOf(const LatticeMesh& mesh) {
    std::vector<LatticeTriangle> soup(mesh.triangles.size());
    for (size_t k = 0; k < soup.size(); ++k) {
        soup[k].stray = mesh.stray[k];
        for (int i = 0; i < 3; ++i) {
            const uint32_t v = mesh.triangles[k][i];
            soup[k].corner[i] = mesh.positions[v];
            soup[k].colour[i] = mesh.colours.empty() ? 0xffffffffu : mesh.colours[v];
            soup[k].normal[i] = mesh.normals[v];
        }
    }
    return soup;
}

/// `mesh` in cells, on the lattice, with normals.
inline LatticeMesh onLattice(const IndexedMesh& mesh) {
    LatticeMesh out = meshOf(soupOf(mesh), false);
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
