// Which tiles of a height map are on the device: what views read, within the room there is.
#include "render/height_residency.h"

#include <gtest/gtest.h>

namespace vcp {
namespace {

using namespace meso;

constexpr uint32_t kNone = HeightResidency::kNone;

/// 1024 texels an edge: 64 tiles of the map, then 16, 4, and one of each of eight levels, which are always there.
HeightTiles tiles() {
    HeightMap map{{1024, 1024}, 1, std::vector<uint16_t>(size_t{1} << 20, 7)};
    return HeightTiles(std::make_shared<const HeightLevels>(*HeightLevels::build(map, {.fit = LevelFit::Averaged})));
}

std::vector<uint64_t> wished(const HeightResidency& residency) {
    std::vector<uint64_t> numbers;
    for (const Wish& wish : residency.wishes()) numbers.push_back(wish.request.number);
    return numbers;
}

TEST(HeightResidency, CoarseLevelsAreAlwaysThere) {
    const HeightTiles all = tiles();
    ASSERT_EQ(all.count(), 92u);
    EXPECT_EQ(HeightResidency::firstKept(all), 64u);
    EXPECT_EQ(HeightResidency::leastSlots(all), 28u + 16u);
    const HeightResidency residency(all, 50);
    EXPECT_EQ(residency.there(), 28u);
    for (uint32_t tile = 0; tile < 92; ++tile) EXPECT_EQ(residency.slots()[tile] != kNone, tile >= 64) << tile;
    EXPECT_TRUE(residency.wishes().empty());
}

TEST(HeightResidency, WhatViewsReadIsWishedForAndTaken) {
    HeightResidency residency(tiles(), 28 + 20);
    residency.look(0, {3, 5, 70});
    residency.look(1, {5, 9});
    EXPECT_EQ(wished(residency), (std::vector<uint64_t>{9, 5, 3}));
    EXPECT_EQ(residency.missing(0).toCome, 2u);
    EXPECT_FALSE(residency.take(4)) << "nobody wants it";
    const auto slot = residency.take(5);
    ASSERT_TRUE(slot);
    EXPECT_EQ(residency.slots()[5], *slot);
    EXPECT_EQ(wished(residency), (std::vector<uint64_t>{9, 3}));
    EXPECT_EQ(residency.missing(1).toCome, 1u);
    residency.forgetView(1);
    EXPECT_EQ(wished(residency), (std::vector<uint64_t>{3}));
}

TEST(HeightResidency, WhatWasReadLongestAgoMakesRoom) {
    HeightResidency residency(tiles(), 28 + 2);
    for (const uint32_t tile : {1u, 2u}) {
        residency.look(0, {tile});
        ASSERT_TRUE(residency.take(tile));
    }
    residency.look(0, {3});
    ASSERT_TRUE(residency.take(3));
    EXPECT_EQ(residency.slots()[1], kNone);
    EXPECT_NE(residency.slots()[2], kNone);
    EXPECT_EQ(residency.there(), 30u);
}

TEST(HeightResidency, WhereThereIsNoRoomForAllTheSameStays) {
    HeightResidency residency(tiles(), 28 + 2);
    for (int turn = 0; turn < 3; ++turn) {
        residency.look(0, {1, 2, 3, 4});
        for (const uint64_t tile : wished(residency)) EXPECT_TRUE(residency.take(uint32_t(tile)));
        EXPECT_NE(residency.slots()[4], kNone);
        EXPECT_NE(residency.slots()[3], kNone);
        EXPECT_TRUE(residency.wishes().empty()) << "nothing comes and goes for a still view";
        EXPECT_EQ(residency.missing(0).toCome, 0u);
        EXPECT_EQ(residency.missing(0).withoutRoom, 2u);
    }
}

}  // namespace
}  // namespace vcp
