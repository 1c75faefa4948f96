// Cuts triangles along the walls of a page's cells and sums up what lies in each cell.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "builder/lattice/lattice_mesh.h"
#include "builder/lattice/triangle_geometry.h"
#include "builder/slab/page_surface.h"

namespace vcp {

/// A box of the octree over a cutter's cells.
struct CutterBox {
    glm::ivec3 lower;
    int log2Edge;

    [[nodiscard]] CutterBox child(int octant) const {
        return {lower + (1 << (log2Edge - 1)) * glm::ivec3(octant & 1, octant >> 1 & 1, octant >> 2), log2Edge - 1};
    }
};

class TriangleCutter {
public:
    /// `origin`: the page's lowest corner on the lattice; the page has 2^depth of the cutter's cells an edge, of which
    /// two are as long as one cell of the mesh's level. `within`: the box of the page that pieces are kept of.
    TriangleCutter(const LatticeMesh& mesh, glm::i32vec3 origin, int depth, CutterBox within)
        : mesh_(mesh), origin_(origin), depth_(depth), within_(within) {}

    /// Cuts a triangle of the mesh; what lies outside of the box is left out. A piece in a wall belongs to both sides.
    void cut(uint32_t triangle);
    [[nodiscard]] size_t pieces() const { return pieces_.size(); }
    /// Appends what is known of the box's cells, in Morton order. To be called once, after all cuts.
    void appendTo(SurfaceCells& cells) const;

private:
    /// The triangle that is being cut, in the cutter's cells from the page's lowest corner, and what is blended over
    /// it.
    struct Source {
        Triangle3 corners;
        glm::dvec3 secondGrows{0}, thirdGrows{0};  ///< gradients of these corners' weights
        std::array<glm::dvec3, 3> normal;
        std::array<glm::dvec4, 3> colour;
        /// Returns the weights of the corners at a point of the triangle.
        [[nodiscard]] glm::dvec3 weightsAt(glm::dvec3 p) const;
    };
    /// A box, and the halves of it along each axis that a piece is in: 1, 2 or both.
    struct OctreeBox : CutterBox {
        std::array<uint32_t, 3> halves;
    };
    /// A piece that lies in one cell.
    struct CellPiece {
        uint32_t code, first, count;  ///< the cell; the corners
        float area;
        glm::vec3 normal;  ///< unit
        glm::vec4 colour;
    };
    /// Whether a triangle's bounds reach the box.
    [[nodiscard]] bool mayReach(uint32_t triangle) const;
    [[nodiscard]] Source sourceOf(uint32_t triangle) const;
    /// Returns the smallest box around the part of a piece that is in a box.
    [[nodiscard]] static OctreeBox boxAround(const Polygon& piece, const CutterBox& whole);
    /// Cuts what is in a box into pieces that lie in one cell each.
    void split(const Polygon& piece, const CutterBox& whole);
    /// Whether a box and the one that pieces are kept of have cells in common.
    [[nodiscard]] bool isWanted(const CutterBox& box) const;
    void keep(const Polygon& piece, glm::ivec3 cell);
    [[nodiscard]] CellSurface sum(std::span<const CellPiece> pieces) const;

    const LatticeMesh& mesh_;
    glm::i32vec3 origin_;
    int depth_;
    CutterBox within_;
    Source source_;
    std::vector<CellPiece> pieces_;
    std::vector<glm::vec3> corners_;  ///< from the centres of the pieces' cells
};

}  // namespace vcp
