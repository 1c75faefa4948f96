// The triangles around one subvolume, in page space, arranged so that cells find their triangles and corners
// their closest points.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include <glm/vec3.hpp>

#include "builder/lattice/lattice_mesh.h"
#include "builder/lattice/triangle_geometry.h"
#include "builder/page/leaf_certificate.h"

namespace vcp {

/// Octree positions count in subcells, so that leaves may be smaller than a cell.
inline constexpr int kSubcells = 8;

/// A cube of the octree: lowest corner and edge in subcells of the page.
struct NodeBox {
    glm::ivec3 lower{0};
    int edge = 0;

    [[nodiscard]] glm::dvec3 lowerCells() const { return glm::dvec3(lower) / double(kSubcells); }
    [[nodiscard]] double edgeCells() const { return double(edge) / kSubcells; }
    [[nodiscard]] glm::dvec3 centreCells() const { return lowerCells() + edgeCells() / 2; }
    [[nodiscard]] NodeBox child(int octant) const {
        return {lower + (edge / 2) * glm::ivec3(octant & 1, octant >> 1 & 1, octant >> 2), edge / 2};
    }
};

class PageGeometry {
public:
    /// `triangles`: numbers in `mesh`, ascending, of all that come within kBinMarginCells of the page at `page` (Morton
    /// position, in pages of 2^log2Cells cells).
    PageGeometry(const LatticeMesh& mesh, std::span<const uint32_t> triangles, glm::u32vec3 page, uint32_t log2Cells);

    [[nodiscard]] int cells() const { return cells_; }
    [[nodiscard]] glm::i32vec3 originLattice() const { return origin_; }
    /// Whether the mesh touches a closed cell of the page.
    [[nodiscard]] bool occupied(glm::ivec3 cell) const {
        const size_t i = 2 * cellIndex(cell);
        return listBegin_[i] != listBegin_[i + 1];
    }

    /// Local triangle numbers: ascending, those that touch a closed cell, then likewise those that only touch
    /// it widened by kCertificateMarginCells.
    struct CellTriangles {
        std::span<const uint32_t> around, inside;
    };
    [[nodiscard]] CellTriangles trianglesOf(glm::ivec3 cell) const {
        const uint32_t *lists = cellTriangles_.data(), *begin = &listBegin_[2 * cellIndex(cell)];
        return {{lists + begin[0], lists + begin[2]}, {lists + begin[0], lists + begin[1]}};
    }

    /// Finds local triangle numbers (ascending) that touch the box widened by kCertificateMarginCells, and in `inside`
    /// those that touch the closed box itself. Boxes have at least a cell's edge.
    void trianglesOf(const NodeBox& box, std::vector<uint32_t>& around, std::vector<uint32_t>& inside);
    /// Does the same for a smaller box, from the triangles around its parent.
    void filter(const NodeBox& box, std::span<const uint32_t> candidates, std::vector<uint32_t>& around,
                std::vector<uint32_t>& inside) const;

    /// Holds the triangles of the eight children of a box.
    struct ChildTriangles {
        std::array<std::vector<uint32_t>, 8> around, inside;
    };
    void split(const NodeBox& box, std::span<const uint32_t> candidates, ChildTriangles& children) const;

    /// Returns the exact closest point of a corner (position in subcells) among the page's triangles; the smallest
    /// (squared distance, triangle) wins. It is exact for the whole mesh where it is within 2 cells. Valid until the
    /// next call.
    const CornerVector& corner(glm::ivec3 subcells);

    [[nodiscard]] bool hasColour() const { return !mesh_.colours.empty(); }
    /// The mesh's numbers of the local triangles.
    [[nodiscard]] std::span<const uint32_t> numbers() const { return numbers_; }
    [[nodiscard]] size_t triangleCount() const { return triangles_.size(); }
    [[nodiscard]] CertifiedTriangle triangle(uint32_t local) const {
        const Triangle& t = triangles_[local];
        return {cornersOf(t), glm::dvec3(t.normal), t.badEdges};
    }
    /// Returns the vertex numbers in the mesh.
    [[nodiscard]] const std::array<uint32_t, 3>& vertices(uint32_t local) const { return vertices_[local]; }
    /// Returns the largest stray of the triangles that touch the page, in cells.
    [[nodiscard]] double stray() const { return stray_; }

private:
    /// Corners on a page's lattice are exact in float.
    struct Triangle {
        std::array<glm::vec3, 3> corners;
        glm::vec3 normal;  ///< unit
        uint8_t badEdges;  ///< as in CertifiedTriangle
        glm::vec3 centre;  ///< a point of the triangle
        float radius;      ///< all of the triangle is so close to the centre
    };
    static Triangle3 cornersOf(const Triangle& t) {
        return {glm::dvec3(t.corners[0]), glm::dvec3(t.corners[1]), glm::dvec3(t.corners[2])};
    }

    void loadTriangles();
    void markBadEdges();
    void fillCells();
    CornerVector searchCorner(glm::dvec3 p);
    /// Measures the triangles from number `first` in found_, except those that cannot be closest; `least` is the least
    /// squared distance so far; returns the new one.
    double measureFound(glm::dvec3 p, size_t first, double least);
    [[nodiscard]] size_t cellIndex(glm::ivec3 cell) const {
        const int side = cells_ + 2 * kBorder;
        return size_t(cell.x + kBorder + side * (cell.y + kBorder + side * (cell.z + kBorder)));
    }

    static constexpr int kBorder = 2;  ///< cells around the page that are searched for closest points

    const LatticeMesh& mesh_;
    std::span<const uint32_t> numbers_;
    int cells_;
    glm::i32vec3 origin_;
    double stray_ = 0;
    std::vector<Triangle> triangles_;
    std::vector<std::array<uint32_t, 3>> vertices_;
    std::vector<uint32_t> cellTriangles_;  ///< lists of CellTriangles, cell by cell
    std::vector<uint32_t> listBegin_;      ///< starts in cellTriangles_, two a cell: touching, others
    std::vector<uint32_t> stamp_;          ///< a triangle is new to a search until it bears stampNow_
    uint32_t stampNow_ = 0;
    struct Found {
        uint32_t triangle;
        float least;     ///< the distance is at least this
        double squared;  ///< squared distance, once measured
    };
    std::vector<Found> found_;          ///< the candidates of a search
    std::vector<uint32_t> gridCorner_;  ///< corners of cells: number in corners_ + 1, 0: not searched
    std::unordered_map<uint64_t, uint32_t> subcellCorner_;  ///< the same for corners within cells
    std::vector<CornerVector> corners_;
};

}  // namespace vcp
