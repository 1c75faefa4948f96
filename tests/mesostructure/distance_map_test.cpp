// Distance maps: the linear-time transforms against the definition, and no step past the surface.
#include "mesostructure/distance_map.h"

#include <cmath>
#include <limits>
#include <random>

#include <glm/geometric.hpp>

#include "mesostructure/march_arrays.h"
#include "tests/support/meso_rays.h"

namespace vcp::meso {
namespace {

Occupancy randomOccupancy(glm::ivec3 cells, glm::dvec3 extent, double part, uint32_t seed) {
    std::mt19937 random(seed);
    std::bernoulli_distribution coin(part);
    Occupancy occupancy{TileGrid(cells, extent),
                        std::vector<uint8_t>(size_t(cells.x) * size_t(cells.y) * size_t(cells.z))};
    for (uint8_t& cell : occupancy.cells) cell = coin(random);
    return occupancy;
}

/// The definition: over all cells of three tiles.
double byDefinition(const Occupancy& occupancy, glm::ivec3 at, glm::ivec3 sign, bool betweenCentres) {
    const TileGrid& grid = occupancy.grid;
    double best = std::numeric_limits<double>::infinity();
    for (int z = 0; z < grid.cells.z; ++z)
        for (int y = -grid.cells.y; y < 2 * grid.cells.y; ++y)
            for (int x = -grid.cells.x; x < 2 * grid.cells.x; ++x) {
                const glm::ivec3 apart = glm::ivec3(x, y, z) - at;
                if (!occupancy.at({x, y, z})) continue;
                bool ordered = true;
                double square = 0;
                for (int axis = 0; axis < 3; ++axis) {
                    ordered = ordered && apart[axis] * sign[axis] >= 0;
                    const double gap =
                        (betweenCentres ? std::abs(apart[axis]) : std::max(0, std::abs(apart[axis]) - 1)) *
                        grid.cell[axis];
                    square += gap * gap;
                }
                if (ordered) best = std::min(best, std::sqrt(square));
            }
    return best;
}

TEST(DistanceMap, SignedConesAreExactInAnyGrid) {
    uint32_t seed = 0;
    for (const glm::ivec3 cells : {glm::ivec3(7, 5, 6), glm::ivec3(1, 9, 3), glm::ivec3(8, 8, 1)})
        for (const double part : {0.003, 0.02, 0.3})
            for (const bool betweenCentres : {false, true}) {
                Occupancy occupancy = randomOccupancy(cells, {1, 1.3, 0.4}, part, ++seed);
                occupancy.cells[seed % occupancy.cells.size()] = 1;
                for (int sign = 0; sign < 27; ++sign) {
                    const glm::ivec3 signs(sign % 3 - 1, sign / 3 % 3 - 1, sign / 9 - 1);
                    const std::vector<float> found = signedConeDistances(occupancy, signs, betweenCentres);
                    for (size_t i = 0; i < found.size(); ++i)
                        ASSERT_FLOAT_EQ(found[i],
                                        float(byDefinition(occupancy, occupancy.grid.at(i), signs, betweenCentres)))
                            << "seed " << seed << " sign " << sign << " cell " << i;
                }
            }
}

TEST(DistanceMap, SearchFindsWhatTheTransformsFind) {
    const Occupancy occupancy = randomOccupancy({12, 12, 8}, {1, 1, 0.5}, 0.01, 5);
    for (const Cones cones : {Cones{1, 1}, Cones{2, 1}, Cones{4, 1}, Cones{4, 2}}) {
        const DistanceMap exact = test::distances(occupancy, {.cones = cones});
        const DistanceMap searched = test::distances(occupancy, {.cones = cones, .search = true});
        // The search keeps off a little at walls.
        for (size_t i = 0; i < exact.steps.size(); ++i) {
            ASSERT_LE(searched.steps[i], exact.steps[i]) << cones.azimuth << "x" << cones.elevation << " cell " << i;
            ASSERT_GE(searched.steps[i] + 1, exact.steps[i])
                << cones.azimuth << "x" << cones.elevation << " cell " << i;
        }
    }
}

TEST(DistanceMap, MoreConesNeverShortenLengths) {
    const Occupancy occupancy = test::occupied(*test::solid("beads"), {32, 32, 8});
    const DistanceMap one = test::distances(occupancy, {.cones = {1, 1}}),
                      four = test::distances(occupancy, {.cones = {4, 1}}),
                      eight = test::distances(occupancy, {.cones = {8, 1}});
    double sums[3] = {};
    for (size_t i = 0; i < occupancy.cells.size(); ++i)
        for (int cone = 0; cone < 8; ++cone) {
            const uint8_t plain = one.steps[i], quarter = four.steps[size_t(cone / 2) * occupancy.cells.size() + i],
                          narrow = eight.steps[size_t(cone) * occupancy.cells.size() + i];
            ASSERT_LE(plain, quarter);
            sums[0] += plain, sums[1] += quarter, sums[2] += narrow;
        }
    EXPECT_LT(sums[0] * 1.01, sums[1]);
    EXPECT_LT(sums[1], sums[2]);
}

TEST(DistanceMap, ConesOfDirectionsAreClosedUnderTheirSigns) {
    for (const Cones cones : {Cones{4, 2}, Cones{8, 1}, Cones{6, 3}}) {
        std::mt19937 random(3);
        for (int i = 0; i < 1000; ++i) {
            const glm::dvec3 d = test::rayAnywhere(random, glm::dvec3(1)).direction;
            const double turn = std::atan2(d.y, d.x) < 0 ? std::atan2(d.y, d.x) + 2 * M_PI : std::atan2(d.y, d.x),
                         height = std::asin(d.z);
            const int expected =
                int((height / M_PI + 0.5) * cones.elevation) * cones.azimuth + int(turn / (2 * M_PI) * cones.azimuth);
            ASSERT_EQ(coneOf(ConeBorders(cones), glm::vec3(d)), expected) << i;
        }
    }
    EXPECT_EQ(coneOf(ConeBorders({4, 2}), {0, 0, -1}), 0);
    EXPECT_EQ(coneOf(ConeBorders({4, 2}), {1, 0, 0}), 4);
}

/// Directions close to the borders: never farther outside the cone that is found than its header says, and in the right
/// one from there on.
TEST(DistanceMap, ConesAreFoundToAFewUnitsOfTheLastPlace) {
    constexpr double kBound = 4e-7;
    static_assert(kBound < kConeSlack);
    for (int azimuths = 1; azimuths <= kMostAzimuths; ++azimuths)
        for (const int elevations : {1, 2, 3, 5, 8, 16}) {
            const Cones cones{azimuths, elevations};
            const ConeBorders borders(cones);
            const double wedge = 2 * M_PI / azimuths, band = M_PI / elevations;
            std::mt19937 random{uint32_t(17 * azimuths + elevations)};
            std::uniform_real_distribution<double> unit(0, 1);
            for (int i = 0; i < 400; ++i) {
                const double off = (i % 2 == 0 ? 1e-6 : 6e-6) * (unit(random) - 0.5);
                // On a border of azimuth, anywhere in elevation, or the other way round.
                const double turn =
                    (i / 2 % 2 == 0 ? std::floor(unit(random) * azimuths) * wedge + off : unit(random) * 2 * M_PI);
                const double height = (i / 2 % 2 == 1 ? -M_PI / 2 + std::floor(unit(random) * elevations) * band + off
                                                      : (unit(random) - 0.5) * M_PI);
                // As the rounded direction has it.
                const glm::vec3 d(std::cos(height) * std::cos(turn), std::cos(height) * std::sin(turn),
                                  std::sin(height));
                const double x = d.x, y = d.y, z = d.z, isTurn = std::atan2(y, x),
                             isHeight = std::atan2(z, std::hypot(x, y));
                const int cone = coneOf(borders, d);
                const double middle = (cone % azimuths + 0.5) * wedge, low = -M_PI / 2 + cone / azimuths * band;
                ASSERT_LE(std::abs(std::remainder(isTurn - middle, 2 * M_PI)), wedge / 2 + kBound)
                    << azimuths << "x" << elevations << " ray " << i;
                ASSERT_GE(isHeight, low - kBound) << azimuths << "x" << elevations << " ray " << i;
                ASSERT_LE(isHeight, low + band + kBound) << azimuths << "x" << elevations << " ray " << i;
            }
        }
}

/// Rays from random points: the surface is never nearer than what their cell says of their cone.
struct Oversteps {
    uint64_t rays = 0, over = 0;
    double worst = 0;
};
Oversteps countOversteps(const Shape& shape, const DistanceMap& map, uint32_t seed, int rays) {
    std::mt19937 random(seed);
    Oversteps result;
    for (int i = 0; i < rays; ++i) {
        const MarchRay ray = test::rayAnywhere(random, shape.extent());
        const glm::ivec3 cell(glm::floor(ray.origin / map.grid.cell));
        const int cone = coneOf(ConeBorders(map.cones), glm::vec3(ray.direction));
        if (cell.z >= map.grid.cells.z || map.steps[map.slot(cone, cell)] == kOccupied || shape.field(ray.origin) <= 0)
            continue;
        const TruthHit truth = shape.trace(ray.origin, ray.direction, 2);
        const double length = map.length(cone, cell);
        ++result.rays;
        if (truth.hit && truth.t < length) ++result.over, result.worst = std::max(result.worst, length - truth.t);
    }
    return result;
}

TEST(DistanceMap, NoStepPassesTheSurface) {
    for (const char* name : {"beads", "weave", "scales", "kitten"}) {
        const auto shape = test::solid(name);
        const Occupancy occupancy = test::occupied(*shape, {24, 24, 8});
        for (const Cones cones : {Cones{1, 1}, Cones{4, 1}, Cones{4, 2}, Cones{8, 1}, Cones{6, 3}}) {
            const Oversteps found = countOversteps(*shape, test::distances(occupancy, {.cones = cones}), 9, 1500);
            EXPECT_GT(found.rays, 300u) << name;
            EXPECT_EQ(found.over, 0u) << name << " " << cones.azimuth << "x" << cones.elevation << " by "
                                      << found.worst;
        }
    }
}

TEST(DistanceMap, ThePapersRuleOversteps) {
    const auto shape = test::solid("beads");
    const Occupancy occupancy = test::occupied(*shape, {24, 24, 8});
    EXPECT_GT(
        countOversteps(*shape, test::distances(occupancy, {.cones = {4, 1}, .rule = DistanceRule::Paper}, shape.get()),
                       2, 20000)
            .over,
        0u);
    EXPECT_EQ(countOversteps(
                  *shape, test::distances(occupancy, {.cones = {4, 1}, .rule = DistanceRule::PaperSafe}, shape.get()),
                  2, 20000)
                  .over,
              0u);
}

TEST(DistanceMap, RefusesWhatItCannotBuild) {
    const Occupancy occupancy = randomOccupancy({8, 8, 8}, {1, 1, 1}, 0.1, 1);
    EXPECT_EQ(buildDistanceMap(occupancy, {.cones = {0, 1}}).error().code, ErrorCode::Usage);
    EXPECT_EQ(buildDistanceMap(occupancy, {.cones = {64, 1}}).error().code, ErrorCode::Usage);
    EXPECT_EQ(buildDistanceMap(occupancy, {.cones = {}, .cap = -1}).error().code, ErrorCode::Usage);
    EXPECT_EQ(buildDistanceMap(occupancy, {.cones = {}, .rule = DistanceRule::Paper}).error().code, ErrorCode::Usage);
    EXPECT_EQ(occupy(*test::solid("ball"), {0, 8, 8}).error().code, ErrorCode::Usage);
    EXPECT_EQ(occupy(*test::solid("ball"), {4096, 4096, 4096}).error().code, ErrorCode::Limit);
}

TEST(OctantBoxes, AreEmptyAndCannotGrow) {
    const Occupancy occupancy = randomOccupancy({9, 7, 6}, {1, 1, 0.6}, 0.03, 21);
    const OctantBoxes boxes = buildOctantBoxes(occupancy);
    const auto isEmpty = [&](glm::ivec3 at, glm::ivec3 sign, glm::ivec3 extent) {
        for (int z = 0; z <= extent.z; ++z)
            for (int y = 0; y <= extent.y; ++y)
                for (int x = 0; x <= extent.x; ++x)
                    if (occupancy.at(at + sign * glm::ivec3(x, y, z))) return false;
        return true;
    };
    for (int octant = 0; octant < 8; ++octant)
        for (size_t i = 0; i < occupancy.cells.size(); ++i) {
            const uint16_t box = boxes.boxes[size_t(octant) * occupancy.cells.size() + i];
            ASSERT_EQ(box >> 15, occupancy.cells[i]);
            if (box >> 15) continue;
            const glm::ivec3 sign(octant & 1 ? -1 : 1, octant & 2 ? -1 : 1, octant & 4 ? -1 : 1),
                extent(box & 31, box >> 5 & 31, box >> 10 & 31), at = occupancy.grid.at(i);
            ASSERT_TRUE(isEmpty(at, sign, extent)) << "cell " << i << " octant " << octant;
            for (int axis = 0; axis < 3; ++axis) {
                glm::ivec3 more = extent;
                if (++more[axis] > OctantBoxes::kMost) continue;
                ASSERT_FALSE(isEmpty(at, sign, more)) << "cell " << i << " octant " << octant << " axis " << axis;
            }
        }
}

TEST(CompressedMap, IsNeverLongerAndKeepsTheSurface) {
    const auto shape = test::solid("kitten");
    const Occupancy occupancy = test::occupied(*shape, {32, 32, 16});
    const DistanceMap map = test::distances(occupancy, {.cones = {4, 2}});
    for (const std::vector<int>& factors : {std::vector<int>{2}, {4}, {8}, {4, 2}, {2, 2, 2}, {5}}) {
        const auto compressed = compressMap(map, factors);
        ASSERT_TRUE(compressed.ok());
        const MarchArrays arrays = *gridArrays({.compressed = &*compressed}, {});
        f32::ArrayMarch march{arrays.record, arrays.words.data(), 0, f32::kMesoCompressed, 0, 0};
        int blocks = 0;
        for (int cone = 0; cone < 8; ++cone)
            for (size_t i = 0; i < occupancy.cells.size(); ++i) {
                const glm::ivec3 at = map.grid.at(i);
                uint32_t fetches = 0;
                // From a tile further left, towards the cone's octant; the way to a brick is read once.
                const glm::ivec3 sign = 1 - 2 * glm::ivec3(cone & 1, cone >> 1 & 1, cone >> 2);
                const auto lookUp = [&](f32::ArrayMarch::KeptBlock& kept) {
                    return march.lookUp(uint32_t(cone), at - glm::ivec3(map.grid.cells.x, 0, 0), sign, kept, fetches);
                };
                f32::ArrayMarch::KeptBlock kept = march.noBlock();
                const f32::ArrayMarch::Space found = lookUp(kept);
                ASSERT_EQ(found.occupied, occupancy.cells[i] != 0);
                ASSERT_LE(found.reach, found.occupied ? 0 : map.length(cone, at));
                ASSERT_GE(fetches, 1u);
                ASSERT_LE(fetches, compressed->levels.size());
                for (glm::ivec3 k(0); k.z <= found.further.z; k.z++)
                    for (k.y = 0; k.y <= found.further.y; k.y++)
                        for (k.x = 0; k.x <= found.further.x; k.x++)
                            ASSERT_EQ(occupancy.cells[map.grid.index(at + sign * k)] != 0, found.occupied);
                blocks += found.further != glm::ivec3(0);
                const bool isOfBrick = kept.block.x >= 0;
                fetches = 0;
                const f32::ArrayMarch::Space again = lookUp(kept);
                ASSERT_EQ(again.occupied, found.occupied);
                ASSERT_EQ(again.reach, found.reach);
                ASSERT_TRUE(fetches == 1 || !isOfBrick);
            }
        EXPECT_GT(blocks, 0);
        EXPECT_GT(compressed->texelRatio(), factors[0] == 2 ? 0.5 : 1.0);
    }
    EXPECT_LT(compressMap(map, std::vector{4})->bytes(), map.bytes());
    EXPECT_FALSE(compressMap(map, {}).ok());
    EXPECT_FALSE(compressMap(map, std::vector{1}).ok());
    EXPECT_FALSE(compressMap(map, std::vector{16, 16}).ok());
}

}  // namespace
}  // namespace vcp::meso
