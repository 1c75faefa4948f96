// Brings the soup from world space to the finest level's lattice: snapped, long edges cut, colours settled.
#pragma once

#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "builder/ingest.h"
#include "builder/lattice/finest_pages.h"
#include "builder/lattice/lattice_mesh.h"
#include "builder/lattice/soup.h"
#include "builder/texture/material_colours.h"
#include "octree/surface/leaf_math.h"

namespace vcp {

/// Where images give the colour, vertices are at most so many cells of the base level apart, since they carry it.
inline constexpr double kPaintedEdgeCells = 1.5;

/// What the file has of a material's image.
struct PlacedMaterial {
    uint32_t number = 0;  ///< in the file's table, plus 1; 0: it has none
    uint32_t shift = 0;   ///< so many lowest bits of coordinates (TexturePoint) are finer than its texels ask for
    bool operator==(const PlacedMaterial&) const = default;
};

/// Snaps triangles to a frame's lattice. Any thread.
class LatticeSnapper {
public:
    /// `colours`: those of the soup's materials; null: vertices keep their own. `vertexColours`: whether these count.
    /// `pages`: the pages that vertices must suit, on the frame's lattice. `placed`: of the soup's materials; none
    /// where the file keeps no images. It must outlive the snapper.
    explicit LatticeSnapper(const GridFrame& frame, MaterialColours* colours = nullptr, bool vertexColours = true,
                            FinestPages pages = FinestPages(), std::span<const PlacedMaterial> placed = {});

    /// Gives the triangle, or its pieces, to `sink(const LatticeTriangle&)`, or to `sink(const LatticeTriangle&, const
    /// std::optional<TexturedTriangle>&)`, with its place in an image that the file keeps; some may have no area on the
    /// lattice (collapsed_triangles.h). An edge is cut at the same lattice point in every triangle that has it, so no
    /// crack opens. `painted`: with the materials' colours.
    template <class Real, class Sink>
    void add(const WorldTriangle<Real>& triangle, Sink&& sink, bool painted = true) const {
        cutInto(snap(triangle), sink, painted && colours_);
    }

private:
    /// A triangle on its way, with what its colours are computed from.
    struct Piece {
        LatticeTriangle triangle;
        glm::dvec3 moved[3];  ///< how far each corner lies from where the mesh has it, in steps of the lattice
        int step[3];          ///< each corner lies on multiples of so many
        int cuts;
        bool hasNormals;
        glm::dvec3 normal[3];  ///< the mesh's own, on the facet's side; 0: unknown. Not unit where edges were cut
        glm::vec2 uv[3];
        uint32_t material;
    };

    /// A corner of a piece, or the middle of an edge.
    struct Point {
        glm::i32vec3 at;
        glm::dvec3 moved;
        int step;
        uint32_t colour;
        glm::vec2 uv;
        glm::dvec3 normal;
    };

    template <class Real>
    Piece snap(const WorldTriangle<Real>& triangle) const;
    [[nodiscard]] bool tooLong(glm::i32vec3 a, glm::i32vec3 b) const;
    static Point pointOf(const Piece& piece, int corner);
    /// Returns the middle of an edge, the same whichever end comes first.
    [[nodiscard]] Point middle(const Point& a, const Point& b) const;
    /// Cuts each edge that is too long in its middle. Returns the number of pieces, 0 when none is too long.
    int cut(const Piece& piece, Piece (&pieces)[4]) const;
    void paint(Piece& piece) const;
    /// Returns the piece's place in an image; none where it has none, is tinged by its vertices' own colours, or lies
    /// too far from the image to say where.
    [[nodiscard]] std::optional<TexturedTriangle> placeOf(const Piece& piece) const;
    [[nodiscard]] float strayOf(const Piece& piece) const;

    template <class Sink>
    void cutInto(Piece piece, Sink& sink, bool painted) const {
        Piece pieces[4];
        const int count = cut(piece, pieces);
        for (int i = 0; i < count; ++i) cutInto(pieces[i], sink, painted);
        if (count > 0) return;
        std::optional<TexturedTriangle> place;
        if (painted && !placed_.empty()) place = placeOf(piece);
        if (painted) paint(piece);
        piece.triangle.stray = strayOf(piece);
        if (piece.hasNormals && piece.cuts > 0)
            for (int i = 0; i < 3; ++i) piece.triangle.own[i] = packDirection(piece.normal[i]);
        if constexpr (std::is_invocable_v<Sink&, const LatticeTriangle&>)
            sink(std::as_const(piece.triangle));
        else
            sink(std::as_const(piece.triangle), std::as_const(place));
    }

    glm::dvec3 origin_;
    double scale_, longest_;
    MaterialColours* colours_;
    bool vertexColours_;
    FinestPages pages_;
    std::span<const PlacedMaterial> placed_;
};

}  // namespace vcp
