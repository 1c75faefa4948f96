#include "mesostructure/remesh/height_deviation.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

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

/// The whole numbers from `first` to `last` that the cells along an axis of something have.
struct Cells {
    int first, last;
};

Cells cellsAlong(const Part& part, int axis) {
    double low = part.corners[0][axis], high = low;
    for (int k = 1; k < part.count; ++k) {
        low = std::min(low, part.corners[size_t(k)][axis]);
        high = std::max(high, part.corners[size_t(k)][axis]);
    }
    // What only touches the next cell is in this one.
    const double first = std::floor(low);
    return {int(first), int(std::max(std::ceil(high) - 1, first))};
}

/// Looks for the most that the map differs from a triangle, in blocks of texels of which that is not known already.
class Search {
public:
    Search(const HeightLevel& map, const Part& triangle, DeviationSearch& search)
        : map_(map),
          triangle_(triangle),
          plane_(triangle),
          columns_(cellsAlong(triangle, 0)),
          rows_(cellsAlong(triangle, 1)),
          search_(search),
          most_(search.known) {
        least_ = highest_ = triangle.corners[0].z;
        for (int k = 1; k < 3; ++k) {
            least_ = std::min(least_, triangle.corners[size_t(k)].z);
            highest_ = std::max(highest_, triangle.corners[size_t(k)].z);
        }
        const glm::dvec2 a(triangle.corners[1] - triangle.corners[0]), b(triangle.corners[2] - triangle.corners[0]);
        const double area = a.x * b.y - a.y * b.x;
        hasPlane_ = std::abs(area) > 1e-6 * (glm::dot(a, a) + glm::dot(b, b));
        turned_ = area < 0 ? -1 : 1;
    }

    double run() {
        constexpr int kFew = HeightRanges::kBlock;
        const int widest = std::max(columns_.last - columns_.first, rows_.last - rows_.first) + 1;
        if (search_.ranges == nullptr || search_.ranges->levels() == 0) {
            look(columns_, rows_);
            return most_;
        }
        int level = 0;
        while (level + 1 < search_.ranges->levels() && (kFew << level) < widest) ++level;
        const auto blockOf = [&](int texel, int size, int blocks) {
            const int tile = remaindered(texel, size).first;
            return tile * blocks + (texel - tile * size) / (kFew << level);
        };
        const glm::ivec2 size = map_.size, blocks = search_.ranges->blocks(level);
        const int left = blockOf(columns_.first, size.x, blocks.x), right = blockOf(columns_.last, size.x, blocks.x),
                  low = blockOf(rows_.first, size.y, blocks.y), high = blockOf(rows_.last, size.y, blocks.y);
        for (int j = low; j <= high; ++j)
            for (int i = left; i <= right; ++i) searchBlock(level, {i, j});
        return most_;
    }

private:
    /// Returns whole quotient and remainder, of numbers of either sign.
    static std::pair<int, int> remaindered(int i, int n) {
        const int rest = wrapped(i, n);
        return {(i - rest) / n, rest};
    }

    /// The cells of a block that the triangle's box has.
    [[nodiscard]] static Cells cellsOf(int level, int block, int blocks, int size, Cells within) {
        const auto [tile, local] = remaindered(block, blocks);
        const int width = HeightRanges::kBlock << level, from = tile * size + local * width,
                  to = tile * size + std::min((local + 1) * width, size) - 1;
        return {std::max(from, within.first), std::min(to, within.last)};
    }

    void searchBlock(int level, glm::ivec2 block) {
        const glm::ivec2 blocks = search_.ranges->blocks(level);
        const Cells columns = cellsOf(level, block.x, blocks.x, map_.size.x, columns_),
                    rows = cellsOf(level, block.y, blocks.y, map_.size.y, rows_);
        if (columns.first > columns.last || rows.first > rows.last || most_ > search_.enough) return;
        if (mostOver(level, block, columns, rows) <= most_) return;
        const int side = sideOf(columns, rows);
        if (side < 0) return;
        if (level == 0) {
            side > 0 ? lookAtWhole(columns, rows) : look(columns, rows);
            return;
        }
        const glm::ivec2 finer = search_.ranges->blocks(level - 1);
        const auto [tileX, x] = remaindered(block.x, blocks.x);
        const auto [tileY, y] = remaindered(block.y, blocks.y);
        for (int j = 2 * y; j < std::min(2 * y + 2, finer.y); ++j)
            for (int i = 2 * x; i < std::min(2 * x + 2, finer.x); ++i)
                searchBlock(level - 1, {tileX * finer.x + i, tileY * finer.y + j});
    }

    /// Returns what no difference over a block's cells comes above.
    [[nodiscard]] double mostOver(int level, glm::ivec2 block, Cells columns, Cells rows) const {
        const glm::ivec2 blocks = search_.ranges->blocks(level);
        const HeightRanges::Range& range =
            search_.ranges->of(level, {wrapped(block.x, blocks.x), wrapped(block.y, blocks.y)});
        double low = 1e300, high = -1e300;
        for (const int x : {columns.first, columns.last + 1})
            for (const int y : {rows.first, rows.last + 1}) {
                const double at = plane_.at(x, y);
                low = std::min(low, at), high = std::max(high, at);
            }
        // Within the triangle heights are between those of its corners; a sliver's plane is not known well.
        if (!hasPlane_ || !(low >= least_ && low <= highest_)) low = least_;
        if (!hasPlane_ || !(high >= least_ && high <= highest_)) high = highest_;
        return std::max(range.most * (1 / 65535.0) - low, high - range.least * (1 / 65535.0));
    }

    /// How a block lies: 1 within the triangle, -1 all of it beyond one of the sides, else 0.
    [[nodiscard]] int sideOf(Cells columns, Cells rows) const {
        const auto& c = triangle_.corners;
        const double left = columns.first, right = columns.last + 1, low = rows.first, high = rows.last + 1;
        bool isWithin = true;
        for (size_t k = 0; k < 3; ++k) {
            const glm::dvec3 &a = c[k], &b = c[(k + 1) % 3];
            const double x = turned_ * (b.x - a.x), y = turned_ * (b.y - a.y);
            if (x * ((x > 0 ? high : low) - a.y) - y * ((y > 0 ? left : right) - a.x) < 0) return -1;
            isWithin = isWithin && x * ((x > 0 ? low : high) - a.y) - y * ((y > 0 ? right : left) - a.x) > 0;
        }
        return isWithin ? 1 : 0;
    }

    /// Looks at the texels at the corners of cells that all lie in the triangle.
    void lookAtWhole(Cells columns, Cells rows) {
        search_.looked += uint64_t(columns.last - columns.first + 1) * uint64_t(rows.last - rows.first + 1);
        for (int j = rows.first; j <= rows.last + 1; ++j)
            most_ = std::max(most_, deviationAt(map_, Rows(map_, j).low, 1 / 65535.0, columns.first, columns.last + 1,
                                                plane_.at(columns.first, j), plane_.byX()));
    }

    /// Looks at all the cells of some columns and rows.
    void look(Cells columns, Cells rows) {
        for (int j = rows.first; j <= rows.last; ++j) {
            const Part row = rows_.first == rows_.last ? triangle_ : keptOf(keptOf(triangle_, 1, j, 1), 1, j + 1, -1);
            if (row.count == 0) continue;
            const Rows texels(map_, j);
            const Cells cut = cellsAlong(row, 0);
            const int left = std::max(cut.first, columns.first), right = std::min(cut.last, columns.last);
            if (left > right) continue;
            search_.looked += uint64_t(right - left + 1);
            const auto [wholeFirst, wholeLast] = plane_.wholeCells(j);
            const double first = std::max(wholeFirst, double(left)), last = std::min(wholeLast, right + 1.0);
            if (first < last) {
                const int a = int(first), b = int(last);
                most_ = std::max(most_,
                                 deviationAt(map_, texels.low, texels.unit, a, b, plane_.at(first, j), plane_.byX()));
                most_ = std::max(
                    most_, deviationAt(map_, texels.high, texels.unit, a, b, plane_.at(first, j + 1), plane_.byX()));
            }
            for (int i = left; i <= right; ++i) {
                if (i == first && first < last) i = int(last);
                if (i > right || most_ > search_.enough) break;
                const Part part = cut.first == cut.last ? row : keptOf(keptOf(row, 0, i, 1), 0, i + 1, -1);
                if (part.count > 0) most_ = std::max(most_, deviationIn(texels, i, j, part));
            }
            if (most_ > search_.enough) return;
        }
    }

    const HeightLevel& map_;
    const Part& triangle_;
    Plane plane_;
    Cells columns_, rows_;
    DeviationSearch& search_;
    double most_, least_, highest_, turned_;
    bool hasPlane_;
};

}  // namespace

double heightDeviation(const HeightLevels& levels, const std::array<HeightCorner, 3>& corners,
                       DeviationSearch& search) {
    const glm::dvec2 texels = levels.texels();
    Part whole;
    whole.count = 3;
    for (size_t k = 0; k < 3; ++k) whole.corners[k] = {corners[k].at * texels, corners[k].height};
    return Search(levels.levels().front(), whole, search).run();
}

}  // namespace vcp::meso
