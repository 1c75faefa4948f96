// Sphere tracing on a plain distance map, and the exact walk over sampled distances.
#include <limits>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "mesostructure/cell_solve.h"
#include "mesostructure/grid_walk.h"

namespace vcp::meso {

namespace {

using glm::ivec3, glm::vec3;

class SphereTracing final : public Marcher {
public:
    explicit SphereTracing(SphereMap map) : map_(std::move(map)) {}

    MarchResult march(const MarchRay& ray) const override {
        MarchResult result;
        const glm::dvec3 extent = map_.grid.extent();
        const vec3 o(inFirstTile(ray.origin, extent)), d(ray.direction);
        bool outside = false;
        for (float t = 0; t <= float(ray.tMax);) {
            const vec3 p = o + t * d;
            if (p.z < 0 ? d.z <= 0 : p.z > float(extent.z) && d.z >= 0) return result;
            if (result.iterations++ == uint32_t(map_.options.steps)) {
                result.state = MarchState::Unresolved;
                return result;
            }
            const float length = sample(p, result);
            // Inside, and on the start's own surface, it moves on by a part of a cell until the distance grows.
            if (length >= map_.threshold)
                outside = true;
            else if (outside || t == 0) {
                if (outside || p.z >= float(extent.z)) {
                    result.state = MarchState::Hit, result.t = t;
                    return result;
                }
            }
            t += std::max(length, outside ? 0 : float(map_.grid.cell.x) * 0.25f);
        }
        return result;
    }
    uint64_t bytes() const override { return map_.steps.size() * sizeof(int16_t); }
    bool isConservative() const override { return false; }

private:
    float sample(vec3 p, MarchResult& result) const {
        ++result.fetches;
        const vec3 at = p / vec3(map_.grid.cell) - 0.5f, first = glm::floor(at), w = at - first;
        float sum = 0;
        for (int corner = 0; corner < 8; ++corner) {
            const ivec3 bit(corner & 1, corner >> 1 & 1, corner >> 2);
            ivec3 cell = ivec3(first) + bit;
            cell.z = std::clamp(cell.z, 0, map_.grid.cells.z - 1);
            const vec3 part = glm::mix(1.0f - w, w, vec3(bit));
            sum += part.x * part.y * part.z * float(map_.steps[map_.grid.index(cell)]);
        }
        return sum * (map_.cap / 32767);
    }

    SphereMap map_;
};

}  // namespace

Result<SphereMap> buildSphereMap(const Shape& shape, const SphereOptions& options) {
    SphereMap map{options, TileGrid(options.cells, shape.extent()), 0, 0, {}};
    const TileGrid& grid = map.grid;
    if (std::min({options.cells.x, options.cells.y, options.cells.z}) < 1 || grid.count() > kMaxGridCells)
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("a distance map of {} x {} x {} cells", options.cells.x, options.cells.y,
                                            options.cells.z)};
    map.cap = float(16 * std::max({grid.cell.x, grid.cell.y, grid.cell.z}));
    map.threshold = options.threshold * float(std::min({grid.cell.x, grid.cell.y, grid.cell.z}));
    map.steps.resize(grid.count());
    for (size_t i = 0; i < map.steps.size(); ++i) {
        const glm::dvec3 centre = grid.centre(grid.at(i));
        map.steps[i] = int16_t(std::lround((shape.field(centre) > 0 ? 32767 : -32767) *
                                           shape.distance(centre, map.cap) / double(map.cap)));
    }
    return map;
}

std::unique_ptr<Marcher> sphereMarcher(SphereMap map) { return std::make_unique<SphereTracing>(std::move(map)); }

TruthHit traceField(const SampledField& field, const MarchRay& ray) {
    const TileGrid& grid = field.grid;
    const glm::dvec3 o = inFirstTile(ray.origin, grid.extent()) / grid.cell, d = ray.direction / grid.cell;
    ivec3 cell(glm::floor(o));
    for (int axis = 0; axis < 3; ++axis)
        if (d[axis] < 0 && o[axis] == std::floor(o[axis])) --cell[axis];
    bool outside = o.z >= grid.cells.z && d.z < 0;
    for (double t = 0; t <= ray.tMax && cell.z >= 0 && cell.z < grid.cells.z;) {
        double exit = std::numeric_limits<double>::infinity();
        int axisOut = 0;
        for (int axis = 0; axis < 3; ++axis) {
            if (d[axis] == 0) continue;
            const double wall = (cell[axis] + (d[axis] > 0) - o[axis]) / d[axis];
            if (wall < exit) exit = wall, axisOut = axis;
        }
        const double end = std::max(t, std::min(exit, ray.tMax));
        TrilinearCell<double> corners;
        for (int corner = 0; corner < 8; ++corner)
            corners.value[corner] = field.step(cell + ivec3(corner & 1, corner >> 1 & 1, corner >> 2));
        if (const int side = corners.side(); side == 0 || (side < 0 && outside)) {
            const CellHit<double> found = corners.firstEntry(o - glm::dvec3(cell), d, t, end, outside);
            if (found.hit)
                return {true, true, found.t,
                        glm::normalize(corners.gradient(o + found.t * d - glm::dvec3(cell)) / grid.cell)};
            outside = found.outside;
        } else {
            outside = side > 0;
        }
        if (!std::isfinite(exit)) break;
        t = end;
        cell[axisOut] += d[axisOut] > 0 ? 1 : -1;
    }
    return {};
}

}  // namespace vcp::meso
