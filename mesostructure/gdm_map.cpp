#include "mesostructure/gdm_map.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "mesostructure/method.h"

namespace vcp::meso {

namespace {

uint32_t byteOf(double unit) { return uint32_t(int(std::lround(std::clamp(unit, -1.0, 1.0) * 127))) & 0xff; }

}  // namespace

Result<PropertyVolume> sampleProperties(const Shape& shape, glm::ivec3 points) {
    for (int axis = 0; axis < 3; ++axis)
        if (points[axis] < 2 || points[axis] > kMaxGridEdge)
            return Error{.code = ErrorCode::Usage,
                         .message = fmt::format("a volume of {} x {} x {} points; each edge must have 2 to {}",
                                                points.x, points.y, points.z, kMaxGridEdge)};
    const uint64_t count = uint64_t(points.x) * uint64_t(points.y) * uint64_t(points.z);
    if (count > kMaxGridCells)
        return Error{.code = ErrorCode::Limit,
                     .message = fmt::format("a volume of {} points; at most {}", count, kMaxGridCells)};
    PropertyVolume volume{points, shape.extent(), {}};
    volume.texels.reserve(count);
    const glm::dvec3 spacing = volume.extent / glm::dvec3(points.x, points.y, points.z - 1);
    const double widest = std::max({spacing.x, spacing.y, spacing.z});
    for (int z = 0; z < points.z; ++z)
        for (int y = 0; y < points.y; ++y)
            for (int x = 0; x < points.x; ++x) {
                const glm::dvec3 p = glm::dvec3(x, y, z) * spacing;
                const double field = shape.field(p);
                // Far from the surface nothing reads the normal.
                const glm::dvec3 normal = std::abs(field) < 3 * widest ? shape.normal(p, 0.5 * spacing) : glm::dvec3(0);
                // The field may be far less than the distance: over steep height fields it is.
                const double off = std::abs(field) < widest ? shape.distance(p, widest) : widest;
                const auto density = uint32_t(std::lround(255 * (0.5 - std::copysign(off, field) / (2 * widest))));
                volume.texels.push_back(byteOf(normal.x) | byteOf(normal.y) << 8 | byteOf(normal.z) << 16 |
                                        density << 24);
            }
    return volume;
}

Result<DistanceTable> traceTable(const Asset& asset, const Shape& shape, const GdmOptions& options) {
    glm::ivec3 points = options.points;
    if (options.ofTop) points.z = 1;
    VCP_TRY_ASSIGN(auto table, emptyTable(points, {options.directions.x, options.directions.y, options.ofTop},
                                          options.curvatures, shape.extent(), options.memoryBytes));
    if (!options.ofTop && points.z < 2)
        return Error{.code = ErrorCode::Usage, .message = "a map of a volume has at least 2 points along z"};
    VCP_TRY_ASSIGN(const auto method, buildMethod(asset, shape, {.name = "boxes", .cells = gridFor(asset, {}).x}));
    VCP_TRY_ASSIGN(const auto marcher, method.marcher());
    const TracedSolid solid{[&](glm::dvec3 p) { return shape.field(p) <= 0; },
                            [&](glm::dvec3 p, glm::dvec3 d, double reach) -> std::optional<double> {
                                const MarchResult found = marcher->march({p, d, reach});
                                if (found.state != MarchState::Hit) return std::nullopt;
                                return found.t;
                            }};
    const auto fill = [&](size_t first, size_t last) { fillColumns(table, solid, first, last); };
    const size_t count = size_t(points.x) * size_t(points.y);
    if (!options.shareOut)
        fill(0, count);
    else if (!options.shareOut(count, fill))
        return Error::cancelled();
    return table;
}

RowSource rowsOf(const DistanceTable& table) {
    return {table.rows(), table.columns(), [&table](size_t first, size_t count, float* out) {
                const size_t from = first * table.columns(), values = count * table.columns();
                for (size_t i = 0; i < values; ++i) out[i] = float(table.steps[from + i]) * table.unit;
            }};
}

uint64_t GdmMap::bytes() const {
    const uint64_t distances = factors ? factors->bytes() : table.steps.size() * uint64_t(bits) / 8;
    return distances + (withVisibility ? table.hits.size() * 4 : 0) + properties.bytes();
}

Result<GdmMap> packMap(DistanceTable table, int rank, int bits, bool withVisibility, PropertyVolume properties) {
    if (bits != 8 && bits != 16)
        return Error{.code = ErrorCode::Usage, .message = fmt::format("values of {} bits; there are 8 and 16", bits)};
    GdmMap map{std::move(table), std::nullopt, bits, withVisibility, std::move(properties)};
    if (rank != 0) {
        VCP_TRY_ASSIGN(const auto factors, factorize(rowsOf(map.table), rank));
        VCP_TRY_ASSIGN(map.factors, packFactors(factors, rank, bits));
        map.table.steps = {};
    }
    if (!withVisibility) map.table.hits = {};
    return map;
}

Result<SafeFactors> buildGuesses(const Occupancy& occupancy, const SafeOptions& options) {
    VCP_TRY_ASSIGN(const auto map, buildDistanceMap(occupancy, {.cones = kGuessCones, .cap = kGuessCap}));
    return makeSafeFactors({map.grid.cells, map.cones.azimuth, map.cones.elevation, map.unit, map.steps, kOccupied},
                           options);
}

}  // namespace vcp::meso
