#include "builder/lattice_soup.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "builder/stream/colour_encoding.h"

namespace vcp {

namespace {

/// Returns the middle of two colours, channel by channel.
uint32_t middleColour(uint32_t a, uint32_t b) { return (a & b) + (((a ^ b) & 0xfefefefeu) >> 1); }

glm::i32vec3 middle(glm::i32vec3 a, glm::i32vec3 b) {
    return {(int64_t{a.x} + b.x) >> 1, (int64_t{a.y} + b.y) >> 1, (int64_t{a.z} + b.z) >> 1};
}

/// Returns the edge of a cell in texture coordinates, from the ratio of the triangle's areas.
float footprintOf(const LatticeTriangle& t, const glm::vec2 (&uv)[3]) {
    const glm::dvec3 u = glm::dvec3(t.corner[1] - t.corner[0]), v = glm::dvec3(t.corner[2] - t.corner[0]);
    const double area = glm::length(glm::cross(u, v)) / (double(kLatticePerCell) * kLatticePerCell);
    const glm::dvec2 p = glm::dvec2(uv[1]) - glm::dvec2(uv[0]), q = glm::dvec2(uv[2]) - glm::dvec2(uv[0]);
    return area > 0 ? float(std::sqrt(std::abs(p.x * q.y - p.y * q.x) / area)) : 0.0f;
}

}  // namespace

LatticeSnapper::LatticeSnapper(const GridFrame& frame, MaterialColours* colours, bool vertexColours)
    : origin_(frame.origin),
      scale_(double(kLatticePerCell) / frame.cell),
      longest_((colours && colours->hasImages() ? kPaintedEdgeCells : double(kMaxEdgeCells)) * kLatticePerCell),
      colours_(colours),
      vertexColours_(vertexColours) {}

bool LatticeSnapper::tooLong(glm::i32vec3 a, glm::i32vec3 b) const {
    const glm::dvec3 d = glm::dvec3(a) - glm::dvec3(b);
    return glm::dot(d, d) > longest_ * longest_;
}

// Whether an edge is cut does not depend on the triangle.
int LatticeSnapper::cut(const Piece& piece, Piece (&pieces)[4]) const {
    const auto& corner = piece.triangle.corner;
    const bool isLong[3] = {tooLong(corner[0], corner[1]), tooLong(corner[1], corner[2]),
                            tooLong(corner[2], corner[0])};
    const int cuts = isLong[0] + isLong[1] + isLong[2];
    if (cuts == 0) return 0;
    // The triangle is turned so that the cut edges come first: (01), (01, 12) or all.
    int turn = 0;
    if (cuts == 1) turn = isLong[0] ? 0 : isLong[1] ? 1 : 2;
    if (cuts == 2) turn = !isLong[2] ? 0 : !isLong[0] ? 1 : 2;
    int count = 0;
    // Points 0 to 2 are corners; 3 to 5 are middles of the edges from them.
    const auto add = [&](int a, int b, int c) {
        Piece& p = pieces[count++] = piece;
        p.triangle.stray = piece.triangle.stray + float(kLatticeRounding);
        const int from[3] = {a, b, c};
        for (int i = 0; i < 3; ++i) {
            const int k = (from[i] + turn) % 3, next = (k + 1) % 3;
            const bool isMiddle = from[i] >= 3;
            p.triangle.corner[i] = isMiddle ? middle(corner[k], corner[next]) : corner[k];
            p.triangle.colour[i] = isMiddle ? middleColour(piece.triangle.colour[k], piece.triangle.colour[next])
                                            : piece.triangle.colour[k];
            p.uv[i] = isMiddle ? (piece.uv[k] + piece.uv[next]) * 0.5f : piece.uv[k];
        }
    };
    if (cuts == 1) {
        add(0, 3, 2);
        add(3, 1, 2);
    } else if (cuts == 2) {
        add(3, 1, 4);
        add(0, 3, 4);
        add(0, 4, 2);
    } else {
        add(0, 3, 5);
        add(3, 1, 4);
        add(5, 4, 2);
        add(3, 4, 5);
    }
    return count;
}

void LatticeSnapper::paint(Piece& piece) const {
    for (int i = 0; i < 3; ++i) {
        const Rgba8 painted = colours_->at(piece.material, piece.uv[i], piece.footprint);
        piece.triangle.colour[i] = vertexColours_ ? modulate(piece.triangle.colour[i], painted) : painted;
    }
}

template <class Real>
LatticeSnapper::Piece LatticeSnapper::snap(const WorldTriangle<Real>& triangle) const {
    Piece piece{};
    LatticeTriangle& t = piece.triangle;
    for (int i = 0; i < 3; ++i) {
        const glm::dvec3 q =
            glm::clamp((glm::dvec3(triangle.corner[i]) - origin_) * scale_, glm::dvec3(0), glm::dvec3(2147483647.0));
        t.corner[i] = glm::i32vec3(std::lround(q.x), std::lround(q.y), std::lround(q.z));
        t.colour[i] = triangle.colour[i];
        piece.uv[i] = triangle.uv[i];
    }
    t.stray = float(kLatticeRounding);
    piece.material = triangle.material;
    if (colours_ && piece.material > 0) piece.footprint = footprintOf(t, piece.uv);
    return piece;
}

template LatticeSnapper::Piece LatticeSnapper::snap(const WorldTriangle<float>&) const;
template LatticeSnapper::Piece LatticeSnapper::snap(const WorldTriangle<double>&) const;

}  // namespace vcp
