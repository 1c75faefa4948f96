// Exact-enough predicates on triangles in double precision: closest point, box overlap, clipping.
// Coordinates are multiples of 1/2048 below 2^10, so differences are exact.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace vcp {

using Triangle3 = std::array<glm::dvec3, 3>;

struct ClosestPoint {
    glm::dvec3 offset{0};         ///< closest point minus query
    double squared = 0;           ///< its squared length
    glm::dvec3 weights{1, 0, 0};  ///< barycentric, of the three corners
};

/// Finds the closest point of a triangle, which may be a segment or a point. All three edges are always looked at and
/// coordinates are taken about the query, so slivers cost no accuracy (Heidrich 2005 for the interior).
ClosestPoint closestOnTriangle(glm::dvec3 query, const Triangle3& triangle);

/// Squared distances of a query to several triangles at once: those of closestOnTriangle, except for the last bits.
struct TriangleBatch {
    static constexpr int kSize = 8;
    alignas(64) float corners[9][kSize];  ///< x, y, z of each triangle's first, second and third corner
    alignas(64) double squared[kSize];
};
void squaredDistances(glm::dvec3 query, TriangleBatch& batch);

/// Overlap of a triangle with cubes: the separating axis test (Akenine-Moller 2001), on closed sets and
/// widened by 1e-9, so that a touching triangle always overlaps.
class BoxOverlap {
public:
    explicit BoxOverlap(const Triangle3& triangle);
    [[nodiscard]] bool test(glm::dvec3 centre, double half) const;
    [[nodiscard]] glm::dvec3 lower() const { return lower_; }
    [[nodiscard]] glm::dvec3 upper() const { return upper_; }

private:
    Triangle3 t_;
    std::array<glm::dvec3, 3> edge_;
    glm::dvec3 normal_, lower_, upper_;
};

/// Whether a segment meets a closed cube.
bool segmentMeetsBox(glm::dvec3 a, glm::dvec3 b, glm::dvec3 centre, double half);

/// A convex polygon: a triangle cut by the six planes of a box.
class Polygon {
public:
    /// 9 corners at most in theory; but rounding may bend an edge, and a plane then cuts more than two.
    static constexpr size_t kMaxCorners = 16;
    [[nodiscard]] size_t size() const { return size_; }
    [[nodiscard]] bool empty() const { return size_ == 0; }
    void clear() { size_ = 0; }
    void add(glm::dvec3 p) {
        assert(size_ < kMaxCorners);
        corners_[size_++] = p;
    }
    const glm::dvec3& operator[](size_t i) const { return corners_[i]; }
    [[nodiscard]] const glm::dvec3* begin() const { return corners_.data(); }
    [[nodiscard]] const glm::dvec3* end() const { return corners_.data() + size_; }

private:
    std::array<glm::dvec3, kMaxCorners> corners_;
    size_t size_ = 0;
};

/// Returns the least and the largest coordinate of a polygon along an axis.
std::pair<double, double> extentOf(const Polygon& polygon, int axis);

/// The parts of a polygon on both sides of a plane; null where there is none.
struct PolygonSides {
    const Polygon *below, *above;
};

/// Parts a polygon at the plane where coordinate `axis` is `at`. A part is the polygon itself, or made in `below` or
/// `above`; a polygon in the plane is on both sides.
PolygonSides partAt(const Polygon& polygon, int axis, double at, Polygon& below, Polygon& above);

/// Clips a triangle to a box; `polygon` receives its corners in order (none: outside).
void clipToBox(const Triangle3& triangle, glm::dvec3 lower, glm::dvec3 upper, Polygon& polygon);

}  // namespace vcp
