// Seeded rays into a tile, and shapes by name.
#pragma once

#include <cmath>
#include <memory>
#include <random>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "mesostructure/march.h"
#include "mesostructure/solids.h"

namespace vcp::meso::test {

/// A ray into the top of the slab at an elevation between `low` and `high` degrees below the horizon.
inline MarchRay rayFromTop(std::mt19937& random, glm::dvec3 extent, double low = 5, double high = 85) {
    std::uniform_real_distribution<double> unit(0, 1);
    const double elevation = (low + (high - low) * unit(random)) * M_PI / 180, turn = 2 * M_PI * unit(random);
    return {{unit(random) * extent.x, unit(random) * extent.y, extent.z},
            {std::cos(elevation) * std::cos(turn), std::cos(elevation) * std::sin(turn), -std::sin(elevation)}};
}

/// From anywhere in the slab, in any direction.
inline MarchRay rayAnywhere(std::mt19937& random, glm::dvec3 extent) {
    std::uniform_real_distribution<double> unit(0, 1);
    std::normal_distribution<double> bell;
    return {{unit(random) * extent.x, unit(random) * extent.y, unit(random) * extent.z},
            glm::normalize(glm::dvec3(bell(random), bell(random), bell(random))),
            20};
}

inline std::unique_ptr<Shape> solid(const std::string& name) {
    auto shape = solidShape(name, 1);
    EXPECT_TRUE(shape.ok()) << shape.error().line();
    return *std::move(shape);
}

inline std::unique_ptr<Shape> heights(const HeightMap& map) {
    auto shape = heightShape(map);
    EXPECT_TRUE(shape.ok()) << shape.error().line();
    return *std::move(shape);
}

inline Occupancy occupied(const Shape& shape, glm::ivec3 cells) {
    auto made = occupy(shape, cells);
    EXPECT_TRUE(made.ok()) << made.error().line();
    return *std::move(made);
}

inline DistanceMap distances(const Occupancy& occupancy, DistanceOptions options, const Shape* shape = nullptr) {
    auto made = buildDistanceMap(occupancy, options, shape);
    EXPECT_TRUE(made.ok()) << made.error().line();
    return *std::move(made);
}

inline std::unique_ptr<Marcher> walk(const Skipping& skipping, const Surface& surface) {
    auto made = gridMarcher(skipping, surface);
    EXPECT_TRUE(made.ok()) << made.error().line();
    return *std::move(made);
}

}  // namespace vcp::meso::test
