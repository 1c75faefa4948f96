#include "mesostructure/sampled_field.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

namespace vcp::meso {

namespace {

/// A shape's values at the grid points, plane by plane: five planes are kept.
class Planes {
public:
    Planes(const Shape& shape, const TileGrid& grid) : shape_(shape), grid_(grid) {}

    double at(glm::ivec3 p) {
        Plane& plane = planes_[size_t(p.z) % planes_.size()];
        if (plane.z != p.z) fill(plane, p.z);
        return plane
            .values[size_t(wrapped(p.x, grid_.cells.x)) + size_t(grid_.cells.x) * size_t(wrapped(p.y, grid_.cells.y))];
    }
    /// Sums the second differences over the axes; at the slab's top and bottom, that along z is taken from the next
    /// plane.
    double secondDifferences(glm::ivec3 p) {
        const double twice = 2 * at(p);
        const double sum = at(p + glm::ivec3(1, 0, 0)) + at(p - glm::ivec3(1, 0, 0)) + at(p + glm::ivec3(0, 1, 0)) +
                           at(p - glm::ivec3(0, 1, 0)) - 2 * twice;
        if (grid_.cells.z < 2) return sum;
        p.z = std::clamp(p.z, 1, grid_.cells.z - 1);
        return sum + at(p + glm::ivec3(0, 0, 1)) + at(p - glm::ivec3(0, 0, 1)) - 2 * at(p);
    }

private:
    struct Plane {
        int z = -1;
        std::vector<double> values;
    };
    void fill(Plane& plane, int z) {
        plane.z = z;
        plane.values.resize(size_t(grid_.cells.x) * size_t(grid_.cells.y));
        for (int y = 0; y < grid_.cells.y; ++y)
            for (int x = 0; x < grid_.cells.x; ++x)
                plane.values[size_t(x) + size_t(grid_.cells.x) * size_t(y)] = shape_.field(grid_.lower({x, y, z}));
    }

    const Shape& shape_;
    const TileGrid& grid_;
    std::array<Plane, 5> planes_;
};

}  // namespace

Result<SampledField> sampleField(const Shape& shape, glm::ivec3 cells) {
    for (int axis = 0; axis < 3; ++axis)
        if (cells[axis] < 1 || cells[axis] > kMaxGridEdge)
            return Error{.code = ErrorCode::Usage,
                         .message = fmt::format("{} x {} x {} cells of samples; each edge must be from 1 to {}",
                                                cells.x, cells.y, cells.z, kMaxGridEdge)};
    SampledField field{TileGrid(cells, shape.extent()), 0, {}};
    const TileGrid& grid = field.grid;
    if (grid.count() > kMaxGridCells)
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("{} samples; at most {}", grid.count(), kMaxGridCells)};
    field.unit = float(kBandCells * std::max({grid.cell.x, grid.cell.y, grid.cell.z}) / 32767);
    field.steps.reserve(size_t(cells.x) * size_t(cells.y) * size_t(cells.z + 1));
    Planes planes(shape, grid);
    for (int z = 0; z <= cells.z; ++z)
        for (int y = 0; y < cells.y; ++y)
            for (int x = 0; x < cells.x; ++x) {
                const double value = planes.at({x, y, z}) - planes.secondDifferences({x, y, z}) / 12;
                // A sample outside stays outside: only 0 and below is solid.
                const double step = std::round(value / double(field.unit));
                field.steps.push_back(int16_t(std::clamp(value > 0 ? std::max(step, 1.0) : step, -32767.0, 32767.0)));
            }
    return field;
}

void occupyField(const SampledField& field, Occupancy& occupancy) {
    const glm::ivec3 ratio = field.grid.cells / occupancy.grid.cells;
    for (size_t i = 0; i < field.grid.count(); ++i) {
        const glm::ivec3 at = field.grid.at(i);
        int inside = 0;
        for (int corner = 0; corner < 8; ++corner)
            inside += field.step(at + glm::ivec3(corner & 1, corner >> 1 & 1, corner >> 2)) <= 0;
        if (inside != 0 && inside != 8) occupancy.cells[occupancy.grid.index(at / ratio)] = 1;
    }
}

}  // namespace vcp::meso
