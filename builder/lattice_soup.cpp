#include "builder/lattice_soup.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "builder/stream/colour_encoding.h"
#include "octree/surface/leaf_math.h"

namespace vcp {

namespace {

/// Returns the middle of two colours, channel by channel.
uint32_t middleColour(uint32_t a, uint32_t b) { return (a & b) + (((a ^ b) & 0xfefefefeu) >> 1); }

bool isKnown(glm::dvec3 normal) { return normal != glm::dvec3(0); }

/// Returns whether a triangle has normals of its own, and these, on the side of the facet.
template <class Real>
bool takeNormals(const WorldTriangle<Real>& triangle, glm::dvec3 (&normals)[3]) {
    const auto& n = triangle.normal;
    if (n[0] == kUnknownNormal && n[1] == kUnknownNormal && n[2] == kUnknownNormal) return false;
    const glm::dvec3 a(triangle.corner[0]), b(triangle.corner[1]), c(triangle.corner[2]);
    const glm::dvec3 facet = glm::cross(b - a, c - a);
    for (int i = 0; i < 3; ++i) normals[i] = n[i] == kUnknownNormal ? glm::dvec3(0) : f64::cornerNormal(n[i], facet);
    return true;
}

// A piece that was cut says that it may have strayed by so many roundings at least: those beside it that lost their
// area are left out, and rays in single precision miss long needles by about as much.
constexpr int kMostRoundings = 3;

// Coordinates within so many repetitions of an image are kept as they are; a TexturePoint holds somewhat more than
// twice as many.
constexpr double kMostRepetitions = 1000;

}  // namespace

LatticeSnapper::LatticeSnapper(const GridFrame& frame, MaterialColours* colours, bool vertexColours, FinestPages pages,
                               std::span<const PlacedMaterial> placed)
    : origin_(frame.origin),
      scale_(double(kLatticePerCell) / frame.cell),
      longest_(std::ldexp(colours && colours->hasImages() ? kPaintedEdgeCells : double(kMaxEdgeCells),
                          int(PageGrid::kLog2LatticePerCell + pages.deepest() - pages.base()))),
      colours_(colours),
      vertexColours_(vertexColours),
      pages_(std::move(pages)),
      placed_(placed) {}

bool LatticeSnapper::tooLong(glm::i32vec3 a, glm::i32vec3 b) const {
    const glm::dvec3 d = glm::dvec3(a) - glm::dvec3(b);
    return glm::dot(d, d) > longest_ * longest_ || pages_.isTooLong(a, b);
}

LatticeSnapper::Point LatticeSnapper::pointOf(const Piece& piece, int corner) {
    return {piece.triangle.corner[corner], piece.moved[corner], piece.step[corner],
            piece.triangle.colour[corner], piece.uv[corner],    piece.normal[corner]};
}

LatticeSnapper::Point LatticeSnapper::middle(const Point& a, const Point& b) const {
    const glm::dvec3 exact = (glm::dvec3(a.at) + glm::dvec3(b.at)) / 2.0;
    const auto [at, step] = pages_.vertexOf(exact, glm::i32vec3(glm::floor(exact)));
    return {at,
            (a.moved + b.moved) / 2.0 + (glm::dvec3(at) - exact),
            step,
            middleColour(a.colour, b.colour),
            (a.uv + b.uv) * 0.5f,
            isKnown(a.normal) && isKnown(b.normal) ? (a.normal + b.normal) / 2.0 : glm::dvec3(0)};
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
    // Points 0 to 2 are corners; 3 to 5 are middles of the edges from them, where these are cut.
    Point points[6];
    for (int i = 0; i < 3; ++i) points[i] = pointOf(piece, (i + turn) % 3);
    for (int i = 0; i < cuts; ++i) points[3 + i] = middle(points[i], points[(i + 1) % 3]);
    int count = 0;
    const auto add = [&](int a, int b, int c) {
        Piece& p = pieces[count++] = piece;
        ++p.cuts;
        const int from[3] = {a, b, c};
        for (int i = 0; i < 3; ++i) {
            const Point& point = points[from[i]];
            p.triangle.corner[i] = point.at;
            p.triangle.colour[i] = point.colour;
            p.moved[i] = point.moved;
            p.step[i] = point.step;
            p.uv[i] = point.uv;
            p.normal[i] = point.normal;
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
    // A corner that several triangles meet in gets the mean of what each says of it (meshOf).
    const std::array<Rgba8, 3> painted = colours_->ofCorners(piece.material, piece.uv);
    for (int i = 0; i < 3; ++i)
        piece.triangle.colour[i] =
            vertexColours_ ? modulate(piece.triangle.colour[i], painted[size_t(i)]) : painted[size_t(i)];
}

std::optional<TexturedTriangle> LatticeSnapper::placeOf(const Piece& piece) const {
    if (piece.material == 0 || placed_[piece.material - 1].number == 0) return {};
    const LatticeTriangle& t = piece.triangle;
    if (vertexColours_ && (t.colour[0] & t.colour[1] & t.colour[2]) != kWhite) return {};
    const PlacedMaterial& placed = placed_[piece.material - 1];
    TexturedTriangle place{{t.corner[0], t.corner[1], t.corner[2]}, {}, placed.number};
    for (int axis = 0; axis < 2; ++axis) {
        const double low = std::min({piece.uv[0][axis], piece.uv[1][axis], piece.uv[2][axis]}),
                     high = std::max({piece.uv[0][axis], piece.uv[1][axis], piece.uv[2][axis]});
        // Far from the image, whole repetitions are left out: two at a time, since every other one may be mirrored.
        const bool isFar = low < -kMostRepetitions || high > kMostRepetitions;
        const double whole = isFar ? 2 * std::floor(low / 2) : 0;
        const bool isFinite = std::isfinite(piece.uv[0][axis] + piece.uv[1][axis] + piece.uv[2][axis]);
        if (!isFinite || high - whole > 2 * kMostRepetitions) return {};
        for (int i = 0; i < 3; ++i) {
            const double steps = std::ldexp(double(piece.uv[i][axis]) - whole, -kLog2TextureUnit - int(placed.shift));
            place.point[i][axis] = int32_t(std::floor(steps + 0.5)) * (1 << placed.shift);
        }
    }
    return place;
}

float LatticeSnapper::strayOf(const Piece& piece) const {
    // A point of the piece has moved by a mean of its corners' ways, so by no more than the longest of them.
    double longest = 0;
    for (int i = 0; i < 3; ++i) {
        const double rounding = kLatticeRounding * kLatticePerCell * piece.step[i];
        const double roundings = std::min(piece.cuts + 1, kMostRoundings) * rounding;
        longest = std::max({longest, roundings, glm::length(piece.moved[i]) * (1 + 1e-6)});
    }
    return float(longest / kLatticePerCell);
}

template <class Real>
LatticeSnapper::Piece LatticeSnapper::snap(const WorldTriangle<Real>& triangle) const {
    Piece piece{};
    LatticeTriangle& t = piece.triangle;
    for (int i = 0; i < 3; ++i) {
        const glm::dvec3 q =
            glm::clamp((glm::dvec3(triangle.corner[i]) - origin_) * scale_, glm::dvec3(0), glm::dvec3(2147483647.0));
        const auto [at, step] = pages_.vertexOf(q, glm::i32vec3(q + 0.5));
        t.corner[i] = at;
        piece.step[i] = step;
        piece.moved[i] = glm::dvec3(t.corner[i]) - q;
        t.colour[i] = triangle.colour[i];
        piece.uv[i] = triangle.uv[i];
    }
    piece.material = triangle.material;
    piece.hasNormals = takeNormals(triangle, piece.normal);
    std::copy_n(triangle.normal, 3, t.own);
    return piece;
}

template LatticeSnapper::Piece LatticeSnapper::snap(const WorldTriangle<float>&) const;
template LatticeSnapper::Piece LatticeSnapper::snap(const WorldTriangle<double>&) const;

}  // namespace vcp
