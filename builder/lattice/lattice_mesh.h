// A mesh on a level's lattice: integer positions, so that predicates are exact, shared vertices stay shared
// and an origin far away costs nothing. One cell has kLatticePerCell steps; positions count from the lowest
// corner of the dataset's root page.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "builder/lattice/soup.h"
#include "octree/page/page.h"
#include "octree/vcp_file.h"

namespace vcp {

struct LatticeMesh {
    std::vector<glm::i32vec3> positions;             ///< distinct
    std::vector<uint32_t> colours;                   ///< RGBA8, as many as positions, or empty
    std::vector<uint32_t> normals;                   ///< packNormal with crease flag, as many as positions
    std::vector<std::array<uint32_t, 3>> triangles;  ///< none without area, none twice
    std::vector<float> stray;     ///< cells, one a triangle: how far its points may be from the mesh's, both ways
    std::vector<uint32_t> parts;  ///< that vertices belong to, as many as positions; empty: kClosedPart
    /// Where triangles are in images, one a triangle, corner by corner (addTextures); empty where there are none.
    std::vector<std::array<TexturePoint, 3>> textures;
    /// The mesh's own normals (packDirection), one a triangle, corner by corner, where they count in place of those of
    /// the vertices; kUnknownNormal where they do not, empty where none do.
    std::vector<std::array<uint32_t, 3>> cornerNormals;

    /// Returns the normal of a triangle's corner.
    [[nodiscard]] uint32_t normalOf(size_t triangle, size_t corner) const {
        const uint32_t own = cornerNormals.empty() ? kUnknownNormal : cornerNormals[triangle][corner];
        return own != kUnknownNormal ? own : normals[triangles[triangle][corner]];
    }

    /// Returns whether a triangle is of a closed part or of an open one, as PageEntry::parts says it.
    [[nodiscard]] uint8_t kindOf(uint32_t triangle) const {
        const bool isOpen = !parts.empty() && parts[triangles[triangle][0]] == kOpenPart;
        return isOpen ? kPageHasOpen : kPageHasClosed;
    }
};

/// Rounding a point to the lattice moves it at most so far, in cells.
inline constexpr double kLatticeRounding = 0.8660254037844387 / 2048;

/// Longest triangle edge a page can hold, in cells; longer edges are halved first.
inline constexpr int kMaxEdgeCells = 256;

/// Whether three lattice points span an area; exact.
bool hasArea(glm::i32vec3 a, glm::i32vec3 b, glm::i32vec3 c);

/// Makes the mesh of a bag of triangles, the same for any order of them: vertices by cell along the Morton curve,
/// triangles by their vertices; of repeated triangles one stays, with the largest stray and the least own normals.
/// Colours that differ at a vertex are averaged, triangle by triangle. Uses the calling arena's threads.
LatticeMesh meshOf(std::span<const LatticeTriangle> soup, bool withColour);

/// Brings a mesh to the lattice that is half as fine. Vertices that do not lie on it are rounded down; what is made of
/// them is void.
void halveLattice(LatticeMesh& mesh);

/// Returns the number of the vertex at `p` in a mesh from meshOf, or none.
std::optional<uint32_t> findVertex(const LatticeMesh& mesh, glm::i32vec3 p);

/// Computes vertex normals (octree/surface/vertex_normal.h): the mean of the incident triangles' normals by area, taken
/// without orientation (a mesh need not have one); the page codec predicts them from a page's triangles. A vertex
/// around which triangles with a sixteenth of the area turn away by more than 40 degrees is marked as a crease: its
/// normal is not to be interpolated. Uses the calling arena's threads.
void computeNormals(LatticeMesh& mesh);

/// Own normals that are within so many degrees of the computed ones count as these, and cost nothing in the file.
inline constexpr double kSettledDegrees = 2;

/// Drops the mesh's own normals at corners where they are near the vertex' computed normal or, at a crease, near the
/// triangle's. Uses the calling arena's threads.
void settleNormals(LatticeMesh& mesh);

}  // namespace vcp
