#include "mesostructure/gdm/distance_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "mesostructure/gdm/bent_ray.h"

namespace vcp::meso {

namespace {

using std::numbers::pi;

constexpr double kMostTraced = 1e6;  ///< tile units that a straight ray is followed

/// Returns the way from a height to the slab's top or bottom.
double toBoundary(double z, double top, double rise) { return rise > 0 ? (top - z) / rise : z / -rise; }

/// A ray from the slab's top over a base that bends.
struct BentRay {
    glm::dvec3 from, across;  ///< the latter: unit, along the base
    bent::BentPath path;
    double leaves = 0;  ///< time at which it leaves the slab

    BentRay(glm::dvec3 point, glm::dvec3 direction, double curvature) : from(point) {
        const double run = std::hypot(direction.x, direction.y);
        across = glm::dvec3(direction.x / run, direction.y / run, 0);
        path = {curvature, point.z, run, direction.z};
        bool byBottom = false;
        leaves = bent::bentExit(path, byBottom);
    }
    [[nodiscard]] glm::dvec3 at(double t) const {
        glm::dvec3 p = from + bent::bentAlong(path, t) * across;
        p.z = std::clamp(bent::bentHeight(path, t), 0.0, from.z);
        return p;
    }
};

/// Follows a ray by chords that are at most `stray` off it.
std::optional<double> bentDistance(const TracedSolid& solid, const BentRay& ray, double stray) {
    const double bend = std::abs(ray.path.c) * (1 + std::abs(ray.path.c) * ray.from.z);
    const int chords = std::max(1, int(std::ceil(ray.leaves / std::sqrt(8 * stray / bend))));
    glm::dvec3 from = ray.from;
    for (int i = 1; i <= chords; ++i) {
        const double begins = ray.leaves * (i - 1) / chords, ends = ray.leaves * i / chords;
        const glm::dvec3 to = ray.at(ends);
        const double length = glm::distance(from, to);
        // A chord is looked along a little farther than it goes: the next one must not start within the solid.
        if (const auto found = solid.distance(from, (to - from) / length, length * (1 + 1e-3)))
            return begins + (ends - begins) * std::min(*found / length, 1.0);
        from = to;
    }
    return std::nullopt;
}

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
    return size_t(directions.thetas) * size_t(isOfTop() ? directions.phis : 1) * size_t(layers());
}

size_t DistanceTable::row(int x, int y, int phi) const {
    return size_t(x) + size_t(nodes.x) * (size_t(y) + size_t(nodes.y) * size_t(isOfTop() ? 0 : phi));
}

size_t DistanceTable::column(int theta, int phi, int layer) const {
    return isOfTop()
               ? (size_t(layer) * size_t(directions.thetas) + size_t(theta)) * size_t(directions.phis) + size_t(phi)
               : size_t(theta) * size_t(nodes.z) + size_t(layer);
}

glm::dvec3 DistanceTable::point(int x, int y, int z) const {
    return {extent.x * x / nodes.x, extent.y * y / nodes.y, isOfTop() ? extent.z : extent.z * z / (nodes.z - 1)};
}

Result<DistanceTable> emptyTable(glm::ivec3 nodes, DirectionGrid directions, Curvatures curvatures, glm::dvec3 extent,
                                 uint64_t memoryBytes) {
    const auto isIn = [](int value, int least, int most) { return value >= least && value <= most; };
    if (!isIn(directions.thetas, 2, 64) || !isIn(directions.phis, 4, 64))
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("{} x {} directions; there must be 2 to 64 elevations and 4 to 64 azimuths",
                                            directions.thetas, directions.phis)};
    if (!isIn(nodes.x, 2, kMostNodes) || !isIn(nodes.y, 2, kMostNodes) || !isIn(nodes.z, 1, kMostNodes))
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("{} x {} x {} points; each edge must have 2 to {}", nodes.x, nodes.y,
                                            nodes.z, kMostNodes)};
    if (!isIn(curvatures.samples, 1, nodes.z == 1 ? kMostCurvatureSamples : 1) || curvatures.samples % 2 == 0)
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("{} samples of curvature; there must be an odd number from 1 to {}, and 1 "
                                            "but for view-dependent maps",
                                            curvatures.samples, kMostCurvatureSamples)};
    if (curvatures.samples > 1 && !(curvatures.most > 0 && curvatures.most <= kMostCurvature))
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("a greatest curvature of {:g} slab heights over a radius; it must be above "
                                            "0 and at most {:g}",
                                            curvatures.most, kMostCurvature)};
    DistanceTable table{nodes, directions, curvatures, extent, 0, {}, {}};
    const uint64_t bytes = table.rows() * (table.columns() * 2 + table.hitWords() * 4);
    if (bytes > memoryBytes)
        return Error{
            .code = ErrorCode::Limit,
            .message = fmt::format(
                "distances from {} x {} x {} points in {} x {} directions{} take {} MiB; "
                "the memory cap is {} MiB",
                nodes.x, nodes.y, nodes.z, directions.thetas, directions.phis,
                curvatures.samples == 1 ? std::string() : fmt::format(" over {} curvatures", curvatures.samples),
                bytes >> 20, memoryBytes >> 20)};
    // The flattest direction has the longest way out of the slab, over a flat base; over others it may be longer.
    double flattest = 1, longest = 0;
    for (int i = 0; i < directions.thetas; ++i) {
        flattest = std::min(flattest, std::abs(std::cos(directions.theta(i))));
        for (int c = 0; c < curvatures.samples && curvatures.samples > 1; ++c)
            longest = std::max(
                longest, BentRay({0, 0, extent.z}, directions.direction(i, 0), curvatures.at(c) / extent.z).leaves);
    }
    table.unit = float(std::max(longest, extent.z / flattest) / 65535 * (1 + 1e-6));
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
    const double stray = std::min(table.extent.x / table.nodes.x, table.extent.y / table.nodes.y) / 64;
    for (size_t at = first; at < last; ++at) {
        const int x = int(at % size_t(table.nodes.x)), y = int(at / size_t(table.nodes.x));
        for (int layer = 0; layer < table.layers(); ++layer) {
            const glm::dvec3 point = table.point(x, y, table.isOfTop() ? 0 : layer);
            const double curvature = table.isOfTop() ? table.curvatures.at(layer) / table.extent.z : 0;
            const bool isInside = solid.isInside(point);
            for (int phi = 0; phi < directions.phis; ++phi)
                for (int theta = 0; theta < directions.thetas; ++theta) {
                    const glm::dvec3 direction = directions.direction(theta, phi);
                    const size_t row = table.row(x, y, phi), column = table.column(theta, phi, layer);
                    double out = toBoundary(point.z, table.extent.z, direction.z);
                    std::optional<double> found = 0.0;
                    if (curvature != 0) {
                        const BentRay ray(point, direction, curvature);
                        out = ray.leaves;
                        if (!isInside) found = bentDistance(solid, ray, stray);
                    } else if (!isInside)
                        found = solid.distance(point, direction, kMostTraced);
                    put(row, column, found.has_value(), found ? std::min(*found, out) : out);
                }
        }
    }
}

}  // namespace vcp::meso
