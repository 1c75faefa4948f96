// Displacement maps against rays traced in the solid, and their marchers against what the tables say.
#include "mesostructure/gdm_map.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <glm/geometric.hpp>

#include "mesostructure/gdm/beam_lengths.h"
#include "mesostructure/method.h"
#include "tests/support/meso_rays.h"

namespace vcp::meso {
namespace {

Asset solidAsset(const std::string& name) {
    Asset asset;
    asset.name = asset.solid = name;
    asset.extent = test::solid(name)->extent();
    return asset;
}

TEST(GdmTable, SaysWhatARayOfEachNodeMeets) {
    for (const char* name : {"beads", "weave", "fbm"}) {
        Asset asset = solidAsset(std::string(name) == "fbm" ? "beads" : name);
        if (std::string(name) == "fbm") asset.solid.clear(), asset.heights = *makeHeightField("fbm", 32, 2);
        const auto shape = *shapeOf(asset);
        asset.extent = shape->extent();
        for (const bool ofTop : {false, true}) {
            const auto table = traceTable(asset, *shape, {.points = {6, 5, 4}, .directions = {6, 8}, .ofTop = ofTop});
            ASSERT_TRUE(table) << table.error().line();
            EXPECT_EQ(table->rows() * table->columns(), 6u * 5u * (ofTop ? 1u : 4u) * 6u * 8u);
            int wrong = 0, entries = 0;
            for (int z = 0; z < table->nodes.z; ++z)
                for (int y = 0; y < 5; ++y)
                    for (int x = 0; x < 6; ++x)
                        for (int theta = 0; theta < 6; ++theta)
                            for (int phi = 0; phi < 8; ++phi) {
                                const size_t row = table->row(x, y, phi), column = table->column(theta, phi, z);
                                const glm::dvec3 p = table->point(x, y, z), d = table->directions.direction(theta, phi);
                                const TruthHit truth = shape->trace(p, d, 1e3);
                                const bool inside = shape->field(p) <= 0, isHit = inside || truth.hit;
                                const double out = d.z > 0 ? (asset.extent.z - p.z) / d.z : -p.z / d.z;
                                const double expected = inside ? 0 : truth.hit ? truth.t : out;
                                ++entries;
                                wrong += table->isHit(row, column) != isHit ||
                                         std::abs(double(table->distance(row, column)) - expected) > 1.0 / 128;
                            }
            // The samples of a solid's distances stray from it at silhouettes.
            EXPECT_LE(wrong, asset.heights ? 0 : entries / 100) << name << (ofTop ? " top" : "");
        }
    }
}

TEST(GdmTable, NeedsMemoryAndSaneNumbers) {
    const Asset asset = solidAsset("ball");
    const auto shape = *shapeOf(asset);
    const auto codeOf = [&](const GdmOptions& options) { return traceTable(asset, *shape, options).error().code; };
    EXPECT_EQ(codeOf({.points = {128, 128, 16}, .memoryBytes = 64 << 20}), ErrorCode::Limit);
    for (const int n : {-1, 0, 1, 1000000}) {
        EXPECT_EQ(codeOf({.points = {n, 8, 4}}), ErrorCode::Usage) << n;
        EXPECT_EQ(codeOf({.directions = {n, 8}}), ErrorCode::Usage) << n;
        EXPECT_EQ(codeOf({.directions = {8, n}}), ErrorCode::Usage) << n;
        for (const char* name : {"gdm", "vdm", "slices"})
            EXPECT_EQ(
                n == 0 || buildMethod(asset, *shape, {.name = name, .cells = n, .directions = {4, 4}}).error().code ==
                              ErrorCode::Usage,
                true)
                << name << " " << n;
    }
    EXPECT_EQ(buildMethod(asset, *shape, {.name = "gdm", .rank = 1000000}).error().code, ErrorCode::Usage);
    EXPECT_EQ(buildMethod(asset, *shape, {.name = "gdm", .rank = -1}).error().code, ErrorCode::Usage);
    // Cancelling is told apart.
    EXPECT_EQ(codeOf({.points = {8, 8, 4}, .shareOut = [](size_t, const auto&) { return false; }}),
              ErrorCode::Cancelled);
}

TEST(GdmTable, IsTheSameInAnyOrder) {
    const Asset asset = solidAsset("chain");
    const auto shape = *shapeOf(asset);
    const auto whole = traceTable(asset, *shape, {.points = {8, 8, 4}, .directions = {4, 8}});
    const auto parts = traceTable(
        asset, *shape, {.points = {8, 8, 4}, .directions = {4, 8}, .shareOut = [](size_t count, const auto& fill) {
                            for (size_t i = count; i > 0; --i) fill(i - 1, i);
                            return true;
                        }});
    ASSERT_TRUE(whole && parts);
    EXPECT_EQ(whole->steps, parts->steps);
    EXPECT_EQ(whole->hits, parts->hits);
}

/// At a sample's place and direction a map says what its table does.
TEST(GdmMarch, SaysAtSamplesWhatTheTableSays) {
    const Asset asset = solidAsset("weave");
    const auto shape = *shapeOf(asset);
    for (const bool ofTop : {false, true}) {
        const auto table = *traceTable(asset, *shape, {.points = {16, 16, 5}, .directions = {8, 16}, .ofTop = ofTop});
        const auto volume = *sampleProperties(*shape, {16, 16, 5});
        for (const auto& [rank, bits] : {std::pair{0, 16}, {0, 8}, {64, 16}}) {
            const int most = std::min<int>(rank, int(table.columns()));
            const auto map = packMap(table, most, bits, true, volume);
            ASSERT_TRUE(map) << map.error().line();
            const auto marcher = *gdmMarcher(*map);
            // Factors are judged by their own product, not by what was dropped.
            const double tolerance = bits == 8 ? double(table.unit) * 257 : 2e-3;
            std::mt19937 random(3);
            int hits = 0;
            for (int i = 0; i < 4000; ++i) {
                const int x = int(random() % 16), y = int(random() % 16), z = int(random() % unsigned(table.nodes.z)),
                          theta = int(random() % 8), phi = int(random() % 16);
                const glm::dvec3 d = table.directions.direction(theta, phi);
                const size_t row = table.row(x, y, phi), column = table.column(theta, phi, z);
                const MarchResult found = marcher->march({table.point(x, y, z), d});
                ASSERT_EQ(found.state == MarchState::Hit, table.isHit(row, column)) << i;
                EXPECT_EQ(found.fetches, (most > 0 ? unsigned(most + 3) / 4 * 2 : 4) +
                                             (found.t > 0 || table.isHit(row, column) ? 2u : 1u))
                    << i;
                if (found.state != MarchState::Hit) continue;
                ++hits;
                const double out = asset.extent.z / std::abs(d.z);
                const double expected = most > 0 ? std::clamp(map->factors->value(row, column), 0.0, out)
                                                 : double(table.distance(row, column));
                EXPECT_NEAR(found.t,
                            std::min(expected, d.z > 0 ? (asset.extent.z - table.point(x, y, z).z) / d.z
                                                       : table.point(x, y, z).z / -d.z),
                            tolerance)
                    << i;
            }
            EXPECT_GT(hits, 500);
        }
    }
}

/// Over steep height fields the field is far less than the distance; the density is not.
TEST(GdmMap, DensityIsAHalfOnTheSurfaceAndGoneAPointOffIt) {
    const HeightMap map = *makeHeightField("hemispheres", 64, 1);
    const auto shape = test::heights(map);
    const glm::ivec3 points{24, 24, 9};
    const auto volume = *sampleProperties(*shape, points);
    const glm::dvec3 spacing = shape->extent() / glm::dvec3(points.x, points.y, points.z - 1);
    const double widest = std::max({spacing.x, spacing.y, spacing.z});
    int empty = 0, full = 0, between = 0;
    for (int i = 0; i < points.x * points.y * points.z; ++i) {
        const glm::dvec3 p = glm::dvec3(i % points.x, i / points.x % points.y, i / points.x / points.y) * spacing;
        const double off = shape->distance(p, 2 * widest), density = double(volume.texels[size_t(i)] >> 24) / 255;
        const bool inside = shape->field(p) <= 0;
        EXPECT_NEAR(density, std::clamp(0.5 + (inside ? off : -off) / (2 * widest), 0.0, 1.0), 0.02) << i;
        (density == 0 ? empty : density == 1 ? full : between) += 1;
    }
    EXPECT_GT(empty, 100);
    EXPECT_GT(full, 10);
    EXPECT_GT(between, 100);
}

/// Many slices find a plane where it is; few find it as far off as they are apart.
TEST(GdmMarch, SlicesComeNearerTheMoreThereAre) {
    const auto shape = test::solid("beads");
    double before = 1;
    for (const int n : {16, 64, 256}) {
        const auto volume = *sampleProperties(*shape, {n, n, n / 4 + 1});
        const auto marcher = slicesMarcher(volume);
        std::mt19937 random(8);
        std::vector<double> errors;
        for (int i = 0; i < 1500; ++i) {
            const MarchRay ray = test::rayFromTop(random, shape->extent(), 50);
            const MarchResult found = marcher->march(ray);
            const TruthHit truth = shape->trace(ray.origin, ray.direction, ray.tMax);
            ASSERT_TRUE(truth.hit);
            ASSERT_EQ(found.state, MarchState::Hit) << i;
            errors.push_back(std::abs(found.t - truth.t));
        }
        std::nth_element(errors.begin(), errors.begin() + 750, errors.end());
        EXPECT_LT(errors[750], 1.5 / n);
        EXPECT_LT(errors[750], before);
        before = errors[750];
    }
}

/// Each beam's length, cell by cell, against rays that start anywhere in the cell and go anywhere in the cone.
TEST(GdmBeams, NoRayMeetsAnOccupiedCellWithinTheLength) {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> unit(0, 1);
    for (const glm::ivec3 cells : {glm::ivec3(12, 10, 7), glm::ivec3(5, 9, 20)}) {
        Occupancy occupancy{TileGrid(cells, {1, double(cells.y) / cells.x * 1.3, 0.5}), {}};
        occupancy.cells.resize(occupancy.grid.count());
        for (uint8_t& cell : occupancy.cells) cell = random() % 40 == 0;
        occupancy.cells[0] = 1;
        for (const Cones cones : {Cones{32, 16}, Cones{8, 4}, Cones{11, 5}}) {
            const DistanceMap map = test::distances(occupancy, {.cones = cones, .cap = 1});
            const ConeBorders borders(cones);
            double sum = 0;
            for (int i = 0; i < 20000; ++i) {
                const size_t at = random() % occupancy.grid.count();
                const glm::ivec3 cell = occupancy.grid.at(at);
                if (occupancy.at(cell)) continue;
                const MarchRay ray = test::rayAnywhere(random, {1, 1, 1});
                const double length = double(map.length(coneOf(borders, glm::vec3(ray.direction)), cell));
                sum += length;
                const glm::dvec3 from = occupancy.grid.lower(cell) +
                                        occupancy.grid.cell * glm::dvec3(unit(random), unit(random), unit(random));
                for (int k = 0; k <= 200; ++k) {
                    const glm::dvec3 p = from + ray.direction * (length * k / 200);
                    if (p.z < 0 || p.z >= occupancy.grid.extent().z) break;
                    ASSERT_FALSE(occupancy.at(glm::ivec3(glm::floor(p / occupancy.grid.cell))))
                        << i << ", " << k << " of 200";
                }
            }
            EXPECT_GT(sum, 500) << cones.azimuth;
            // They fall short of the least distance of any pair by little.
            if (cones.azimuth != 8) continue;
            const DistanceMap least = test::distances(occupancy, {.cones = cones, .cap = 1, .search = true});
            double ofBeams = 0, ofPairs = 0;
            for (size_t i = 0; i < map.steps.size(); ++i)
                if (map.steps[i] != kOccupied) ofBeams += map.steps[i], ofPairs += least.steps[i];
            EXPECT_GT(ofBeams, 0.6 * ofPairs);
        }
    }
}

/// Guesses change what is fetched, not what is hit.
TEST(GdmMarch, GuessesChangeNoHit) {
    int farther = 0;
    for (const char* name : {"beads", "chain", "ball", "fbm"}) {
        Asset asset = solidAsset(std::string(name) == "fbm" ? "beads" : name);
        if (std::string(name) == "fbm") asset.solid.clear(), asset.heights = *makeHeightField("fbm", 64, 2);
        const auto shape = *shapeOf(asset);
        const auto boxes = *buildMethod(asset, *shape, {.name = "boxes", .cells = 16})->marcher();
        for (const int most : {1, 3}) {
            const auto method = buildMethod(
                asset, *shape,
                {.name = "gdm-safe", .cells = 16, .guesses = {.clusters = 4, .rounds = 1}, .mostGuesses = most});
            ASSERT_TRUE(method) << method.error().line();
            const auto safe = *method->marcher();
            EXPECT_TRUE(safe->isConservative());
            std::mt19937 random(7);
            int hits = 0;
            for (int i = 0; i < 4000; ++i) {
                const MarchRay ray =
                    i % 2 ? test::rayFromTop(random, shape->extent(), 3) : test::rayAnywhere(random, shape->extent());
                const MarchResult a = boxes->march(ray), b = safe->march(ray);
                ASSERT_EQ(a.state, b.state) << name << " " << i;
                farther += b.iterations < a.iterations;
                if (a.state != MarchState::Hit) continue;
                ASSERT_EQ(a.t, b.t) << name << " " << i;
                ASSERT_EQ(a.normal, b.normal) << name << " " << i;
                ++hits;
            }
            EXPECT_GT(hits, 100) << name;
        }
    }
    EXPECT_GT(farther, 100);
}

}  // namespace
}  // namespace vcp::meso
