// An upper bound on the distance of every point of one triangle to a set of others.
//
// The triangle is cut by the upright prisms over the others. The part inside a prism is as far from its triangle
// as from its plane, the rest is handed on to the next. What no prism holds (beyond a ridge or a border) is
// as far from one triangle as the farthest of its corners is, for the distance to a convex set is convex.
// So every point is accounted for and nothing is sampled.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include <glm/vec3.hpp>

#include "builder/lattice/triangle_geometry.h"

namespace vcp {

/// A triangle with its plane and, upright on it, a plane through each edge (positive outside).
struct TrianglePrism {
    static constexpr int kPlanes = 4, kOwn = 3;  ///< the sides come first
    /// One value for each plane, in a vector register. Passed by reference only: passed by value it would depend on the
    /// processor, as the alignment would if it were not given.
    using Heights = double __attribute__((vector_size(kPlanes * sizeof(double)), aligned(kPlanes * sizeof(double))));

    Triangle3 corners;
    Heights x{}, y{}, z{}, offset{};  ///< the planes' unit normals, by axis, and their offsets
    double extra = 0;                 ///< added to distances to it
    double cornerFactor = 1;          ///< a point outside of all its sides by x at once is at most x times this off
    bool isNeedle = false;            ///< too thin for its prism to be certain; measured only by the convex bound

    TrianglePrism() = default;
    /// `corners` must span an area.
    explicit TrianglePrism(const Triangle3& corners, double extra = 0);

    /// Sets the heights of a point over each plane.
    void heights(glm::dvec3 p, Heights& h) const { h = x * p.x + y * p.y + z * p.z - offset; }
    /// Returns the distance of a point from the triangle's own plane.
    [[nodiscard]] double away(glm::dvec3 p) const {
        return std::abs(x[kOwn] * p.x + y[kOwn] * p.y + z[kOwn] * p.z - offset[kOwn]);
    }
};

class TriangleCover {
public:
    /// Bounds below `enough` are not worth improving.
    explicit TriangleCover(double enough) : enough_(enough) {}

    /// Bounds the distance (plus its `extra`) of all points of `triangle` to the nearest of `others`. `others` are
    /// tried in their order, so near ones should come first. `worst[i]`, if given, grows to the bound of what was
    /// measured against others[i]. Infinite where there are none.
    double bound(const Triangle3& triangle, std::span<const TrianglePrism* const> others, std::span<double> worst = {});

private:
    struct Polygon;
    struct PolygonHeights;
    struct Match {
        double distance = std::numeric_limits<double>::infinity();
        size_t other = 0;
    };
    double cover(const Polygon& polygon, size_t first, Match best);
    struct Pieces;
    static const Polygon* split(const TrianglePrism& other, double room, const Polygon& polygon,
                                PolygonHeights& heights, Pieces& pieces);
    double settle(const Polygon& polygon, Match best, int halvings);
    double record(const Match& match);

    double enough_;
    std::span<const TrianglePrism* const> others_;
    std::span<double> worst_;
};

}  // namespace vcp
