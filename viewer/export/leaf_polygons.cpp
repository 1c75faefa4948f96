#include "viewer/export/leaf_polygons.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "builder/measure/mesh_bvh.h"

namespace vcp {

namespace {

glm::dvec4 channelsOf(uint32_t rgba) {
    return glm::dvec4(rgba & 255u, rgba >> 8 & 255u, rgba >> 16 & 255u, rgba >> 24);
}

glm::dvec3 octantOffset(uint32_t octant) { return {octant & 1u, octant >> 1 & 1u, octant >> 2 & 1u}; }

/// The slab of a leaf, in page space: |dot(normal, x) - offset| <= half.
struct Slab {
    glm::dvec3 normal;
    double offset, half;
};

struct Interval {
    double first, last;
};

/// Returns how far the points of a cube reach along the normal.
Interval reachOf(const Slab& slab, const LeafBox& cube) {
    const glm::dvec3 n = slab.normal;
    const double middle = glm::dot(n, cube.low + cube.edge / 2);
    const double half = cube.edge / 2 * (std::abs(n.x) + std::abs(n.y) + std::abs(n.z));
    return {middle - half, middle + half};
}

/// Returns the piece of the plane dot(normal, x) = offset in a cube.
std::vector<ColouredPoint> planeIn(const Slab& slab, double offset, const LeafBox& cube, glm::dvec4 colour) {
    const glm::dvec3 n = slab.normal;
    const glm::dvec3 aside = std::abs(n.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    const glm::dvec3 u = glm::normalize(glm::cross(n, aside)), v = glm::cross(n, u);
    const glm::dvec3 middle = cube.low + cube.edge / 2;
    const glm::dvec3 foot = middle + (offset - glm::dot(n, middle)) * n;
    const double r = 2 * cube.edge;
    return clippedTo(cube, {{foot - r * u - r * v, colour},
                            {foot + r * u - r * v, colour},
                            {foot + r * u + r * v, colour},
                            {foot - r * u + r * v, colour}});
}

/// Returns the corners of what a cube and the slab have in common.
std::vector<glm::dvec3> cornersOf(const Slab& slab, const LeafBox& cube) {
    std::vector<glm::dvec3> corners;
    const auto height = [&](glm::dvec3 x) { return glm::dot(slab.normal, x) - slab.offset; };
    for (uint32_t a = 0; a < 8; ++a) {
        const glm::dvec3 p = cube.low + cube.edge * octantOffset(a);
        if (std::abs(height(p)) <= slab.half) corners.push_back(p);
        for (uint32_t axis = 0; axis < 3; ++axis) {
            if ((a >> axis & 1) != 0) continue;
            const glm::dvec3 q = cube.low + cube.edge * octantOffset(a | 1u << axis);
            for (const double wall : {-slab.half, slab.half}) {
                const double from = height(p) - wall, to = height(q) - wall;
                if ((from < 0) != (to < 0)) corners.push_back(p + from / (from - to) * (q - p));
            }
        }
    }
    return corners;
}

/// Returns the distance of a point from a convex polygon; infinity where it has fewer than three points.
double distanceTo(const std::vector<ColouredPoint>& polygon, glm::dvec3 p) {
    double nearest = std::numeric_limits<double>::infinity();
    for (size_t i = 1; i + 1 < polygon.size(); ++i)
        nearest = std::min(
            nearest, glm::distance(p, closestPointOfTriangle(p, polygon[0].at, polygon[i].at, polygon[i + 1].at)));
    return nearest;
}

double farthestOf(const std::vector<glm::dvec3>& points, const std::vector<ColouredPoint>& polygon) {
    double farthest = 0;
    for (const glm::dvec3& p : points) farthest = std::max(farthest, distanceTo(polygon, p));
    return farthest;
}

/// Whether a polygon is more than a line, beside a length.
bool hasArea(const std::vector<ColouredPoint>& polygon, double edge) {
    glm::dvec3 sum(0);
    for (size_t i = 1; i + 1 < polygon.size(); ++i)
        sum += glm::cross(polygon[i].at - polygon[0].at, polygon[i + 1].at - polygon[0].at);
    return glm::length(sum) > 1e-9 * edge * edge;
}

/// A piece of a plane that stands for what slab and cube have in common.
struct Piece {
    std::vector<ColouredPoint> polygon;
    double farthest = 0;  ///< of what they have in common, from the polygon
    double beyond = 0;    ///< of the polygon, from the slab
};

Piece pieceAt(const Slab& slab, double offset, const LeafBox& cube, glm::dvec4 colour) {
    Piece piece{.polygon = planeIn(slab, offset, cube, colour)};
    piece.farthest = farthestOf(cornersOf(slab, cube), piece.polygon);
    piece.beyond = std::max(std::abs(offset - slab.offset) - slab.half, 0.0);
    return piece;
}

Piece pieceOf(const Slab& slab, const LeafBox& cube, glm::dvec4 colour) {
    const Interval reach = reachOf(slab, cube);
    const Interval common{std::max(reach.first, slab.offset - slab.half),
                          std::min(reach.last, slab.offset + slab.half)};
    if (common.first > common.last) return {};
    // The middle plane where it serves: pieces of one plane meet along their walls.
    Piece middle = pieceAt(slab, slab.offset, cube, colour);
    if (!middle.polygon.empty() && middle.farthest <= cube.edge / 2) return middle;
    const double inset = 0.01 * (reach.last - reach.first);
    const double nearest = std::clamp((common.first + common.last) / 2, reach.first + inset, reach.last - inset);
    Piece other = pieceAt(slab, nearest, cube, colour);
    return middle.polygon.empty() || other.farthest < middle.farthest ? other : middle;
}

/// The field of a soft leaf with the colours of its corners, in leaf space.
class SoftField {
public:
    SoftField(const PageView& page, uint32_t node) : axis_(node >> kSoftAxisShift & 3u) {
        const uint32_t face = node & kLeafIndexMask;
        field_ = f64::decodeLeaf(page.faces[face], page.faces[face + 1], axis_);
        for (uint32_t side = 0; side < 2 && !page.faceColours.empty(); ++side)
            for (uint32_t c = 0; c < 4; ++c) colours_[4 * side + c] = channelsOf(page.faceColours[face + side][int(c)]);
    }

    [[nodiscard]] double value(glm::dvec3 x) const { return f64::leafValue(field_, x); }
    [[nodiscard]] glm::dvec4 colour(glm::dvec3 x) const {
        const glm::dvec3 r = glm::clamp(f64::rotateToAxis(x, axis_), 0.0, 1.0);
        glm::dvec4 sum(0);
        for (uint32_t c = 0; c < 8; ++c) {
            const glm::dvec3 at((c >> 2) & 1u, c & 1u, c >> 1 & 1u);
            const glm::dvec3 w = glm::mix(1.0 - r, r, at);
            sum += w.x * w.y * w.z * colours_[c];
        }
        return sum;
    }
    /// Returns a bound on the second derivatives, in any direction, within [-margin, 1 + margin]^3.
    [[nodiscard]] double curvature(double margin) const;

private:
    f64::LeafField field_;
    uint32_t axis_;
    std::array<glm::dvec4, 8> colours_ = [] {
        std::array<glm::dvec4, 8> white;
        white.fill(glm::dvec4(255));
        return white;
    }();
};

double SoftField::curvature(double margin) const {
    // f has degree 2 along each axis: its Bernstein coefficients follow from 27 values, and bound its derivatives.
    const double length = 1 + 2 * margin;
    double b[3][3][3];
    for (int z = 0; z < 3; ++z)
        for (int y = 0; y < 3; ++y)
            for (int x = 0; x < 3; ++x) b[z][y][x] = value(glm::dvec3(x, y, z) * (length / 2) - margin);
    const auto toBernstein = [](double first, double& middle, double last) {
        middle = 2 * middle - (first + last) / 2;
    };
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) toBernstein(b[i][k][0], b[i][k][1], b[i][k][2]);
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) toBernstein(b[i][0][k], b[i][1][k], b[i][2][k]);
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) toBernstein(b[0][i][k], b[1][i][k], b[2][i][k]);
    const auto at = [&](glm::ivec3 i) { return b[i.z][i.y][i.x]; };
    double sum = 0;
    for (int p = 0; p < 3; ++p)
        for (int q = p; q < 3; ++q) {
            glm::ivec3 alongP(0), alongQ(0), i;
            alongP[p] = 1;
            alongQ[q] = 1;
            double most = 0;
            for (i.z = 0; i.z < 3; ++i.z)
                for (i.y = 0; i.y < 3; ++i.y)
                    for (i.x = 0; i.x < 3; ++i.x) {
                        if (glm::any(glm::greaterThan(i + alongP + alongQ, glm::ivec3(2)))) continue;
                        const double d = at(i + alongP + alongQ) - at(i + alongP) - at(i + alongQ) + at(i);
                        most = std::max(most, std::abs(d) * (p == q ? 2 : 4));
                    }
            sum += (p == q ? 1 : 2) * most * most;
        }
    return std::sqrt(sum) / (length * length);
}

// The six tetrahedra of a cube, around its diagonal from corner 0 to corner 7: two cubes side by side part the square
// between them alike.
constexpr int kTetrahedra[6][4] = {{0, 1, 3, 7}, {0, 1, 5, 7}, {0, 2, 3, 7}, {0, 2, 6, 7}, {0, 4, 5, 7}, {0, 4, 6, 7}};

/// Makes the triangles of a field's linear interpolant on a grid.
class TetrahedraMarch {
public:
    TetrahedraMarch(const SoftField& field, const LeafBox& box, int cubes, double margin, PolygonMesh& out)
        : field_(field), box_(box), cubes_(cubes), margin_(margin), out_(out) {
        const int side = cubes + 1;
        values_.resize(size_t(side) * side * side);
        for (int i = 0; i < int(values_.size()); ++i) values_[i] = field.value(pointOf(i));
    }

    void run() {
        for (int z = 0; z < cubes_; ++z)
            for (int y = 0; y < cubes_; ++y)
                for (int x = 0; x < cubes_; ++x)
                    for (const auto& tetrahedron : kTetrahedra) {
                        std::array<int, 4> corner{};
                        for (int c = 0; c < 4; ++c)
                            corner[c] = indexOf(x + (tetrahedron[c] & 1), y + (tetrahedron[c] >> 1 & 1),
                                                z + (tetrahedron[c] >> 2));
                        add(corner);
                    }
    }

private:
    [[nodiscard]] int indexOf(int x, int y, int z) const { return x + (cubes_ + 1) * (y + (cubes_ + 1) * z); }
    [[nodiscard]] glm::dvec3 pointOf(int i) const {
        const int side = cubes_ + 1;
        return glm::dvec3(i % side, i / side % side, i / side / side) * ((1 + 2 * margin_) / cubes_) - margin_;
    }

    void add(const std::array<int, 4>& corner) {
        std::array<int, 4> below{}, above{};
        int lows = 0, highs = 0;
        for (const int c : corner) (values_[c] < 0 ? below[lows++] : above[highs++]) = c;
        if (lows == 0 || highs == 0) return;
        if (lows == 2) {
            const uint32_t a = crossing(below[0], above[0]), b = crossing(below[0], above[1]),
                           c = crossing(below[1], above[1]), d = crossing(below[1], above[0]);
            addTriangle(a, b, c);
            addTriangle(a, c, d);
        } else if (lows == 1) {
            addTriangle(crossing(below[0], above[0]), crossing(below[0], above[1]), crossing(below[0], above[2]));
        } else {
            addTriangle(crossing(below[0], above[0]), crossing(below[1], above[0]), crossing(below[2], above[0]));
        }
    }

    /// Adds a triangle, turned to where the field grows.
    void addTriangle(uint32_t a, uint32_t b, uint32_t c) {
        const auto at = [&](uint32_t i) { return (out_.points[i].at - box_.low) / box_.edge; };
        const glm::dvec3 n = glm::cross(at(b) - at(a), at(c) - at(a));
        const double length = glm::length(n);
        if (!(length > 0)) return;
        const glm::dvec3 middle = (at(a) + at(b) + at(c)) / 3.0, aside = n * (0.01 / length);
        if (field_.value(middle + aside) < field_.value(middle - aside)) std::swap(b, c);
        out_.triangles.push_back({a, b, c});
    }

    uint32_t crossing(int low, int high) {
        const auto [entry, isNew] = crossings_.try_emplace({low, high}, uint32_t(out_.points.size()));
        if (!isNew) return entry->second;
        const double t = values_[low] / (values_[low] - values_[high]);
        const glm::dvec3 at = glm::mix(pointOf(low), pointOf(high), t);
        out_.points.push_back({box_.low + box_.edge * at, field_.colour(at)});
        return entry->second;
    }

    const SoftField& field_;
    LeafBox box_;
    int cubes_;
    double margin_;
    PolygonMesh& out_;
    std::vector<double> values_;
    std::map<std::pair<int, int>, uint32_t> crossings_;
};

}  // namespace

void PolygonMesh::addPolygon(const std::vector<ColouredPoint>& polygon) {
    if (polygon.size() < 3) return;
    const auto first = uint32_t(points.size());
    points.insert(points.end(), polygon.begin(), polygon.end());
    for (uint32_t i = 1; i + 1 < polygon.size(); ++i) triangles.push_back({first, first + i, first + i + 1});
}

std::vector<ColouredPoint> clippedTo(const LeafBox& box, std::vector<ColouredPoint> polygon) {
    std::vector<ColouredPoint> kept;
    for (int axis = 0; axis < 3; ++axis)
        for (const double side : {1.0, -1.0}) {
            const double wall = side > 0 ? box.low[axis] + box.edge : box.low[axis];
            kept.clear();
            for (size_t i = 0; i < polygon.size(); ++i) {
                const ColouredPoint &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
                const double da = side * (wall - a.at[axis]), db = side * (wall - b.at[axis]);
                if (da >= 0) kept.push_back(a);
                if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
                    const double t = da / (da - db);
                    ColouredPoint cut{a.at + t * (b.at - a.at), a.colour + t * (b.colour - a.colour)};
                    cut.at[axis] = wall;
                    kept.push_back(cut);
                }
            }
            polygon.swap(kept);
        }
    return polygon.size() < 3 ? std::vector<ColouredPoint>() : polygon;
}

PolygonError addSlabLeaf(const PageView& page, uint32_t node, const LeafBox& box, PolygonMesh& out) {
    const uint32_t vector = slabVector(node), code = vectorWord(page.faces, vector), octants = slabOctants(node);
    const glm::dvec4 colour =
        page.faceColours.empty() ? glm::dvec4(255) : channelsOf(vectorWord(page.faceColours, vector));
    Slab slab{f64::decodeDirection(code >> kSlabDirectionShift), f64::slabOffset(code) * box.edge,
              f64::slabHalfThickness(code) * box.edge};
    slab.offset += glm::dot(slab.normal, box.low + box.edge / 2);
    const auto octantOf = [&](uint32_t o) { return LeafBox{box.low + box.edge / 2 * octantOffset(o), box.edge / 2}; };

    // One piece for the whole leaf, where it lies in octants that are named.
    std::vector<ColouredPoint> whole = planeIn(slab, slab.offset, box, colour);
    for (uint32_t o = 0; o < 8; ++o)
        if ((octants >> o & 1) == 0 && hasArea(planeIn(slab, slab.offset, octantOf(o), colour), box.edge))
            whole.clear();
    out.addPolygon(whole);
    PolygonError error;
    for (uint32_t o = 0; o < 8; ++o) {
        if ((octants >> o & 1) == 0) continue;
        const LeafBox octant = octantOf(o);
        const double farthest = farthestOf(cornersOf(slab, octant), whole);
        if (farthest <= octant.edge / 2) {
            error.ofMesh = std::max(error.ofMesh, farthest);
            continue;
        }
        const Piece piece = pieceOf(slab, octant, colour);
        out.addPolygon(piece.polygon);
        error.ofMesh = std::max(error.ofMesh, piece.farthest);
        error.added = std::max(error.added, piece.beyond);
    }
    error.ofMesh += kSlabSlack * box.edge;
    return error;
}

PolygonError addSoftLeaf(const PageView& page, uint32_t node, const LeafBox& box, PolygonMesh& out) {
    constexpr int kMostCubes = 8;
    constexpr double kAdded = 0.1;  // of the page's own error
    const SoftField field(page, node);
    // 3/8 k h^2 twice, by the least slope.
    const auto errorOf = [&](int cubes, double margin) {
        const double h = (1 + 2 * margin) / cubes;
        return 0.75 * field.curvature(margin) * h * h;
    };
    const double wall = 2 * f64::wallTolerance(node), wanted = kAdded * double(page.header.certifiedError) / box.edge;
    int cubes = 1;
    while (cubes < kMostCubes && errorOf(cubes, wall) > wanted) cubes *= 2;
    const double margin = wall > 2.5 * double(kWallRounding) ? std::min(wall + errorOf(cubes, wall), 0.125) : 0;
    TetrahedraMarch(field, box, cubes, margin, out).run();
    return {.added = errorOf(cubes, margin) * box.edge};
}

}  // namespace vcp
