#include "mesostructure/remesh/height_deviation.h"

#include <algorithm>
#include <cmath>

namespace vcp::meso {

namespace {

/// A convex part of the triangle, in texels; z is the triangle's height. Each of four lines adds a corner at most.
struct Part {
    std::array<glm::dvec3, 8> corners;
    int count = 0;
};

/// Keeps what is on one side of a line across an axis.
Part keptOf(const Part& part, int axis, double at, double sign) {
    Part kept;
    for (int k = 0; k < part.count; ++k) {
        const glm::dvec3 &a = part.corners[size_t(k)], &b = part.corners[size_t((k + 1) % part.count)];
        const double from = sign * (a[axis] - at), to = sign * (b[axis] - at);
        if (from >= 0) kept.corners[size_t(kept.count++)] = a;
        if ((from > 0 && to < 0) || (from < 0 && to > 0)) {
            glm::dvec3 on = a + (b - a) * (from / (from - to));
            on[axis] = at;
            kept.corners[size_t(kept.count++)] = on;
        }
    }
    return kept;
}

/// Within a cell of the map the difference has no extreme but at its border (it is linear along x and along y), and
/// along a straight line it is quadratic.
double deviationIn(const HeightLevel& map, int i, int j, const Part& part) {
    const double h00 = map.at(i, j), h10 = map.at(i + 1, j), h01 = map.at(i, j + 1), h11 = map.at(i + 1, j + 1);
    const double twist = h00 - h10 - h01 + h11;
    const auto differenceAt = [&](const glm::dvec3& p) {
        const double u = p.x - i, v = p.y - j;
        return h00 + (h10 - h00) * u + (h01 - h00) * v + twist * u * v - p.z;
    };
    double most = 0, from = differenceAt(part.corners[0]);
    for (int k = 0; k < part.count; ++k) {
        const glm::dvec3 &a = part.corners[size_t(k)], &b = part.corners[size_t((k + 1) % part.count)];
        const double to = differenceAt(b), bend = twist * (b.x - a.x) * (b.y - a.y), slope = to - from - bend;
        most = std::max(most, std::abs(to));
        // from + slope t + bend t^2
        if (const double t = -slope / (2 * bend); t > 0 && t < 1)
            most = std::max(most, std::abs(from - slope * slope / (4 * bend)));
        from = to;
    }
    return most;
}

}  // namespace

double heightDeviation(const HeightLevels& levels, const std::array<HeightCorner, 3>& corners, double enough) {
    const HeightLevel& map = levels.levels().front();
    const glm::dvec2 texels = levels.texels();
    Part whole;
    whole.count = 3;
    for (size_t k = 0; k < 3; ++k) whole.corners[k] = {corners[k].at * texels, corners[k].height};
    const auto rangeOf = [](const Part& part, int axis) {
        double low = part.corners[0][axis], high = low;
        for (int k = 1; k < part.count; ++k) {
            low = std::min(low, part.corners[size_t(k)][axis]);
            high = std::max(high, part.corners[size_t(k)][axis]);
        }
        // What only touches the next cell is in this one.
        const double first = std::floor(low);
        return std::pair(first, std::max(std::ceil(high) - 1, first));
    };
    double most = 0;
    const auto [bottom, top] = rangeOf(whole, 1);
    for (double j = bottom; j <= top; ++j) {
        const Part row = bottom == top ? whole : keptOf(keptOf(whole, 1, j, 1), 1, j + 1, -1);
        if (row.count == 0) continue;
        const auto [left, right] = rangeOf(row, 0);
        for (double i = left; i <= right; ++i) {
            const Part part = left == right ? row : keptOf(keptOf(row, 0, i, 1), 0, i + 1, -1);
            if (part.count > 0) most = std::max(most, deviationIn(map, int(i), int(j), part));
            if (most > enough) return most;
        }
    }
    return most;
}

}  // namespace vcp::meso
