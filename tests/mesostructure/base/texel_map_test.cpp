#include "mesostructure/base/texel_map.h"

#include <map>
#include <random>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "mesostructure/base/manifold_part.h"
#include "mesostructure/base/surface_edges.h"
#include "mesostructure/base/texel_values.h"
#include "tests/mesostructure/base/surfaces.h"

namespace vcp::meso {
namespace {

using namespace test;
using glm::dvec2, glm::dvec3, glm::ivec2;

TexelMap atlasOf(const BaseSurface& surface, int size) {
    auto made = makeAtlas(surface, size);
    EXPECT_TRUE(made) << made.error().line();
    return made ? *std::move(made) : TexelMap();
}

/// The texels of a chart, counted from its right angle.
std::vector<ivec2> texelsOf(const TexelMap& map, size_t triangle) {
    const auto& p = map.places[triangle];
    int corner = 0;
    for (int k = 0; k < 3; ++k)
        if (glm::dot(p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]) == 0) corner = k;
    const ivec2 from(p[corner]);
    const int n = map.steps[triangle];
    const ivec2 one = (ivec2(p[(corner + 1) % 3]) - from) / n, other = (ivec2(p[(corner + 2) % 3]) - from) / n;
    std::vector<ivec2> all;
    for (int i = 0; i <= n; ++i)
        for (int j = 0; i + j <= n; ++j) all.push_back(from + i * one + j * other);
    return all;
}

/// Random values, one a texel.
std::vector<float> randomValues(const TexelMap& map) {
    std::mt19937 random(11);
    std::uniform_real_distribution<float> unit(0, 1);
    std::vector<float> values(map.texels());
    for (float& value : values) value = unit(random);
    return values;
}

double bilinear(const TexelMap& map, const std::vector<float>& values, dvec2 at) {
    const dvec2 low = glm::floor(at), part = at - low;
    const auto value = [&](int i, int j) {
        const int x = std::min(int(low.x) + i, map.size - 1), y = std::min(int(low.y) + j, map.size - 1);
        return double(values[size_t(x) + size_t(map.size) * size_t(y)]);
    };
    return (value(0, 0) * (1 - part.x) + value(1, 0) * part.x) * (1 - part.y) +
           (value(0, 1) * (1 - part.x) + value(1, 1) * part.x) * part.y;
}

TEST(TexelMap, ChartsKeepApart) {
    for (const char* name : {"quad", "box", "sphere", "torus", "teapot"}) {
        SCOPED_TRACE(name);
        const BaseSurface surface = shape(name);
        const TexelMap map = atlasOf(surface, surface.triangles.size() > 3000 ? 1024 : 512);
        ASSERT_EQ(map.places.size(), surface.triangles.size());
        std::vector<uint32_t> owners(map.texels(), kNoTriangle);
        const auto at = [&](int x, int y) -> uint32_t& { return owners[size_t(x) + size_t(map.size) * size_t(y)]; };
        for (uint32_t i = 0; i < surface.triangles.size(); ++i)
            for (const ivec2 texel : texelsOf(map, i)) {
                ASSERT_TRUE(texel.x >= 1 && texel.y >= 1 && texel.x < map.size - 1 && texel.y < map.size - 1);
                ASSERT_EQ(at(texel.x, texel.y), kNoTriangle) << "two charts share a texel";
                at(texel.x, texel.y) = i;
            }
        // Between the texels of two charts lie two others along a row or column, one along a diagonal.
        int near = 0;
        for (int y = 0; y + 2 < map.size; ++y)
            for (int x = 2; x + 2 < map.size; ++x)
                for (const ivec2 step :
                     {ivec2(1, 0), {2, 0}, {0, 1}, {0, 2}, {1, 1}, {-1, 1}, {2, 1}, {-2, 1}, {1, 2}, {-1, 2}}) {
                    const uint32_t one = at(x, y), other = at(x + step.x, y + step.y);
                    near += one != kNoTriangle && other != kNoTriangle && one != other;
                }
        EXPECT_EQ(near, 0);
        // Owners are those, and no texel is in two triangles.
        const auto found = ownersOf(map, 1.5);
        ASSERT_TRUE(found) << found.error().line();
        size_t others = 0;
        for (size_t texel = 0; texel < owners.size(); ++texel)
            others += owners[texel] != kNoTriangle && (*found)[texel] != owners[texel];
        EXPECT_EQ(others, 0u);
    }
}

TEST(TexelMap, LargeTrianglesGetMoreTexels) {
    BaseSurface surface = square(4);
    for (dvec3& p : surface.positions)
        if (p.x > 0.9) p.x = 8;  // the last column is thirty times as wide
    const TexelMap map = atlasOf(surface, 256);
    EXPECT_GT(map.steps[6], 2 * map.steps[0]);
    size_t used = 0;
    for (size_t i = 0; i < surface.triangles.size(); ++i) used += texelsOf(map, i).size();
    EXPECT_GT(double(used), 0.3 * double(map.texels()));
}

TEST(TexelMap, ValuesAlongEdgesAreTheSameFromBothSides) {
    for (const char* name : {"box", "torus", "cylinder"}) {
        SCOPED_TRACE(name);
        BaseSurface surface = shape(name);
        for (dvec3& p : surface.positions) p.z *= p.x > 0 ? 3 : 1;  // charts of different sizes meet
        const TexelMap map = atlasOf(surface, 1024);
        std::vector<float> values = randomValues(map);
        conformEdges(surface, map, std::span(values));
        std::map<std::pair<uint32_t, uint32_t>, std::vector<std::pair<size_t, int>>> edges;
        for (size_t i = 0; i < surface.triangles.size(); ++i)
            for (int k = 0; k < 3; ++k)
                edges[std::minmax(surface.triangles[i][k], surface.triangles[i][(k + 1) % 3])].emplace_back(i, k);
        size_t joined = 0, unequal = 0;
        for (const auto& [ends, sides] : edges) {
            if (sides.size() != 2) continue;
            ++joined;
            unequal += map.steps[sides[0].first] != map.steps[sides[1].first];
            for (int s = 0; s <= 97; ++s) {
                double seen[2];
                for (size_t side = 0; side < 2; ++side) {
                    const auto [i, k] = sides[side];
                    const bool isReversed = surface.triangles[i][k] != ends.first;
                    const double part = isReversed ? 1 - s / 97.0 : s / 97.0;
                    const dvec2 from = map.places[i][k], to = map.places[i][(k + 1) % 3];
                    seen[side] = bilinear(map, values, from + part * (to - from));
                }
                ASSERT_NEAR(seen[0], seen[1], 3e-6) << "edge " << ends.first << ", " << ends.second << " at " << s;
            }
        }
        EXPECT_GT(joined, 100u);
        EXPECT_GT(unequal, 5u);
    }
}

TEST(TexelMap, GapsAreFilledWithinTheirChart) {
    const BaseSurface surface = square(2);
    const TexelMap map = atlasOf(surface, 64);
    const std::vector<uint32_t> owners = *ownersOf(map, 2), charts = chartsOf(surface, map);
    std::vector<float> values(map.texels(), std::numeric_limits<float>::quiet_NaN());
    // One texel of each chart but the last has a value, its number.
    for (size_t i = 0; i + 1 < surface.triangles.size(); ++i) {
        const ivec2 texel = texelsOf(map, i)[5];
        values[size_t(texel.x) + 64 * size_t(texel.y)] = float(i);
    }
    fillMissing({map, owners, charts}, std::span(values));
    for (size_t texel = 0; texel < values.size(); ++texel) {
        if (owners[texel] == kNoTriangle || owners[texel] + 1 == surface.triangles.size())
            EXPECT_TRUE(std::isnan(values[texel]));
        else
            EXPECT_EQ(values[texel], float(owners[texel]));
    }
}

TEST(TexelMap, GivenCoordinatesAreThoseOfOtherPrograms) {
    const auto map = givenMap(square(1), 16);
    ASSERT_TRUE(map) << map.error().line();
    // What lies between four texels of the map never has one of the opposite border.
    EXPECT_EQ(map->places[0][0], dvec2(0));
    EXPECT_EQ(map->places[0][2], dvec2(15));
    EXPECT_FALSE(map->isAtlas());
    const auto owners = ownersOf(*map, 1);
    ASSERT_TRUE(owners);
    // The diagonal belongs to the first.
    EXPECT_EQ((*owners)[0], 0u);
    EXPECT_EQ((*owners)[3], 0u);
    EXPECT_EQ((*owners)[3 * 16], 1u);
    // Both triangles are one chart, for they share an edge and the map along it.
    EXPECT_EQ(chartsOf(square(1), *map)[0], chartsOf(square(1), *map)[1]);
}

TEST(TexelMap, WhatIsNoMapIsNamed) {
    const auto problem = [](auto change) {
        BaseSurface surface = square(2);
        change(surface.uvs);
        auto map = givenMap(surface, 64);
        const auto owners = map ? ownersOf(*map, 2) : Result<std::vector<uint32_t>>(map.error());
        return owners ? std::string() : owners.error().line();
    };
    EXPECT_EQ(problem([](auto&) {}), "");
    EXPECT_NE(problem([](auto& uvs) { uvs[3][1].x = NAN; }).find("triangle 3: a texture coordinate is not finite"),
              std::string::npos);
    EXPECT_NE(problem([](auto& uvs) { uvs[5][0].y = 1.5; }).find("triangle 5: the texture coordinates"),
              std::string::npos);
    EXPECT_NE(problem([](auto& uvs) {
                  uvs[2] = {uvs[2][0], uvs[2][1], uvs[2][0]};
              }).find("triangle 2: its texture coordinates have no area"),
              std::string::npos);
    EXPECT_NE(problem([](auto& uvs) { uvs[7] = uvs[1]; }).find("triangle 1: it and triangle 7 overlap"),
              std::string::npos);
    EXPECT_NE(problem([](auto& uvs) { uvs.pop_back(); }).find("not every triangle"), std::string::npos);
}

TEST(TexelMap, TooManyTrianglesAreRefused) {
    const BaseSurface sphere = shape("sphere");
    const auto small = makeAtlas(sphere, 64);
    ASSERT_FALSE(small);
    EXPECT_EQ(small.error().code, ErrorCode::Limit);
    // Triangles without area have charts, too.
    BaseSurface flat = square(3);
    for (dvec3& p : flat.positions) p = dvec3(1, 2, 3);
    EXPECT_EQ(atlasOf(flat, 64).steps, std::vector<int>(18, kLeastChartSteps));
}

TEST(ManifoldPart, WhatIsTooMuchOnAnEdgeGoes) {
    // Three triangles on one edge, one with equal corners, two turned against each other.
    BaseSurface surface{
        {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, -1, 0}, {5, 0, 0}, {6, 0, 0}, {5, 1, 0}, {5, -1, 0}},
        {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}, {2, 2, 3}, {5, 6, 7}, {5, 6, 8}},
        {}};
    EXPECT_FALSE(edgesOf(surface));
    EXPECT_EQ(keepManifoldPart(surface), 2u);
    EXPECT_EQ(surface.triangles.size(), 3u);
    EXPECT_TRUE(edgesOf(surface));
    BaseSurface torus = shape("torus");
    const size_t all = torus.triangles.size();
    EXPECT_EQ(keepManifoldPart(torus), 0u);
    EXPECT_EQ(torus.triangles.size(), all);
    EXPECT_EQ(torus.uvs.size(), all);
}

}  // namespace
}  // namespace vcp::meso
