#include "builder/slab/triangle_cutter.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "octree/surface/leaf_math.h"
#include "octree/surface/morton.h"

namespace vcp {

namespace {

using Corner = TrianglePiece::Corner;

// What single precision may take from a coordinate that counts from a cell's centre.
constexpr float kRounding = 1e-7f;

/// The parts of a piece on both sides of a plane; null where there is none.
struct Sides {
    const TrianglePiece *below, *above;
};

/// Parts a piece at the plane where coordinate `axis` is `at`; `below` and `above` are room for what is cut. A piece in
/// the plane belongs to both sides.
Sides part(const TrianglePiece& piece, int axis, double at, TrianglePiece& below, TrianglePiece& above) {
    double least = std::numeric_limits<double>::infinity(), most = -least;
    for (const Corner& c : piece.all()) {
        least = std::min(least, c.p[axis]);
        most = std::max(most, c.p[axis]);
    }
    if (most <= at || least >= at) return {most <= at ? &piece : nullptr, least >= at ? &piece : nullptr};
    below.count = above.count = 0;
    for (uint32_t i = 0; i < piece.count; ++i) {
        const Corner &a = piece.corners[i], &b = piece.corners[i + 1 < piece.count ? i + 1 : 0];
        const double da = a.p[axis] - at, db = b.p[axis] - at;
        if (da <= 0) below.add(a);
        if (da >= 0) above.add(a);
        if ((da < 0) == (db < 0) || da == 0 || db == 0) continue;
        const double t = da / (da - db);
        Corner crossing{a.p + t * (b.p - a.p), a.weights + t * (b.weights - a.weights)};
        crossing.p[axis] = at;
        below.add(crossing);
        above.add(crossing);
    }
    return {&below, &above};
}

/// Returns the area vector of a polygon: twice its area along its normal.
glm::dvec3 areaVector(std::span<const Corner> corners) {
    glm::dvec3 sum(0);
    for (size_t i = 2; i < corners.size(); ++i)
        sum += glm::cross(corners[i - 1].p - corners[0].p, corners[i].p - corners[0].p);
    return sum;
}

}  // namespace

TriangleCutter::Attributes TriangleCutter::attributesOf(uint32_t triangle) const {
    const auto& t = mesh_.triangles[triangle];
    const glm::dvec3 a(mesh_.positions[t[0]]), b(mesh_.positions[t[1]]), c(mesh_.positions[t[2]]);
    const glm::dvec3 flat = glm::normalize(glm::cross(b - a, c - a));
    Attributes attributes;
    for (size_t i = 0; i < 3; ++i) {
        const uint32_t code = mesh_.normals[t[i]];
        attributes.normal[i] = (code & kNormalCreaseBit) != 0 ? flat : f64::turnedTo(f64::decodeNormal(code), flat);
        const uint32_t rgba = mesh_.colours.empty() ? 0xffffffffu : mesh_.colours[t[i]];
        for (int k = 0; k < 4; ++k) attributes.colour[i][k] = double(rgba >> 8 * k & 255u) / 255;
    }
    return attributes;
}

void TriangleCutter::clipToPage(TrianglePiece& piece) const {
    TrianglePiece below, above;
    for (int axis = 0; axis < 3 && piece.count > 0; ++axis)
        for (int end = 0; end < 2 && piece.count > 0; ++end) {
            const Sides sides = part(piece, axis, end == 0 ? 0.0 : std::ldexp(1.0, depth_), below, above);
            const TrianglePiece* inside = end == 0 ? sides.above : sides.below;
            if (inside == nullptr)
                piece.count = 0;
            else if (inside != &piece)
                piece = *inside;
        }
}

void TriangleCutter::cut(uint32_t triangle) {
    const double scale = 2.0 / double(kLatticePerCell);
    TrianglePiece piece;
    for (uint32_t i = 0; i < 3; ++i)
        piece.add({glm::dvec3(mesh_.positions[mesh_.triangles[triangle][i]] - origin_) * scale,
                   glm::dvec2(i == 1 ? 1 : 0, i == 2 ? 1 : 0)});
    clipToPage(piece);
    if (piece.count == 0) return;
    attributes_ = attributesOf(triangle);
    // The smallest box of the octree that holds the piece.
    int differ = 0, last = (1 << depth_) - 1;
    glm::ivec3 lower;
    for (int axis = 0; axis < 3; ++axis) {
        double least = piece.corners[0].p[axis], most = least;
        for (const Corner& c : piece.all()) {
            least = std::min(least, c.p[axis]);
            most = std::max(most, c.p[axis]);
        }
        const bool isInWall = least == most && least == std::floor(least);
        lower[axis] = std::clamp(int(least) - (isInWall ? 1 : 0), 0, last);
        differ |= lower[axis] ^ std::min(int(most), last);
    }
    const int bits = int(std::bit_width(unsigned(differ)));
    split(piece, lower >> bits << bits, bits);
}

void TriangleCutter::split(const TrianglePiece& piece, glm::ivec3 lower, int log2Edge) {
    if (log2Edge == 0) return keep(piece, lower);
    const int half = 1 << (log2Edge - 1);
    const glm::dvec3 middle(lower + half);
    TrianglePiece room[3][2];
    const Sides x = part(piece, 0, middle.x, room[0][0], room[0][1]);
    for (int i = 0; i < 2; ++i) {
        const TrianglePiece* byX = i == 0 ? x.below : x.above;
        if (byX == nullptr) continue;
        const Sides y = part(*byX, 1, middle.y, room[1][0], room[1][1]);
        for (int j = 0; j < 2; ++j) {
            const TrianglePiece* byY = j == 0 ? y.below : y.above;
            if (byY == nullptr) continue;
            const Sides z = part(*byY, 2, middle.z, room[2][0], room[2][1]);
            if (z.below != nullptr) split(*z.below, lower + half * glm::ivec3(i, j, 0), log2Edge - 1);
            if (z.above != nullptr) split(*z.above, lower + half * glm::ivec3(i, j, 1), log2Edge - 1);
        }
    }
}

void TriangleCutter::keep(const TrianglePiece& piece, glm::ivec3 cell) {
    const double size = glm::length(areaVector(piece.all()));
    if (size == 0) return;
    glm::dvec2 w(0);
    for (const Corner& c : piece.all()) w += c.weights / double(piece.count);
    const auto& [n, colour] = attributes_;
    const glm::dvec3 normal = (1 - w.x - w.y) * n[0] + w.x * n[1] + w.y * n[2];
    const double length = glm::length(normal);
    pieces_.push_back({uint32_t(mortonEncode(glm::u32vec3(cell))), uint32_t(corners_.size()), piece.count,
                       float(size / 2), glm::vec3(length > 0 ? normal / length : n[0]),
                       glm::vec4((1 - w.x - w.y) * colour[0] + w.x * colour[1] + w.y * colour[2])});
    const glm::dvec3 centre = glm::dvec3(cell) + 0.5;
    for (const Corner& c : piece.all()) corners_.emplace_back(c.p - centre);
}

CellSurface TriangleCutter::sum(std::span<const CellPiece> pieces) const {
    CellSurface cell;
    cell.lower = glm::vec3(1);
    cell.upper = glm::vec3(-1);
    for (const CellPiece& piece : pieces) {
        const glm::vec3 n = piece.normal;
        const float products[6] = {n.x * n.x, n.y * n.y, n.z * n.z, n.y * n.z, n.z * n.x, n.x * n.y};
        for (size_t k = 0; k < 6; ++k) cell.moment[k] += piece.area * products[k];
        cell.area += piece.area;
        cell.colour += piece.area * piece.colour;
    }
    chooseAxis(cell);
    double first = 2, last = -2;
    for (const CellPiece& piece : pieces)
        for (const glm::vec3& x : std::span(corners_).subspan(piece.first, piece.count)) {
            cell.lower = glm::min(cell.lower, x - kRounding);
            cell.upper = glm::max(cell.upper, x + kRounding);
            const double along = glm::dot(glm::dvec3(cell.axis), glm::dvec3(x));
            first = std::min(first, along);
            last = std::max(last, along);
        }
    cell.first = float(first) - 2 * kRounding;
    cell.last = float(last) + 2 * kRounding;
    return cell;
}

SurfaceCells TriangleCutter::take() {
    std::stable_sort(pieces_.begin(), pieces_.end(),
                     [](const CellPiece& a, const CellPiece& b) { return a.code < b.code; });
    SurfaceCells surface;
    for (size_t i = 0; i < pieces_.size();) {
        const uint32_t code = pieces_[i].code;
        size_t end = i;
        while (end < pieces_.size() && pieces_[end].code == code) ++end;
        surface.codes.push_back(code);
        surface.cells.push_back(sum(std::span(pieces_).subspan(i, end - i)));
        i = end;
    }
    return surface;
}

}  // namespace vcp
