// Cuts triangles along the walls of a page's cells and sums up what lies in each cell.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "builder/lattice/lattice_mesh.h"
#include "builder/slab/page_surface.h"

namespace vcp {

/// A piece of a triangle: a convex polygon in the triangle's plane. A triangle that six walls cut has at most 9
/// corners.
struct TrianglePiece {
    struct Corner {
        glm::dvec3 p;        ///< in the cutter's cells, from the page's lowest corner
        glm::dvec2 weights;  ///< of the triangle's second and third corner
    };
    std::array<Corner, 12> corners;
    uint32_t count = 0;

    [[nodiscard]] std::span<const Corner> all() const { return std::span(corners).first(count); }
    void add(const Corner& corner) { corners[count++] = corner; }
};

class TriangleCutter {
public:
    /// `origin`: the page's lowest corner on the lattice; the page has 2^depth of the cutter's cells an edge, of which
    /// two are as long as one cell of the mesh's level.
    TriangleCutter(const LatticeMesh& mesh, glm::i32vec3 origin, int depth)
        : mesh_(mesh), origin_(origin), depth_(depth) {}

    /// Cuts a triangle of the mesh; what lies outside of the page is left out. A piece in a wall belongs to both sides.
    void cut(uint32_t triangle);
    /// Returns what is known of the cells. To be called once, after all cuts.
    SurfaceCells take();

private:
    /// The triangle that is being cut: what is blended over it.
    struct Attributes {
        std::array<glm::dvec3, 3> normal;
        std::array<glm::dvec4, 3> colour;
    };
    /// A piece that lies in one cell.
    struct CellPiece {
        uint32_t code, first, count;  ///< the cell; the corners
        float area;
        glm::vec3 normal;  ///< unit
        glm::vec4 colour;
    };
    [[nodiscard]] Attributes attributesOf(uint32_t triangle) const;
    void clipToPage(TrianglePiece& piece) const;
    void split(const TrianglePiece& piece, glm::ivec3 lower, int log2Edge);
    void keep(const TrianglePiece& piece, glm::ivec3 cell);
    [[nodiscard]] CellSurface sum(std::span<const CellPiece> pieces) const;

    const LatticeMesh& mesh_;
    glm::i32vec3 origin_;
    int depth_;
    Attributes attributes_;
    std::vector<CellPiece> pieces_;
    std::vector<glm::vec3> corners_;  ///< from the centres of the pieces' cells
};

}  // namespace vcp
