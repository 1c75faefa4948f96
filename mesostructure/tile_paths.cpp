#include "mesostructure/tile_paths.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>

namespace vcp::meso {

namespace {

using glm::dvec2, glm::dvec3;

constexpr double kLift = 1e-5;      // by which rays start above the surface, tile units
constexpr int kWeighted = 3;        // so many points of a path weigh; then chance decides
constexpr int kMostPoints = 10000;  // of a path: white hollows are left at last

}  // namespace

double PathRandom::next() {
    state_ += 0x9e3779b97f4a7c15;
    return double(mixed(state_, 0) >> 11) * 0x1p-53;
}

uint64_t PathRandom::mixed(uint64_t seed, uint64_t number) {
    uint64_t z = seed + number * 0xd1342543de82ef95;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9;
    z = (z ^ z >> 27) * 0x94d049bb133111eb;
    return z ^ z >> 31;
}

dvec2 evenPoint(uint64_t i) {
    const dvec2 p = 0.5 + double(i) * dvec2(0.7548776662466927, 0.5698402909980532);
    return p - glm::floor(p);
}

dvec3 turnedFromZ(dvec3 n, dvec3 local) {
    const double sign = n.z >= 0 ? 1 : -1, a = -1 / (sign + n.z), b = n.x * n.y * a;
    const dvec3 x(1 + sign * n.x * n.x * a, sign * b, -sign * n.x), y(b, sign + n.y * n.y * a, -n.y);
    return glm::normalize(x * local.x + y * local.y + n * local.z);
}

dvec3 directionByCosine(dvec3 n, dvec2 p) {
    const double r = std::sqrt(p.x), turn = 2 * std::numbers::pi * p.y;
    return turnedFromZ(n, {r * std::cos(turn), r * std::sin(turn), std::sqrt(std::max(0.0, 1 - p.x))});
}

TileMeeting TilePaths::meet(dvec3 from, dvec3 direction, double reach) const {
    const double top = shape_.extent().z;
    if (from.z >= top && direction.z >= 0) return {TileMeeting::Kind::Sky, {}};
    const double leaves = direction.z > 0   ? (top - from.z) / direction.z
                          : direction.z < 0 ? from.z / -direction.z
                                            : std::numeric_limits<double>::infinity();
    const double last = std::min(leaves, reach);
    const TruthHit hit = shape_.trace(from, direction, last);
    if (hit.hit) return {TileMeeting::Kind::Surface, {from + hit.t * direction, hit.normal}};
    if (!hit.resolved || reach < leaves) return {};
    if (direction.z > 0) return {TileMeeting::Kind::Sky, {}};
    const dvec3 at = from + leaves * direction;
    return {TileMeeting::Kind::Surface, {{at.x, at.y, 0}, {0, 0, 1}}};
}

TileMeeting TilePaths::see(dvec3 view, dvec2 place) const {
    return meet({place, shape_.extent().z}, -view, std::numeric_limits<double>::infinity());
}

TileEscape followPath(const std::function<TileMeeting(const TilePoint& from, dvec3 direction)>& meet, double albedo,
                      TilePoint from, dvec3 direction, PathRandom& random) {
    TileEscape escape{direction, 1};
    for (int points = 0; points < kMostPoints; ++points) {
        const TileMeeting met = meet(from, escape.direction);
        if (met.kind == TileMeeting::Kind::Sky) return escape;
        if (met.kind == TileMeeting::Kind::Unresolved) break;
        if (points < kWeighted)
            escape.weight *= albedo;
        else if (random.next() >= albedo)
            break;
        from = met.point;
        if (glm::dot(from.normal, escape.direction) > 0) break;
        const double u = random.next();
        escape.direction = directionByCosine(from.normal, {u, random.next()});
    }
    escape.weight = 0;
    return escape;
}

TileEscape TilePaths::follow(TilePoint from, dvec3 direction, PathRandom& random) const {
    // A level ray would pass tile after tile.
    constexpr double kFarthest = 1000;
    const auto meets = [this](const TilePoint& point, dvec3 towards) {
        return meet(point.at + kLift * point.normal, towards, kFarthest);
    };
    return followPath(meets, albedo_, from, direction, random);
}

dvec3 TilePaths::lightAt(const TilePoint& point, const std::function<dvec3(dvec3)>& radiance, uint32_t paths,
                         uint64_t seed) const {
    PathRandom random(seed);
    const dvec2 shift(random.next(), random.next());
    dvec3 sum(0);
    for (uint32_t i = 0; i < paths; ++i) {
        const dvec2 p = evenPoint(i) + shift;
        const TileEscape escape = follow(point, directionByCosine(point.normal, p - glm::floor(p)), random);
        if (escape.weight > 0) sum += escape.weight * radiance(escape.direction);
    }
    return sum / double(paths);
}

}  // namespace vcp::meso
