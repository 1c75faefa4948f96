#include "mesostructure/gdm/distance_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace vcp::meso {

namespace {

using std::numbers::pi;

/// Returns the way from a height to the slab's top or bottom.
double toBoundary(double z, double top, double rise) { return rise > 0 ? (top - z) / rise : z / -rise; }

}  // namespace

double DirectionGrid::theta(int i) const {
    const double from = downwards ? pi / 2 : 0;
    return from + (pi - from) * (i + 0.5) / thetas;
}

glm::dvec3 DirectionGrid::direction(int i, int phi) const {
    const double polar = theta(i), turn = 2 * pi * phi / phis;
    return {std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn), std::cos(polar)};
}

size_t DistanceTable::rows() const {
    return size_t(nodes.x) * size_t(nodes.y) * size_t(isOfTop() ? 1 : directions.phis);
}

size_t DistanceTable::columns() const {
    return size_t(directions.thetas) * size_t(isOfTop() ? directions.phis : nodes.z);
}

size_t DistanceTable::row(int x, int y, int phi) const {
    return size_t(x) + size_t(nodes.x) * (size_t(y) + size_t(nodes.y) * size_t(isOfTop() ? 0 : phi));
}

size_t DistanceTable::column(int theta, int phi, int z) const {
    return isOfTop() ? size_t(theta) * size_t(directions.phis) + size_t(phi)
                     : size_t(theta) * size_t(nodes.z) + size_t(z);
}

glm::dvec3 DistanceTable::point(int x, int y, int z) const {
    return {extent.x * x / nodes.x, extent.y * y / nodes.y, isOfTop() ? extent.z : extent.z * z / (nodes.z - 1)};
}

Result<DistanceTable> emptyTable(glm::ivec3 nodes, DirectionGrid directions, glm::dvec3 extent, uint64_t memoryBytes) {
    const auto isIn = [](int value, int least, int most) { return value >= least && value <= most; };
    if (!isIn(directions.thetas, 2, 64) || !isIn(directions.phis, 4, 64))
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("{} x {} directions; there must be 2 to 64 elevations and 4 to 64 azimuths",
                                            directions.thetas, directions.phis)};
    if (!isIn(nodes.x, 2, kMostNodes) || !isIn(nodes.y, 2, kMostNodes) || !isIn(nodes.z, 1, kMostNodes))
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("{} x {} x {} points; each edge must have 2 to {}", nodes.x, nodes.y,
                                            nodes.z, kMostNodes)};
    DistanceTable table{nodes, directions, extent, 0, {}, {}};
    const uint64_t bytes = table.rows() * (table.columns() * 2 + table.hitWords() * 4);
    if (bytes > memoryBytes)
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("distances from {} x {} x {} points in {} x {} directions take {} MiB; the "
                                            "memory cap is {} MiB",
                                            nodes.x, nodes.y, nodes.z, directions.thetas, directions.phis, bytes >> 20,
                                            memoryBytes >> 20)};
    // The flattest direction has the longest way out of the slab.
    double flattest = 1;
    for (int i = 0; i < directions.thetas; ++i) flattest = std::min(flattest, std::abs(std::cos(directions.theta(i))));
    table.unit = float(extent.z / flattest / 65535 * (1 + 1e-6));
    table.steps.resize(table.rows() * table.columns());
    table.hits.resize(table.rows() * table.hitWords());
    return table;
}

void fillColumns(DistanceTable& table, const TracedSolid& solid, size_t first, size_t last) {
    const DirectionGrid& directions = table.directions;
    const auto put = [&](size_t row, size_t column, bool isHit, double distance) {
        table.steps[row * table.columns() + column] =
            uint16_t(std::clamp(std::lround(distance / double(table.unit)), 0L, 65535L));
        uint32_t& word = table.hits[row * table.hitWords() + column / 32];
        const uint32_t bit = 1u << (column % 32);
        word = isHit ? word | bit : word & ~bit;
    };
    for (size_t at = first; at < last; ++at) {
        const int x = int(at % size_t(table.nodes.x)), y = int(at / size_t(table.nodes.x));
        for (int z = 0; z < table.nodes.z; ++z) {
            const glm::dvec3 point = table.point(x, y, z);
            const bool isInside = solid.isInside(point);
            for (int phi = 0; phi < directions.phis; ++phi)
                for (int theta = 0; theta < directions.thetas; ++theta) {
                    const glm::dvec3 direction = directions.direction(theta, phi);
                    const size_t row = table.row(x, y, phi), column = table.column(theta, phi, z);
                    const auto found = isInside ? std::optional(0.0) : solid.distance(point, direction);
                    const double out = toBoundary(point.z, table.extent.z, direction.z);
                    put(row, column, found.has_value(), found ? std::min(*found, out) : out);
                }
        }
    }
}

}  // namespace vcp::meso
