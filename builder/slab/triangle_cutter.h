// Cuts triangles along the walls of a page's cells and sums up what lies in each cell.
#pragma once

#include <array>
#include <bit>
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
    /// Appends what is known of the box's cells and of their eighths, in Morton order. To be called once, after all
    /// cuts.
    void appendTo(SurfaceCells& cells, SurfaceQuarters& quarters) const;

private:
    /// The triangle that is being cut, in the cutter's cells from the page's lowest corner, and what is blended over
    /// it.
    struct Source {
        Triangle3 corners;
        glm::dvec3 secondGrows{0}, thirdGrows{0};  ///< gradients of these corners' weights
        std::array<glm::dvec3, 3> normal;
        std::array<glm::dvec4, 3> colour;  ///< as stored, 0 to 1, where the mesh has colours
        bool isPlain = true;               ///< all of it has the first corner's colour
        uint32_t parts = 0;                ///< the kind of part that it belongs to, as PageEntry's
        /// Returns the weights of the corners at a point of the triangle.
        [[nodiscard]] glm::dvec3 weightsAt(glm::dvec3 p) const;
    };
    /// The cells that a piece is in along each axis.
    struct CellRange {
        glm::ivec3 first{0}, last{0};
        bool endInWall = false;  ///< whether the piece reaches a wall, or is in one

        /// Returns the smallest box of the octree around them.
        [[nodiscard]] CutterBox box() const {
            const glm::ivec3 differ = first ^ last;
            const int bits = int(std::bit_width(unsigned(differ.x | differ.y | differ.z)));
            return {first >> bits << bits, bits};
        }
        /// Returns how many walls are between them.
        [[nodiscard]] int walls() const { return last.x - first.x + last.y - first.y + last.z - first.z; }
    };
    /// A piece that lies in one cell.
    struct CellPiece {
        uint32_t code, first, count;  ///< the cell; the corners
        float area;
        glm::vec3 normal;  ///< unit
        glm::vec4 light;   ///< mean: linear RGB, alpha
        uint32_t parts;    ///< as the source's
    };
    /// Whether a triangle's bounds reach the box.
    [[nodiscard]] bool mayReach(uint32_t triangle) const;
    [[nodiscard]] Source sourceOf(uint32_t triangle) const;
    /// Returns the cells of a box that a piece is in.
    [[nodiscard]] static CellRange cellsOf(const Polygon& piece, const CutterBox& whole);
    /// Cuts what is in a box into pieces that lie in one cell each.
    void split(const Polygon& piece, const CutterBox& whole);
    /// Cuts a piece that is in few cells, wall by wall.
    void cutAtWalls(const Polygon& piece, const CellRange& cells);
    /// Whether a box and the one that pieces are kept of have cells in common.
    [[nodiscard]] bool isWanted(const CutterBox& box) const;
    void keep(const Polygon& piece, glm::ivec3 cell);
    /// Returns the mean light of a piece of the triangle that is being cut, and its mean alpha.
    [[nodiscard]] glm::vec4 lightOf(const Polygon& piece) const;
    /// `pieces`: their numbers in the low halves of words.
    [[nodiscard]] CellSurface sum(std::span<const uint64_t> pieces) const;
    void appendEighths(uint32_t code, std::span<const uint64_t> pieces, SurfaceQuarters& quarters) const;

    static constexpr int kMostWalls = 6;
    static constexpr size_t kMostParts = 27;  // with two walls along each axis

    const LatticeMesh& mesh_;
    glm::i32vec3 origin_;
    int depth_;
    CutterBox within_;
    Source source_;
    std::array<Polygon, 2 * kMostParts> room_;  ///< for the parts of a piece
    std::vector<CellPiece> pieces_;
    std::vector<glm::vec3> corners_;  ///< from the centres of the pieces' cells
};

}  // namespace vcp
