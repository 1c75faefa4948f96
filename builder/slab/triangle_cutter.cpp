#include "builder/slab/triangle_cutter.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/type_precision.hpp>

#include "octree/surface/leaf_math.h"
#include "octree/surface/morton.h"

namespace vcp {

namespace {

// What single precision may take from a coordinate that counts from a cell's centre.
constexpr float kRounding = 1e-7f;

/// Returns the area vector of a polygon: twice its area along its normal.
glm::dvec3 areaVector(const Polygon& polygon) {
    glm::dvec3 sum(0);
    for (size_t i = 2; i < polygon.size(); ++i) sum += glm::cross(polygon[i - 1] - polygon[0], polygon[i] - polygon[0]);
    return sum;
}

/// Sorts words by the lowest `bits` bits of their high halves, the others of which are 0; equal ones keep their order.
void sortHighHalves(std::vector<uint64_t>& words, int bits) {
    constexpr int kDigitBits = 9;
    constexpr uint64_t kDigits = uint64_t{1} << kDigitBits;
    std::vector<uint64_t> sorted(words.size());
    for (int shift = 32; shift < 32 + bits; shift += kDigitBits) {
        std::array<size_t, kDigits> next{};
        for (const uint64_t word : words) ++next[word >> shift & (kDigits - 1)];
        std::exclusive_scan(next.begin(), next.end(), next.begin(), size_t{0});
        for (const uint64_t word : words) sorted[next[word >> shift & (kDigits - 1)]++] = word;
        words.swap(sorted);
    }
}

}  // namespace

glm::dvec3 TriangleCutter::Source::weightsAt(glm::dvec3 p) const {
    const glm::dvec3 ap = p - corners[0];
    const double b = glm::dot(ap, secondGrows), c = glm::dot(ap, thirdGrows);
    return {1 - b - c, b, c};
}

TriangleCutter::Source TriangleCutter::sourceOf(uint32_t triangle) const {
    const auto& t = mesh_.triangles[triangle];
    Source source;
    for (size_t i = 0; i < 3; ++i)
        source.corners[i] = glm::dvec3(mesh_.positions[t[i]] - origin_) * (2.0 / double(kLatticePerCell));
    const auto& [a, b, c] = source.corners;
    const glm::dvec3 cross = glm::cross(b - a, c - a);
    const double squared = glm::dot(cross, cross);
    source.secondGrows = glm::cross(c - a, cross) / squared;
    source.thirdGrows = glm::cross(cross, b - a) / squared;
    const glm::dvec3 flat = cross / std::sqrt(squared);
    for (size_t i = 0; i < 3; ++i) {
        source.normal[i] = f64::cornerNormal(mesh_.normals[t[i]], flat);
        const uint32_t rgba = mesh_.colours.empty() ? 0xffffffffu : mesh_.colours[t[i]];
        for (int k = 0; k < 4; ++k) source.colour[i][k] = double(rgba >> 8 * k & 255u) / 255;
    }
    return source;
}

bool TriangleCutter::mayReach(uint32_t triangle) const {
    constexpr int kSteps = kLatticePerCell / 2;  // an edge of the cutter's cells
    const auto& [a, b, c] = mesh_.triangles[triangle];
    const glm::i32vec3 &p = mesh_.positions[a], &q = mesh_.positions[b], &r = mesh_.positions[c];
    // The last page of the largest grid ends beyond 31 bits.
    const glm::i64vec3 low = glm::i64vec3(origin_) + glm::i64vec3(within_.lower) * int64_t{kSteps};
    const glm::i64vec3 high = low + (int64_t{kSteps} << within_.log2Edge);
    return glm::all(glm::lessThanEqual(glm::i64vec3(glm::min(p, glm::min(q, r))), high)) &&
           glm::all(glm::greaterThanEqual(glm::i64vec3(glm::max(p, glm::max(q, r))), low));
}

void TriangleCutter::cut(uint32_t triangle) {
    if (!mayReach(triangle)) return;
    source_ = sourceOf(triangle);
    Polygon piece;
    clipToBox(source_.corners, glm::dvec3(0), glm::dvec3(std::ldexp(1.0, depth_)), piece);
    if (!piece.empty()) split(piece, {glm::ivec3(0), depth_});
}

TriangleCutter::OctreeBox TriangleCutter::boxAround(const Polygon& piece, const CutterBox& whole) {
    glm::dvec3 least = piece[0], most = piece[0];
    for (const glm::dvec3& p : piece) {
        least = glm::min(least, p);
        most = glm::max(most, p);
    }
    glm::ivec3 first, last;
    int differ = 0;
    for (int axis = 0; axis < 3; ++axis) {
        // A piece that only reaches a wall is in the cell that it comes from; one in a wall is on both sides of it.
        // No coordinate is negative, so conversion rounds down.
        const int begin = int(least[axis]), end = int(most[axis]);
        const bool endsInWall = double(end) == most[axis], isInWall = endsInWall && least[axis] == most[axis];
        const int lower = whole.lower[axis], upper = lower + (1 << whole.log2Edge) - 1;
        first[axis] = std::clamp(begin - (isInWall ? 1 : 0), lower, upper);
        last[axis] = std::clamp(end - (endsInWall && !isInWall ? 1 : 0), lower, upper);
        differ |= first[axis] ^ last[axis];
    }
    const int bits = int(std::bit_width(unsigned(differ)));
    OctreeBox box{{first >> bits << bits, bits}, {}};
    if (bits > 0)
        for (int axis = 0; axis < 3; ++axis)
            box.halves[size_t(axis)] = 1u << (first[axis] >> (bits - 1) & 1) | 1u << (last[axis] >> (bits - 1) & 1);
    return box;
}

bool TriangleCutter::isWanted(const CutterBox& box) const {
    const int bits = std::max(box.log2Edge, within_.log2Edge);
    return (box.lower >> bits) == (within_.lower >> bits);
}

void TriangleCutter::split(const Polygon& piece, const CutterBox& whole) {
    const OctreeBox box = boxAround(piece, whole);
    if (!isWanted(box)) return;
    if (box.log2Edge == 0) return keep(piece, box.lower);
    const glm::dvec3 middle(box.child(7).lower);
    Polygon room[3][2];
    const auto sidesOf = [&](const Polygon& part, int axis) -> PolygonSides {
        const uint32_t halves = box.halves[size_t(axis)];
        if (halves == 3) return partAt(part, axis, middle[axis], room[axis][0], room[axis][1]);
        return {halves == 1 ? &part : nullptr, halves == 2 ? &part : nullptr};
    };
    const auto splitOctant = [&](const Polygon* part, int octant) {
        if (part != nullptr) split(*part, box.child(octant));
    };
    const PolygonSides x = sidesOf(piece, 0);
    for (int i = 0; i < 2; ++i) {
        const Polygon* byX = i == 0 ? x.below : x.above;
        if (byX == nullptr) continue;
        const PolygonSides y = sidesOf(*byX, 1);
        for (int j = 0; j < 2; ++j) {
            const Polygon* byY = j == 0 ? y.below : y.above;
            if (byY == nullptr) continue;
            const PolygonSides z = sidesOf(*byY, 2);
            splitOctant(z.below, i + 2 * j);
            splitOctant(z.above, i + 2 * j + 4);
        }
    }
}

void TriangleCutter::keep(const Polygon& piece, glm::ivec3 cell) {
    const double size = glm::length(areaVector(piece));
    if (size == 0) return;
    glm::dvec3 middle(0);
    for (const glm::dvec3& p : piece) middle += p;
    const glm::dvec3 w = source_.weightsAt(middle / double(piece.size()));
    const auto& n = source_.normal;
    const auto& colour = source_.colour;
    const glm::dvec3 normal = w.x * n[0] + w.y * n[1] + w.z * n[2];
    const double length = glm::length(normal);
    pieces_.push_back({uint32_t(mortonEncode(glm::u32vec3(cell))), uint32_t(corners_.size()), uint32_t(piece.size()),
                       float(size / 2), glm::vec3(length > 0 ? normal / length : n[0]),
                       glm::vec4(w.x * colour[0] + w.y * colour[1] + w.z * colour[2])});
    const glm::dvec3 centre = glm::dvec3(cell) + 0.5;
    for (const glm::dvec3& p : piece) corners_.emplace_back(p - centre);
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

void TriangleCutter::appendTo(SurfaceCells& cells) const {
    // Cells in order, and in each the pieces as they were cut.
    std::vector<uint64_t> order(pieces_.size());
    for (size_t i = 0; i < order.size(); ++i) order[i] = uint64_t{pieces_[i].code} << 32 | i;
    sortHighHalves(order, 3 * depth_);
    std::vector<CellPiece> inCell;
    for (size_t i = 0; i < order.size();) {
        const uint32_t code = uint32_t(order[i] >> 32);
        inCell.clear();
        for (; i < order.size() && uint32_t(order[i] >> 32) == code; ++i) inCell.push_back(pieces_[uint32_t(order[i])]);
        cells.codes.push_back(code);
        cells.cells.push_back(sum(inCell));
    }
}

}  // namespace vcp
