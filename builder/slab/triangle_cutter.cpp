#include "builder/slab/triangle_cutter.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/type_precision.hpp>
#include <glm/vector_relational.hpp>

#include "builder/stream/colour_encoding.h"
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

namespace {

glm::dvec4 lightOfColour(const glm::dvec4& stored) {
    return {lightOfStored(stored.r), lightOfStored(stored.g), lightOfStored(stored.b), stored.a};
}

/// Returns the mean light of a triangle over which stored colours are blended, by the six points of Dunavant's rule of
/// degree 4 (High degree efficient symmetrical Gaussian quadrature rules for the triangle, 1985, table II).
glm::dvec4 meanLight(const glm::dvec4& a, const glm::dvec4& b, const glm::dvec4& c) {
    const auto three = [&](double apart) {
        const glm::dvec4 rest = apart * (a + b + c);
        const double own = 1 - 3 * apart;
        return lightOfColour(rest + own * a) + lightOfColour(rest + own * b) + lightOfColour(rest + own * c);
    };
    return 0.109951743655322 * three(0.091576213509771) + 0.223381589678011 * three(0.445948490915965);
}

}  // namespace

// Pictures blend stored colours over a triangle and take their light, whose mean a fan of triangles sums up.
glm::vec4 TriangleCutter::lightOf(const Polygon& piece) const {
    if (mesh_.colours.empty()) return glm::vec4(1);
    if (source_.isPlain) return glm::vec4(lightOfColour(source_.colour[0]));
    const auto storedAt = [&](const glm::dvec3& p) {
        const glm::dvec3 w = source_.weightsAt(p);
        return w.x * source_.colour[0] + w.y * source_.colour[1] + w.z * source_.colour[2];
    };
    const glm::dvec4 first = storedAt(piece[0]);
    glm::dvec4 before = storedAt(piece[1]), sum(0);
    double area = 0;
    for (size_t i = 2; i < piece.size(); ++i) {
        const glm::dvec4 after = storedAt(piece[i]);
        const double share = glm::length(glm::cross(piece[i - 1] - piece[0], piece[i] - piece[0]));
        sum += share * meanLight(first, before, after);
        area += share;
        before = after;
    }
    return glm::vec4(sum / area);
}

TriangleCutter::Source TriangleCutter::sourceOf(uint32_t triangle) const {
    const auto& t = mesh_.triangles[triangle];
    Source source;
    source.parts = mesh_.kindOf(triangle);
    for (size_t i = 0; i < 3; ++i)
        source.corners[i] = glm::dvec3(mesh_.positions[t[i]] - origin_) * (2.0 / double(kLatticePerCell));
    const auto& [a, b, c] = source.corners;
    const glm::dvec3 cross = glm::cross(b - a, c - a);
    const double squared = glm::dot(cross, cross);
    source.secondGrows = glm::cross(c - a, cross) / squared;
    source.thirdGrows = glm::cross(cross, b - a) / squared;
    const glm::dvec3 flat = cross / std::sqrt(squared);
    for (size_t i = 0; i < 3; ++i) source.normal[i] = f64::cornerNormal(mesh_.normalOf(triangle, i), flat);
    if (mesh_.colours.empty()) return source;
    for (size_t i = 0; i < 3; ++i)
        for (int k = 0; k < 4; ++k) source.colour[i][k] = double(mesh_.colours[t[i]] >> 8 * k & 255u) / 255;
    source.isPlain = mesh_.colours[t[0]] == mesh_.colours[t[1]] && mesh_.colours[t[0]] == mesh_.colours[t[2]];
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

TriangleCutter::CellRange TriangleCutter::cellsOf(const Polygon& piece, const CutterBox& whole) {
    CellRange cells;
    for (int axis = 0; axis < 3; ++axis) {
        // A piece that only reaches a wall is in the cell that it comes from; one in a wall is on both sides of it.
        // No coordinate is negative, so conversion rounds down.
        const auto [least, most] = extentOf(piece, axis);
        const int begin = int(least), end = int(most);
        const bool endsInWall = double(end) == most, isInWall = endsInWall && least == most;
        cells.endInWall |= endsInWall || double(begin) == least;
        const int lower = whole.lower[axis], upper = lower + (1 << whole.log2Edge) - 1;
        cells.first[axis] = std::clamp(begin - (isInWall ? 1 : 0), lower, upper);
        cells.last[axis] = std::clamp(end - (endsInWall && !isInWall ? 1 : 0), lower, upper);
    }
    return cells;
}

bool TriangleCutter::isWanted(const CutterBox& box) const {
    const int bits = std::max(box.log2Edge, within_.log2Edge);
    return (box.lower >> bits) == (within_.lower >> bits);
}

void TriangleCutter::split(const Polygon& piece, const CutterBox& whole) {
    const CellRange cells = cellsOf(piece, whole);
    const CutterBox box = cells.box();
    if (!isWanted(box)) return;
    // Rounding may carry what is cut across a wall that the piece ended in: then it is cut there as well, box by box.
    if (cells.walls() == 0 || (cells.walls() <= kMostWalls && !cells.endInWall)) return cutAtWalls(piece, cells);
    const glm::dvec3 middle(box.child(7).lower);
    Polygon room[3][2];
    const auto sidesOf = [&](const Polygon& part, int axis) -> PolygonSides {
        const int bit = box.log2Edge - 1, first = cells.first[axis] >> bit & 1, last = cells.last[axis] >> bit & 1;
        if (first != last) return partAt(part, axis, middle[axis], room[axis][0], room[axis][1]);
        return {first == 0 ? &part : nullptr, first == 1 ? &part : nullptr};
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

void TriangleCutter::cutAtWalls(const Polygon& piece, const CellRange& cells) {
    struct Wall {
        int axis, at, order;
    };
    // In the octree's order, which rounding depends on: those of large boxes first.
    std::array<Wall, kMostWalls> walls;
    int count = 0;
    for (int axis = 0; axis < 3; ++axis)
        for (int at = cells.first[axis] + 1; at <= cells.last[axis]; ++at) {
            const Wall wall{axis, at, axis - 3 * std::countr_zero(unsigned(at))};
            int place = count++;
            for (; place > 0 && walls[size_t(place) - 1].order > wall.order; --place)
                walls[size_t(place)] = walls[size_t(place) - 1];
            walls[size_t(place)] = wall;
        }
    struct Part {
        const Polygon* polygon;
        glm::ivec3 cell;  ///< the last one that it can be in
    };
    std::array<Part, kMostParts> parts;
    parts[0] = {&piece, cells.last};
    size_t made = 1, taken = 0;
    for (int w = 0; w < count; ++w) {
        const auto [axis, at, order] = walls[size_t(w)];
        for (size_t i = 0, end = made; i < end; ++i) {
            if (parts[i].cell[axis] < at) continue;
            const PolygonSides sides = partAt(*parts[i].polygon, axis, at, room_[taken], room_[taken + 1]);
            if (sides.below == &room_[taken]) taken += 2;
            if (sides.below == nullptr) continue;
            Part& below = sides.above == nullptr ? parts[i] : parts[made++];
            below = {sides.below, parts[i].cell};
            below.cell[axis] = at - 1;
            if (sides.above != nullptr) parts[i].polygon = sides.above;
        }
    }
    for (size_t i = 0; i < made; ++i)
        if (isWanted({parts[i].cell, 0})) keep(*parts[i].polygon, parts[i].cell);
}

void TriangleCutter::keep(const Polygon& piece, glm::ivec3 cell) {
    const double size = glm::length(areaVector(piece));
    if (size == 0) return;
    glm::dvec3 middle(0);
    for (const glm::dvec3& p : piece) middle += p;
    const glm::dvec3 w = source_.weightsAt(middle / double(piece.size()));
    const auto& n = source_.normal;
    const glm::dvec3 normal = w.x * n[0] + w.y * n[1] + w.z * n[2];
    const double length = glm::length(normal);
    CellPiece& kept = pieces_.emplace_back();
    kept.code = uint32_t(mortonEncode(glm::u32vec3(cell)));
    kept.first = uint32_t(corners_.size());
    kept.count = uint32_t(piece.size());
    kept.area = float(size / 2);
    kept.normal = glm::vec3(length > 0 ? normal / length : n[0]);
    kept.light = lightOf(piece);
    kept.parts = source_.parts;
    const glm::dvec3 centre = glm::dvec3(cell) + 0.5;
    for (const glm::dvec3& p : piece) corners_.emplace_back(p - centre);
}

CellSurface TriangleCutter::sum(std::span<const uint64_t> pieces) const {
    CellSurface cell;
    cell.lower = glm::vec3(1);
    cell.upper = glm::vec3(-1);
    for (const uint64_t number : pieces) {
        const CellPiece& piece = pieces_[uint32_t(number)];
        const glm::vec3 n = piece.normal;
        const float products[6] = {n.x * n.x, n.y * n.y, n.z * n.z, n.y * n.z, n.z * n.x, n.x * n.y};
        for (size_t k = 0; k < 6; ++k) cell.moment[k] += piece.area * products[k];
        cell.area += piece.area;
        cell.light += piece.area * piece.light;
        cell.parts |= piece.parts;
    }
    chooseAxis(cell);
    double first = 2, last = -2;
    for (const uint64_t number : pieces) {
        const CellPiece& piece = pieces_[uint32_t(number)];
        for (const glm::vec3& x : std::span(corners_).subspan(piece.first, piece.count)) {
            cell.lower = glm::min(cell.lower, x);
            cell.upper = glm::max(cell.upper, x);
            const double along = glm::dot(glm::dvec3(cell.axis), glm::dvec3(x));
            first = std::min(first, along);
            last = std::max(last, along);
        }
    }
    cell.lower -= kRounding;
    cell.upper += kRounding;
    cell.first = float(first) - 2 * kRounding;
    cell.last = float(last) + 2 * kRounding;
    return cell;
}

namespace {

/// Adds parts of a polygon to the eighths of its cell in which they are. Coordinates count from the cell's centre, in
/// its edges.
class EighthSums {
public:
    explicit EighthSums(bool withColour) : withColour_(withColour) {}

    void add(std::span<const glm::vec3> corners, glm::vec4 light) {
        glm::vec3 lower = corners[0], upper = corners[0];
        Polygon piece;
        for (const glm::vec3& x : corners) {
            lower = glm::min(lower, x);
            upper = glm::max(upper, x);
            piece.add(glm::dvec3(x));
        }
        const glm::bvec3 isAbove = glm::greaterThan(lower, glm::vec3(0));
        // Most pieces are in one octant.
        if (glm::all(glm::notEqual(isAbove, glm::lessThan(upper, glm::vec3(0)))))
            return addTo(int(isAbove.x) + 2 * int(isAbove.y) + 4 * int(isAbove.z), piece, light);
        const PolygonSides x = partAt(piece, 0, 0, room_[0], room_[1]);
        for (int i = 0; i < 2; ++i) {
            const Polygon* byX = i == 0 ? x.below : x.above;
            if (byX == nullptr) continue;
            const PolygonSides y = partAt(*byX, 1, 0, room_[2], room_[3]);
            for (int j = 0; j < 2; ++j) {
                const Polygon* byY = j == 0 ? y.below : y.above;
                if (byY == nullptr) continue;
                const PolygonSides z = partAt(*byY, 2, 0, room_[4], room_[5]);
                if (z.below != nullptr) addTo(i + 2 * j, *z.below, light);
                if (z.above != nullptr) addTo(i + 2 * j + 4, *z.above, light);
            }
        }
    }

    /// Appends the eighths of cell `code` that have surface.
    void appendTo(uint32_t code, SurfaceQuarters& quarters) {
        for (uint32_t o = 0; o < 8; ++o) {
            if (lower_[o].x > upper_[o].x) continue;
            quarters.codes.push_back(code << 3 | o);
            quarters.boxes.emplace_back(lower_[o] - 2 * kRounding, upper_[o] + 2 * kRounding);
            if (withColour_) quarters.lights.push_back(light_[o]);
        }
    }

private:
    static std::array<glm::vec3, 8> filled(float value) {
        std::array<glm::vec3, 8> all;
        all.fill(glm::vec3(value));
        return all;
    }

    void addTo(int octant, const Polygon& part, glm::vec4 light) {
        const auto o = size_t(octant);
        const glm::dvec3 centre = octantCentre(uint32_t(octant));
        for (const glm::dvec3& p : part) {
            const glm::vec3 x(2.0 * (p - centre));
            lower_[o] = glm::min(lower_[o], x);
            upper_[o] = glm::max(upper_[o], x);
        }
        if (!withColour_) return;
        const auto area = float(2 * glm::length(areaVector(part)));
        light_[o] += area * glm::vec4(glm::vec3(light), 1);
    }

    bool withColour_;
    std::array<glm::vec3, 8> lower_ = filled(1), upper_ = filled(-1);
    std::array<glm::vec4, 8> light_{};  // sums of area * linear RGB, and area
    std::array<Polygon, 6> room_;
};

}  // namespace

void TriangleCutter::appendEighths(uint32_t code, std::span<const uint64_t> pieces, SurfaceQuarters& quarters) const {
    EighthSums sums(!mesh_.colours.empty());
    for (const uint64_t number : pieces) {
        const CellPiece& piece = pieces_[uint32_t(number)];
        sums.add(std::span(corners_).subspan(piece.first, piece.count), piece.light);
    }
    sums.appendTo(code, quarters);
}

void TriangleCutter::appendTo(SurfaceCells& cells, SurfaceQuarters& quarters) const {
    // Cells in order, and in each the pieces as they were cut.
    std::vector<uint64_t> order(pieces_.size());
    for (size_t i = 0; i < order.size(); ++i) order[i] = uint64_t{pieces_[i].code} << 32 | i;
    sortHighHalves(order, 3 * depth_);
    for (size_t i = 0; i < order.size();) {
        const uint32_t code = uint32_t(order[i] >> 32);
        size_t end = i;
        while (end < order.size() && uint32_t(order[end] >> 32) == code) ++end;
        cells.codes.push_back(code);
        const auto pieces = std::span(order).subspan(i, end - i);
        cells.cells.push_back(sum(pieces));
        appendEighths(code, pieces, quarters);
        i = end;
    }
}

}  // namespace vcp
