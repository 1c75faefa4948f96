#include "mesostructure/remesh/height_deviation.h"

#include <algorithm>
#include <cmath>
#include <utility>

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

/// Two rows of the map's texels, the lower one first.
struct Rows {
    const HeightLevel& map;
    const uint16_t *low, *high;
    double unit = 1 / 65535.0;

    Rows(const HeightLevel& of, int j) : map(of), low(rowOf(of, j)), high(rowOf(of, j + 1)) {}

private:
    static const uint16_t* rowOf(const HeightLevel& of, int j) {
        return &of.texels[size_t(of.size.x) * size_t(wrapped(j, of.size.y))];
    }
};

/// Within a cell of the map the difference has no extreme but at its border (it is linear along x and along y), and
/// along a straight line it is quadratic.
double deviationIn(const Rows& rows, int i, int j, const Part& part) {
    const int left = wrapped(i, rows.map.size.x), right = left + 1 < rows.map.size.x ? left + 1 : 0;
    const double h00 = rows.low[left] * rows.unit, h10 = rows.low[right] * rows.unit, h01 = rows.high[left] * rows.unit,
                 h11 = rows.high[right] * rows.unit;
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

/// A triangle's height over the map, and where its sides are.
class Plane {
public:
    explicit Plane(const Part& triangle) : corners_{triangle.corners[0], triangle.corners[1], triangle.corners[2]} {
        const glm::dvec3 a = corners_[1] - corners_[0], b = corners_[2] - corners_[0];
        const double area = a.x * b.y - a.y * b.x;
        byX_ = (a.z * b.y - a.y * b.z) / area, byY_ = (a.x * b.z - a.z * b.x) / area;
    }
    [[nodiscard]] double at(double x, double y) const {
        return corners_[0].z + byX_ * (x - corners_[0].x) + byY_ * (y - corners_[0].y);
    }
    [[nodiscard]] double byX() const { return byX_; }

    /// Returns the first and the last of the map's lines along y between which whole cells of a row lie in the
    /// triangle; none where the first is not before the last. A line of the map meets the triangle in one stretch.
    [[nodiscard]] std::pair<double, double> wholeCells(double row) const {
        double first = -1e300, last = 1e300;
        for (const double y : {row, row + 1}) {
            double low = 1e300, high = -1e300;
            for (size_t k = 0; k < 3; ++k) {
                const glm::dvec3 &a = corners_[k], &b = corners_[(k + 1) % 3];
                if (std::min(a.y, b.y) > y || std::max(a.y, b.y) < y) continue;
                if (a.y == b.y) {
                    low = std::min({low, a.x, b.x}), high = std::max({high, a.x, b.x});
                    continue;
                }
                const double x = a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y));
                low = std::min(low, x), high = std::max(high, x);
            }
            first = std::max(first, std::ceil(low)), last = std::min(last, std::floor(high));
        }
        return {first, last};
    }

private:
    std::array<glm::dvec3, 3> corners_;
    double byX_ = 0, byY_ = 0;
};

/// Over whole cells the difference is linear along the map's lines: its extremes are at texels. Returns the most at
/// those from `first` to `last` of a row.
double deviationAt(const HeightLevel& map, const uint16_t* row, double unit, int first, int last, double from,
                   double byX) {
    double most = 0;
    for (int i = first, x = wrapped(first, map.size.x); i <= last; x = 0) {
        const int run = std::min(last - i + 1, map.size.x - x);
        for (int k = 0; k < run; ++k)
            most = std::max(most, std::abs(row[x + k] * unit - (from + byX * double(i - first + k))));
        i += run;
    }
    return most;
}

/// Returns the first and the last of the cells along an axis that something is in.
std::pair<int, int> cellsAlong(const Part& part, int axis) {
    double low = part.corners[0][axis], high = low;
    for (int k = 1; k < part.count; ++k) {
        low = std::min(low, part.corners[size_t(k)][axis]);
        high = std::max(high, part.corners[size_t(k)][axis]);
    }
    // What only touches the next cell is in this one.
    const double first = std::floor(low);
    return {int(first), int(std::max(std::ceil(high) - 1, first))};
}

}  // namespace

double heightDeviation(const HeightLevels& levels, const std::array<HeightCorner, 3>& corners,
                       DeviationSearch& search) {
    const HeightLevel& map = levels.levels().front();
    const glm::dvec2 texels = levels.texels();
    Part whole;
    whole.count = 3;
    for (size_t k = 0; k < 3; ++k) whole.corners[k] = {corners[k].at * texels, corners[k].height};
    const Plane plane(whole);
    double most = search.known;
    const auto [bottom, top] = cellsAlong(whole, 1);
    for (int j = bottom; j <= top; ++j) {
        const Part row = bottom == top ? whole : keptOf(keptOf(whole, 1, j, 1), 1, j + 1, -1);
        if (row.count == 0) continue;
        const Rows rows(map, j);
        const auto [left, right] = cellsAlong(row, 0);
        search.looked += uint64_t(right - left + 1);
        const auto [first, last] = plane.wholeCells(j);
        if (first < last) {
            const int a = int(first), b = int(last);
            most = std::max(most, deviationAt(map, rows.low, rows.unit, a, b, plane.at(first, j), plane.byX()));
            most = std::max(most, deviationAt(map, rows.high, rows.unit, a, b, plane.at(first, j + 1), plane.byX()));
        }
        for (int i = left; i <= right; ++i) {
            if (i == first && first < last) i = int(last);
            if (i > right || most > search.enough) break;
            const Part part = left == right ? row : keptOf(keptOf(row, 0, i, 1), 0, i + 1, -1);
            if (part.count > 0) most = std::max(most, deviationIn(rows, i, j, part));
        }
        if (most > search.enough) return most;
    }
    return most;
}

}  // namespace vcp::meso
