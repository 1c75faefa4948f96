// Splines, and ellipses swept along them: what limbs, feathers and robes are made of.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "datasets_scripts/procedural_noise.h"

namespace vcp::scan {

/// A uniform cubic B-spline that starts at the first and ends at the last control point.
class Spline {
public:
    explicit Spline(std::vector<glm::dvec3> points) : points_(std::move(points)) {
        // Mirrored phantom ends make the curve reach its end points.
        points_.insert(points_.begin(), 2.0 * points_[0] - points_[1]);
        points_.push_back(2.0 * points_.back() - points_[points_.size() - 2]);
    }

    [[nodiscard]] glm::dvec3 at(double t) const {
        const auto [p, f] = segment(t);
        const double g = 1 - f;
        return (g * g * g * p[0] + (3 * f * f * f - 6 * f * f + 4) * p[1] + (3 * g * g * g - 6 * g * g + 4) * p[2] +
                f * f * f * p[3]) /
               6.0;
    }

    [[nodiscard]] glm::dvec3 tangent(double t) const {
        const auto [p, f] = segment(t);
        const double g = 1 - f;
        return glm::normalize(-g * g * p[0] + (3 * f * f - 4 * f) * p[1] - (3 * g * g - 4 * g) * p[2] + f * f * p[3]);
    }

private:
    struct Segment {
        const glm::dvec3* points;
        double fraction;
    };
    [[nodiscard]] Segment segment(double t) const {
        const auto count = int(points_.size()) - 3;
        const double x = std::clamp(t, 0.0, 1.0) * count;
        const int i = std::min(int(x), count - 1);
        return {points_.data() + i, x - i};
    }

    std::vector<glm::dvec3> points_;
};

/// Where a point of a sweep lies before it is displaced.
struct SweepPoint {
    glm::dvec3 centre, outward, position;  ///< `outward`: unit, in the plane of the cross-section
    double u = 0, along = 0;               ///< around in turns; along the axis in [0, 1]
    double end = 1;                        ///< falls to 0 towards the two poles
};

/// An ellipse swept along a spline, with rounded ends.
struct Sweep {
    Spline axis;
    Spline radii;         ///< x: half width along the side, y: half width along the front
    glm::dvec3 front;     ///< what the second half width points to, roughly
    double capAxial = 0;  ///< part of the axis that each rounded end takes
    double capShare = 0;  ///< part of v that each rounded end takes

    [[nodiscard]] SweepPoint at(double u, double v) const {
        SweepPoint point;
        point.u = u;
        point.along = v;
        if (v < capShare || v > 1 - capShare) {
            const bool low = v < capShare;
            const double angle = (low ? v : 1 - v) / capShare * 0.25;
            point.end = sinTurns(angle);
            const double depth = capAxial * (1 - cosTurns(angle));
            point.along = low ? depth : 1 - depth;
        } else {
            point.along = capAxial + (v - capShare) / (1 - 2 * capShare) * (1 - 2 * capAxial);
        }
        const glm::dvec3 tangent = axis.tangent(point.along);
        const glm::dvec3 side = glm::normalize(glm::cross(front, tangent));
        const glm::dvec3 up = glm::cross(tangent, side);
        const glm::dvec3 radius = radii.at(point.along);
        const glm::dvec3 offset = side * (radius.x * cosTurns(u)) + up * (radius.y * sinTurns(u));
        point.centre = axis.at(point.along);
        point.outward = offset / std::max(glm::length(offset), 1e-9);
        point.position = point.centre + offset * point.end;
        return point;
    }
};

}  // namespace vcp::scan
