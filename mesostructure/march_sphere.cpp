// The map of sphere tracing, and the truth about sampled distances.
#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "mesostructure/march_arrays.h"

namespace vcp::meso {

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

std::unique_ptr<Marcher> sphereMarcher(const SphereMap& map) {
    return arrayMarcher(sphereArrays(map), map.steps.size() * sizeof(int16_t), false);
}

TruthHit traceField(const SampledField& field, const MarchRay& ray) {
    const TileGrid& grid = field.grid;
    const glm::dvec3 o = inFirstTile(ray.origin, grid.extent()) / grid.cell, d = ray.direction / grid.cell;
    glm::ivec3 cell(glm::floor(o));
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
        glm::dvec4 below, above;
        for (int corner = 0; corner < 4; ++corner) {
            const glm::ivec3 at = cell + glm::ivec3(corner & 1, corner >> 1, 0);
            below[corner] = field.step(at), above[corner] = field.step(at + glm::ivec3(0, 0, 1));
        }
        if (const int side = f64::sideTrilinear(below, above); side == 0 || (side < 0 && outside)) {
            const glm::dvec3 local = o - glm::dvec3(cell);
            const f64::CellHit found = f64::firstEntryTrilinear(below, above, local, d, t, end, outside);
            if (found.hit)
                return {true, true, found.t,
                        glm::normalize(f64::gradientTrilinear(below, above, local + found.t * d) / grid.cell)};
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
