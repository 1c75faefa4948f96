#include "mesostructure/sampled_field.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace vcp::meso {

Result<SampledField> sampleField(const Shape& shape, glm::ivec3 cells) {
    for (int axis = 0; axis < 3; ++axis)
        if (cells[axis] < 1 || cells[axis] > kMaxGridEdge)
            return Error{.code = ErrorCode::Usage, .message = fmt::format("{} x {} x {} cells of samples; each edge must be from 1 to {}", cells.x, cells.y, cells.z, kMaxGridEdge)};
    SampledField field{TileGrid(cells, shape.extent()), 0, {}};
    const TileGrid& grid = field.grid;
    if (grid.count() > kMaxGridCells) return Error{.code = ErrorCode::Limit, .message = fmt::format("{} samples; at most {}", grid.count(), kMaxGridCells)};
    field.unit = float(kBandCells * std::max({grid.cell.x, grid.cell.y, grid.cell.z}) / 32767);
    field.steps.resize(size_t(cells.x) * size_t(cells.y) * size_t(cells.z + 1));
    for (size_t i = 0; i < field.steps.size(); ++i) {
        const double value = shape.field(grid.lower(grid.at(i)));
        // A sample outside stays outside: only 0 and less is solid.
        const double step = std::round(value / double(field.unit));
        field.steps[i] = int16_t(std::clamp(value > 0 ? std::max(step, 1.0) : step, -32767.0, 32767.0));
    }
    return field;
}

void occupyField(const SampledField& field, Occupancy& occupancy) {
    const glm::ivec3 ratio = field.grid.cells / occupancy.grid.cells;
    for (size_t i = 0; i < field.grid.count(); ++i) {
        const glm::ivec3 at = field.grid.at(i);
        int inside = 0;
        for (int corner = 0; corner < 8; ++corner) inside += field.step(at + glm::ivec3(corner & 1, corner >> 1 & 1, corner >> 2)) <= 0;
        if (inside != 0 && inside != 8) occupancy.cells[occupancy.grid.index(at / ratio)] = 1;
    }
}

}  // namespace vcp::meso
