// The height field as a shape: bilinear between its texels, solved in closed form cell by cell.
#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "mesostructure/march_math.h"
#include "mesostructure/shape.h"

namespace vcp::meso {

namespace {

class HeightShape final : public Shape {
public:
    explicit HeightShape(const HeightMap& map)
        : Shape(map.extent()), map_(map), scale_(glm::dvec2(map.size.x, map.size.x)) {
        double steepest = 0;
        for (int y = 0; y < map.size.y; ++y)
            for (int x = 0; x < map.size.x; ++x) {
                const double dx = (map.height(x + 1, y) - map.height(x, y)) * scale_.x,
                             dy = (map.height(x, y + 1) - map.height(x, y)) * scale_.y;
                const double dx2 = (map.height(x + 1, y + 1) - map.height(x, y + 1)) * scale_.x,
                             dy2 = (map.height(x + 1, y + 1) - map.height(x + 1, y)) * scale_.y;
                steepest = std::max(steepest, std::max(dx * dx, dx2 * dx2) + std::max(dy * dy, dy2 * dy2));
            }
        lipschitz_ = std::sqrt(1 + steepest);
    }

    double field(glm::dvec3 p) const override { return (p.z - heightAt(p.x, p.y)) / lipschitz_; }

    double distance(glm::dvec3 p, double cap) const override {
        // The surface straight above or below bounds the search; cells are visited ring by ring.
        double best = std::min(cap, std::abs(p.z - heightAt(p.x, p.y)));
        const glm::ivec2 home(int(std::floor(p.x * scale_.x)), int(std::floor(p.y * scale_.y)));
        for (int ring = 0; (ring - 1) / scale_.x < best && ring <= map_.size.x; ++ring)
            for (int j = -ring; j <= ring; ++j)
                for (int i = -ring; i <= ring; i += std::abs(j) == ring ? 1 : std::max(1, 2 * ring))
                    best = std::min(best, cellDistance(p, home + glm::ivec2(i, j), best));
        return best;
    }

    bool mayTouch(glm::dvec3 lower, glm::dvec3 upper) const override {
        const glm::ivec2 first(int(std::floor(lower.x * scale_.x)), int(std::floor(lower.y * scale_.y)));
        const glm::ivec2 last(int(std::floor(upper.x * scale_.x)), int(std::floor(upper.y * scale_.y)));
        double least = std::numeric_limits<double>::infinity(), most = -least;
        for (int j = first.y; j <= last.y; ++j)
            for (int i = first.x; i <= last.x; ++i) {
                // A bilinear function has its extremes over a rectangle at the corners.
                const double x0 = std::max(lower.x * scale_.x - i, 0.0), x1 = std::min(upper.x * scale_.x - i, 1.0);
                const double y0 = std::max(lower.y * scale_.y - j, 0.0), y1 = std::min(upper.y * scale_.y - j, 1.0);
                for (const double x : {x0, x1})
                    for (const double y : {y0, y1}) {
                        const double h = bilinear(i, j, x, y);
                        least = std::min(least, h), most = std::max(most, h);
                    }
            }
        return least <= upper.z && most >= lower.z;
    }

    TruthHit trace(glm::dvec3 origin, glm::dvec3 direction, double tMax) const override {
        // The ray is in texels along x and y; heights stay in tile units.
        const glm::dvec3 o(origin.x * scale_.x, origin.y * scale_.y, origin.z),
            d(direction.x * scale_.x, direction.y * scale_.y, direction.z);
        glm::ivec2 cell(int(std::floor(o.x)), int(std::floor(o.y)));
        for (int axis = 0; axis < 2; ++axis)
            if (d[axis] < 0 && o[axis] == std::floor(o[axis])) --cell[axis];
        if (d.z > 0) tMax = std::min(tMax, std::max(0.0, (extent().z - o.z) / d.z));
        if (d.z < 0) tMax = std::min(tMax, (o.z + 0.01 * extent().z) / -d.z);
        if (!std::isfinite(tMax)) tMax = 64;
        bool outside = origin.z - heightAt(origin.x, origin.y) >= 0;
        for (double t = 0; t <= tMax;) {
            const double tx = wall(o.x, d.x, cell.x), ty = wall(o.y, d.y, cell.y);
            const double end = std::max(t, std::min({tx, ty, tMax}));
            const glm::dvec4 heights{map_.height(cell.x, cell.y), map_.height(cell.x + 1, cell.y),
                                     map_.height(cell.x, cell.y + 1), map_.height(cell.x + 1, cell.y + 1)};
            const f64::CellHit found =
                f64::firstEntryBilinear(heights, o - glm::dvec3(cell.x, cell.y, 0), d, t, end, outside);
            if (found.hit) return {true, true, found.t, normalAt(cell, o + found.t * d)};
            outside = found.outside;
            if (end >= tMax) return {};
            (tx <= ty ? cell.x : cell.y) += (tx <= ty ? d.x : d.y) > 0 ? 1 : -1;
            t = end;
        }
        return {};
    }

private:
    static double wall(double o, double d, int cell) {
        if (d == 0) return std::numeric_limits<double>::infinity();
        return (double(cell + (d > 0 ? 1 : 0)) - o) / d;
    }
    double bilinear(int i, int j, double x, double y) const {
        const double low = map_.height(i, j) * (1 - x) + map_.height(i + 1, j) * x;
        const double high = map_.height(i, j + 1) * (1 - x) + map_.height(i + 1, j + 1) * x;
        return low * (1 - y) + high * y;
    }
    double heightAt(double px, double py) const {
        const double x = px * scale_.x, y = py * scale_.y;
        return bilinear(int(std::floor(x)), int(std::floor(y)), x - std::floor(x), y - std::floor(y));
    }
    glm::dvec3 normalAt(glm::ivec2 c, glm::dvec3 p) const {
        const double x = p.x - c.x, y = p.y - c.y;
        const double dx = (map_.height(c.x + 1, c.y) - map_.height(c.x, c.y)) * (1 - y) +
                          (map_.height(c.x + 1, c.y + 1) - map_.height(c.x, c.y + 1)) * y;
        const double dy = (map_.height(c.x, c.y + 1) - map_.height(c.x, c.y)) * (1 - x) +
                          (map_.height(c.x + 1, c.y + 1) - map_.height(c.x + 1, c.y)) * x;
        return glm::normalize(glm::dvec3(-dx * scale_.x, -dy * scale_.y, 1));
    }
    /// Returns the distance to the nearest of a cell's points on a 4 x 4 lattice: the cell's surface to a quarter of a
    /// texel.
    double cellDistance(glm::dvec3 p, glm::ivec2 c, double best) const {
        for (int j = 0; j <= 4; ++j)
            for (int i = 0; i <= 4; ++i) {
                const double x = i / 4.0, y = j / 4.0;
                const glm::dvec3 q((c.x + x) / scale_.x, (c.y + y) / scale_.y, bilinear(c.x, c.y, x, y));
                best = std::min(best, glm::length(p - q));
            }
        return best;
    }

    const HeightMap& map_;
    glm::dvec2 scale_;  ///< texels a tile unit
    double lipschitz_ = 1;
};

}  // namespace

Result<std::unique_ptr<Shape>> heightShape(const HeightMap& map) {
    if (map.size.x > kMaxGridEdge || map.size.y > kMaxGridEdge)
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("a height map of {} x {} texels: rays are marched over at most {} along an "
                                            "edge; larger maps are for the method remesh, with heights alone",
                                            map.size.x, map.size.y, kMaxGridEdge)};
    if (map.size.x < 1 || map.size.y < 1 || map.texels.size() != size_t(map.size.x) * size_t(map.size.y))
        return Error{.message = fmt::format("a height map of {} x {} texels with {} heights", map.size.x, map.size.y,
                                            map.texels.size())};
    if (!(map.range > 0) || !std::isfinite(map.range))
        return Error{.message = "the range of the heights must be above 0"};
    return std::unique_ptr<Shape>(std::make_unique<HeightShape>(map));
}

}  // namespace vcp::meso
