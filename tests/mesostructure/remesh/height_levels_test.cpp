// Filter levels of height maps: least volumes against their bound, ranges against a slow search.
#include "mesostructure/remesh/height_levels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <span>
#include <utility>

#include <gtest/gtest.h>

#include "mesostructure/solids.h"

namespace vcp::meso {
namespace {

HeightMap mapOf(std::string_view name, int texels = 64) {
    auto made = makeHeightField(name, texels, 1);
    EXPECT_TRUE(made.ok());
    return *std::move(made);
}

HeightLevels levelsOf(const HeightMap& map, const LevelFitOptions& options = {}) {
    auto made = HeightLevels::build(map, options);
    EXPECT_TRUE(made.ok()) << made.error().line();
    return *std::move(made);
}

TEST(HeightLevels, HalveDownToOneHeight) {
    HeightMap map{{24, 5}, 0.5, std::vector<uint16_t>(120, 32768)};
    const HeightLevels levels = levelsOf(map);
    std::vector<glm::ivec2> sizes;
    for (const HeightLevel& level : levels.levels()) {
        sizes.push_back(level.size);
        EXPECT_EQ(level.texels.size(), size_t(level.size.x) * size_t(level.size.y));
        for (const uint16_t texel : level.texels) EXPECT_EQ(texel, 32768);
    }
    EXPECT_EQ(sizes, (std::vector<glm::ivec2>{{24, 5}, {12, 2}, {6, 1}, {3, 1}, {1, 1}}));
    EXPECT_NEAR(levels.height(2, glm::dvec2(0.3, 0.1)), 32768 / 65535.0, 1e-6);
}

TEST(HeightLevels, LevelNoughtIsTheMap) {
    const HeightMap map = mapOf("ridged");
    const HeightLevels levels = levelsOf(map, {.fit = LevelFit::Averaged});
    for (int j = -3; j < 70; j += 7)
        for (int i = -5; i < 70; i += 3)
            EXPECT_NEAR(levels.height(glm::dvec2(i, j) / 64.0, 0.5), map.texel(i, j) / 65535.0, 1e-6);
}

TEST(HeightLevels, FootprintsBetweenTwoLevelsGetHeightsBetween) {
    const HeightLevels levels = levelsOf(mapOf("fbm"));
    const glm::dvec2 at(0.37, 0.81);
    const double fine = levels.height(2, at), coarse = levels.height(3, at);
    EXPECT_NEAR(levels.height(at, 4.0), fine, 1e-9);
    EXPECT_NEAR(levels.height(at, 8.0), coarse, 1e-9);
    EXPECT_NEAR(levels.height(at, 4 * std::sqrt(2.0)), 0.5 * (fine + coarse), 1e-9);
    EXPECT_NEAR(levels.height(at, 1e30), levels.height(int(levels.levels().size()) - 1, at), 1e-9);
}

/// The optimum is certified: volume and bound meet, and no other fit comes below the bound.
TEST(HeightLevels, LeastVolumesAreProvedLeast) {
    for (const auto name : {"fbm", "ridged", "hemispheres", "blocks"}) {
        SCOPED_TRACE(name);
        const HeightMap map = mapOf(name);
        const HeightLevels least = levelsOf(map, {.fit = LevelFit::Least, .gap = 0.005, .mostIterations = 20000});
        const HeightLevels averaged = levelsOf(map, {.fit = LevelFit::Averaged});
        for (size_t level = 1; level <= 3; ++level) {
            SCOPED_TRACE(level);
            const LevelVolume& volume = least.volumes()[level];
            EXPECT_GE(volume.fitted, volume.bound - 1e-9);
            EXPECT_LE(volume.fitted - volume.bound, 0.005 * volume.fitted + 1e-9);
            EXPECT_LT(volume.fitted, volume.averaged);
            // Heights are kept in steps of 1 / 65535; means of means are rounded at each level.
            EXPECT_NEAR(volume.fitted, levelVolume(least.levels()[0], least.levels()[level]), 0.5 / 65535);
            EXPECT_NEAR(volume.averaged, levelVolume(averaged.levels()[0], averaged.levels()[level]), 1.0 / 65535);
        }
    }
}

/// Every change of one height within its range makes the volume larger, or leaves it within the gap.
TEST(HeightLevels, NoSingleHeightImprovesALeastVolume) {
    const HeightLevels levels = levelsOf(mapOf("ridged", 32), {.gap = 1e-4, .mostIterations = 50000});
    const HeightLevel& map = levels.levels()[0];
    const double volume = levels.volumes()[2].fitted;
    for (size_t i = 0; i < levels.levels()[2].texels.size(); ++i)
        for (const int by : {-1311, 1311}) {
            const HeightLevel& level = levels.levels()[2];
            const int height = level.texels[i] + by;
            const int x = int(i) % level.size.x * 4, y = int(i) / level.size.x * 4;
            double least = 1, most = 0;
            for (int j = y - 3; j <= y + 3; ++j)
                for (int k = x - 3; k <= x + 3; ++k)
                    least = std::min(least, map.at(k, j)), most = std::max(most, map.at(k, j));
            if (height / 65535.0 < least || height / 65535.0 > most) continue;
            std::vector<uint16_t> moved(level.texels.begin(), level.texels.end());
            moved[i] = uint16_t(height);
            EXPECT_GE(levelVolume(map, {level.size, std::move(moved)}), volume * (1 - 1e-3)) << i;
        }
}

TEST(HeightLevels, LeastVolumesDoNotOvershoot) {
    for (const auto name : {"hemispheres", "blocks", "needle"}) {
        const HeightMap map = mapOf(name);
        const auto [low, high] = std::ranges::minmax(map.texels);
        const HeightLevels levels = levelsOf(map);
        for (const HeightLevel& level : levels.levels())
            for (const uint16_t texel : level.texels) {
                ASSERT_GE(texel, low) << name;
                ASSERT_LE(texel, high) << name;
            }
    }
}

/// Means of means are the means of the map, where edges halve: a tent is the sum of three tents of half its width.
TEST(HeightLevels, AveragesAreTheMapsUnderATent) {
    const HeightMap map = mapOf("ridged");
    const HeightLevels levels = levelsOf(map, {.fit = LevelFit::Averaged});
    for (size_t level = 1; level < levels.levels().size(); ++level) {
        const HeightLevel& of = levels.levels()[level];
        const int width = 1 << level;
        for (int j = 0; j < of.size.y; ++j)
            for (int i = 0; i < of.size.x; ++i) {
                double sum = 0;
                for (int y = -width; y <= width; ++y)
                    for (int x = -width; x <= width; ++x)
                        sum += map.texel(i * width + x, j * width + y) * (width - std::abs(x)) * (width - std::abs(y));
                // Half a step of rounding a level.
                ASSERT_NEAR(of.at(i, j) * 65535, sum / std::pow(width, 4), 0.51 * double(level)) << level;
            }
    }
    const HeightLevel odd = *averagedLevel({{5, 1}, {10, 20, 30, 40, 50}}, {2, 1});
    // Corners lie at texels 0 and 2.5, and a texel counts by 1 less its distance over 2.5.
    EXPECT_EQ(odd.texels[0], 25);  // (10 + 0.6 * 20 + 0.2 * 30 + 0.2 * 40 + 0.6 * 50) / 2.6
    EXPECT_EQ(odd.texels[1], 35);  // (0.4 * 20 + 0.8 * 30 + 0.8 * 40 + 0.4 * 50) / 2.4
}

/// Where heights are kept changes none of them.
TEST(HeightLevels, LevelsInFilesAreThoseInMemory) {
    const HeightStore inFiles{.mostInMemory = 100};
    const HeightMap map = mapOf("fbm", 96);
    auto rows = HeightRows::create(map.size, inFiles);
    ASSERT_TRUE(rows) << rows.error().line();
    for (int row = map.size.y; row-- > 0;)
        ASSERT_TRUE(rows->write(row, std::span(map.texels.data() + size_t(row) * 96, 96)));
    const HeightMap kept{map.size, map.range, std::move(*rows).take()};
    EXPECT_TRUE(kept.texels.areInFile());
    EXPECT_EQ(kept.texels, map.texels);
    const HeightLevels levels = levelsOf(map, {.fit = LevelFit::Averaged}),
                       others = levelsOf(kept, {.fit = LevelFit::Averaged, .store = inFiles});
    ASSERT_EQ(levels.levels().size(), others.levels().size());
    for (size_t level = 0; level < levels.levels().size(); ++level) {
        EXPECT_EQ(others.levels()[level].texels, levels.levels()[level].texels) << level;
        EXPECT_EQ(others.levels()[level].texels.areInFile(), others.levels()[level].texels.size() > 100);
        others.letGo();
        EXPECT_EQ(others.levels()[level].texels, levels.levels()[level].texels) << level;
    }
    const auto refused = HeightLevels::build(map, {.fit = LevelFit::Averaged, .store = {"/no/such/folder", 100}});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::Io);
}

TEST(HeightLevels, ThePrintedFitFallsFromTheMeans) {
    const HeightLevels levels = levelsOf(mapOf("ridged"), {.fit = LevelFit::Printed, .mostIterations = 4000});
    const HeightLevels least = levelsOf(mapOf("ridged"), {.fit = LevelFit::Least, .mostIterations = 4000});
    for (size_t level = 1; level <= 3; ++level) {
        EXPECT_LT(levels.volumes()[level].fitted, 0.95 * levels.volumes()[level].averaged) << level;
        // Without ranges it may come below the least volume within them, but not by much here.
        EXPECT_GT(levels.volumes()[level].fitted, 0.9 * least.volumes()[level].bound) << level;
    }
}

TEST(HeightLevels, RefuseMapsThatAreNone) {
    EXPECT_EQ(HeightLevels::build({{2, 2}, 1, {1, 2, 3}}).error().code, ErrorCode::InvalidInput);
    EXPECT_EQ(HeightLevels::build({{0, 0}, 1, {}}).error().code, ErrorCode::InvalidInput);
    EXPECT_EQ(HeightLevels::build({{1, 1}, std::nan(""), {1}}).error().message,
              "the range of the heights must be above 0");
}

}  // namespace
}  // namespace vcp::meso
