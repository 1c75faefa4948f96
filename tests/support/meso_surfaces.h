// Surfaces with mesostructure for tests of pictures.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "mesostructure/method.h"
#include "render/meso_surface.h"
#include "tests/support/meso_rays.h"

namespace vcp::test {

inline meso::Asset heightAsset(const std::string& name, meso::HeightMap map) {
    meso::Asset asset;
    asset.name = name;
    asset.extent = map.extent();
    asset.heights = std::move(map);
    return asset;
}

inline meso::Asset solidAsset(const std::string& name) {
    meso::Asset asset;
    asset.name = asset.solid = name;
    asset.extent = meso::test::solid(name)->extent();
    return asset;
}

/// Everywhere 3/5 of the slab high.
inline meso::Asset plateau() { return heightAsset("plateau", {{8, 8}, 0.25, std::vector<uint16_t>(64, 39321)}); }

/// An asset on a base surface of 2 units, moved to a place. `height`: of the slab, world units.
inline MesoSurface mesoSurface(const meso::Asset& asset, const std::string& method, std::string_view base,
                               double height, double tiles = 2, glm::dvec3 place = glm::dvec3(0)) {
    const auto shape = shapeOf(asset);
    const auto made = buildMethod(asset, **shape, {.name = method, .cells = 8});
    EXPECT_TRUE(made) << made.error().line();
    meso::BaseSurface surface = *meso::makeBaseSurface(base, tiles);
    for (glm::dvec3& p : surface.positions) p += place;
    MesoSurface placed;
    placed.arrays = std::make_shared<const meso::MarchArrays>(*made->arrays());
    placed.shell = *buildShell(surface, height, asset.extent);
    placed.lift = shadowLift(*placed.arrays, tileEdge(surface));
    return placed;
}

}  // namespace vcp::test
