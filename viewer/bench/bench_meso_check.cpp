// The conservative test of vcp bench meso: what maps say against where the surface is, ray by ray.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>

#include <glm/geometric.hpp>

#include "mesostructure/octant_boxes.h"
#include "viewer/bench/bench_meso.h"

namespace vcp {

namespace {

using namespace meso;

constexpr int kCells = 32;  ///< cells of the maps, along x

/// How far a map lets a ray go in one of its cells that are not occupied.
struct CheckedMap {
    std::string name;
    std::function<double(glm::dvec3 from, glm::dvec3 direction, glm::ivec3 cell)> length;
};

Result<void> addDistances(std::vector<CheckedMap>& maps, const char* name, const Occupancy& occupancy,
                          const DistanceOptions& options, const Shape& shape) {
    VCP_TRY_ASSIGN(auto made, buildDistanceMap(occupancy, options, &shape));
    const auto map = std::make_shared<const DistanceMap>(std::move(made));
    maps.push_back({name, [map, borders = ConeBorders(map->cones)](glm::dvec3, glm::dvec3 direction, glm::ivec3 cell) {
                        return double(map->length(coneOf(borders, glm::vec3(direction)), cell));
                    }});
    return {};
}

void addBoxes(std::vector<CheckedMap>& maps, const Occupancy& occupancy) {
    const auto boxes = std::make_shared<const OctantBoxes>(buildOctantBoxes(occupancy));
    maps.push_back({"octant boxes", [boxes](glm::dvec3 from, glm::dvec3 direction, glm::ivec3 cell) {
                        const TileGrid& grid = boxes->grid;
                        const uint16_t box =
                            boxes->boxes[size_t(octantOf(glm::vec3(direction))) * grid.count() + grid.index(cell)];
                        const glm::ivec3 further(box & 31, box >> 5 & 31, box >> 10 & 31);
                        double exit = std::numeric_limits<double>::infinity();
                        for (int axis = 0; axis < 3; ++axis) {
                            if (direction[axis] == 0) continue;
                            const int wall =
                                direction[axis] > 0 ? cell[axis] + further[axis] + 1 : cell[axis] - further[axis];
                            exit = std::min(exit, (wall * grid.cell[axis] - from[axis]) / direction[axis]);
                        }
                        return exit;
                    }});
}

/// Makes the maps; that of the paper's rule is last.
Result<std::vector<CheckedMap>> mapsOf(const Occupancy& occupancy, const Shape& shape) {
    std::vector<CheckedMap> maps;
    VCP_TRY(addDistances(maps, "1x1", occupancy, {.cones = {1, 1}}, shape));
    VCP_TRY(addDistances(maps, "2x1", occupancy, {.cones = {2, 1}}, shape));
    VCP_TRY(addDistances(maps, "4x1", occupancy, {.cones = {4, 1}}, shape));
    VCP_TRY(addDistances(maps, "8x1", occupancy, {.cones = {8, 1}, .cap = 0.125}, shape));
    VCP_TRY(addDistances(maps, "3x3", occupancy, {.cones = {3, 3}, .cap = 0.125}, shape));
    VCP_TRY(addDistances(maps, "4x2", occupancy, {.cones = {4, 2}}, shape));
    addBoxes(maps, occupancy);
    VCP_TRY(addDistances(maps, "4x1 paper", occupancy, {.cones = {4, 1}, .rule = DistanceRule::Paper}, shape));
    return maps;
}

/// Returns any direction; every fourth one is within 10^-6 of a border of azimuths, which are multiples of 15 degrees.
glm::dvec3 directionFrom(std::mt19937_64& random) {
    std::normal_distribution<double> bell;
    const glm::dvec3 any = glm::normalize(glm::dvec3(bell(random), bell(random), bell(random)));
    if (random() % 4 != 0) return any;
    const double flat = std::hypot(any.x, any.y), turn = double(random() % 24) * std::numbers::pi / 12 +
                                                         1e-6 * std::uniform_real_distribution<double>(-1, 1)(random);
    return {flat * std::cos(turn), flat * std::sin(turn), any.z};
}

}  // namespace

Result<std::vector<MesoCheck>> checkMesoMaps(const std::string& asset, const Shape& shape, double texel,
                                             uint64_t rays) {
    const glm::dvec3 extent = shape.extent();
    const glm::ivec3 cells(kCells, std::max(1, int(std::lround(kCells * extent.y))),
                           std::max(4, int(std::ceil(extent.z * kCells))));
    VCP_TRY_ASSIGN(const auto occupancy, occupy(shape, cells));
    VCP_TRY_ASSIGN(const auto maps, mapsOf(occupancy, shape));
    std::vector<MesoCheck> checks;
    for (const CheckedMap& map : maps) checks.push_back({.asset = asset, .map = map.name});
    std::mt19937_64 random(31);
    std::uniform_real_distribution<double> unit(0, 1);
    std::vector<double> lengths(maps.size());
    uint64_t asked = 0;
    // A tile that is all surface has hardly a cell to test.
    for (uint64_t tries = 0; asked < rays && tries < 100 * rays; ++tries) {
        const glm::dvec3 from(unit(random) * extent.x, unit(random) * extent.y, unit(random) * extent.z),
            direction = directionFrom(random);
        const glm::ivec3 cell = glm::min(glm::ivec3(glm::floor(from / occupancy.grid.cell)), cells - 1);
        if (occupancy.at(cell) || shape.field(from) <= 0) continue;
        ++asked;
        for (size_t i = 0; i < maps.size(); ++i) lengths[i] = maps[i].length(from, direction, cell);
        const TruthHit truth = shape.trace(from, direction, *std::ranges::max_element(lengths));
        for (size_t i = 0; i < maps.size(); ++i) {
            ++checks[i].rays;
            if (truth.hit && truth.t < lengths[i])
                ++checks[i].oversteps,
                    checks[i].worstTexels = std::max(checks[i].worstTexels, (lengths[i] - truth.t) / texel);
        }
    }
    return checks;
}

}  // namespace vcp
