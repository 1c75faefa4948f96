// A mesh on a level's lattice: integer positions, so that predicates are exact, shared vertices stay shared
// and an origin far away costs nothing. One cell has kLatticePerCell steps; positions count from the lowest
// corner of the dataset's root page.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

namespace vcp {

struct LatticeMesh {
    std::vector<glm::i32vec3> positions;  ///< distinct
    std::vector<uint32_t> colours;        ///< RGBA8, as many as positions, or empty
    std::vector<uint32_t> normals;        ///< packNormal with crease flag, as many as positions
    std::vector<float> stray;             ///< cells: how far a vertex may be from where the mesh had it
    std::vector<std::array<uint32_t, 3>> triangles;  ///< none without area, none twice
};

/// Rounding a point to the lattice moves it at most so far, in cells.
inline constexpr double kLatticeRounding = 0.8660254037844387 / 2048;

/// Longest triangle edge a page can hold, in cells; longer edges are halved first.
inline constexpr int kMaxEdgeCells = 256;

/// Merges vertices at equal positions (the first one's colour stays, the larger stray), drops triangles that
/// lost their area and repeated triangles. Order of what remains: first appearance.
void weld(LatticeMesh& mesh);

/// Halves every edge longer than kMaxEdgeCells until none is left. An edge is cut at the same lattice point in
/// every triangle that has it, so no crack opens; the rounding of that point is added to its stray.
void splitLongEdges(LatticeMesh& mesh);

/// Vertex normals (octree/vertex_normal.h): the mean of the incident triangles' normals by area, taken without
/// orientation (a mesh need not have one); the page codec foretells them from a page's triangles. A vertex where a triangle turns away by more than 40 degrees is
/// marked as crease: its normal is not to be interpolated.
void computeNormals(LatticeMesh& mesh);

}  // namespace vcp
