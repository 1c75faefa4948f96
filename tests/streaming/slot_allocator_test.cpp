// Slots of the page pool against an obvious model.
#include "streaming/slot_allocator.h"

#include <map>
#include <random>

#include <gtest/gtest.h>

namespace vcp {
namespace {

TEST(SlotAllocator, NeverOverlapsNeverExceedsNeverCrossesAChunk) {
    for (uint64_t seed = 0; seed < 50; ++seed) {
        std::mt19937_64 random(seed);
        const uint64_t units = 50 + random() % 200, chunk = 32;
        SlotAllocator slots(units, chunk);
        std::map<uint64_t, uint64_t> taken;  // first to units
        uint64_t sum = 0;
        for (int step = 0; step < 2000; ++step) {
            if (random() % 3 != 0) {
                const uint64_t size = 1 + random() % 12;
                const auto slot = slots.allocate(size);
                if (!slot) continue;
                ASSERT_EQ(slot->units, size);
                const uint64_t* first = &slot->firstUnit;
                ASSERT_LE(*first + size, units) << seed;
                ASSERT_EQ(*first / chunk, (*first + size - 1) / chunk) << seed;
                const auto after = taken.lower_bound(*first);
                ASSERT_TRUE(after == taken.end() || *first + size <= after->first) << seed;
                ASSERT_TRUE(after == taken.begin() || std::prev(after)->first + std::prev(after)->second <= *first)
                    << seed;
                taken[*first] = size;
                sum += size;
            } else if (!taken.empty()) {
                auto at = std::next(taken.begin(), std::ptrdiff_t(random() % taken.size()));
                slots.release({at->first, at->second});
                sum -= at->second;
                taken.erase(at);
            }
            ASSERT_EQ(slots.unitsTaken(), sum);
        }
    }
}

TEST(SlotAllocator, FullIsFullAndReleasedIsReused) {
    SlotAllocator slots(8, 8);
    EXPECT_EQ(slots.allocate(5), (PoolSlot{0, 5}));
    EXPECT_EQ(slots.allocate(4), std::nullopt);
    EXPECT_EQ(slots.allocate(3), (PoolSlot{5, 3}));
    EXPECT_EQ(slots.allocate(1), std::nullopt);
    slots.release({0, 5});
    EXPECT_EQ(slots.allocate(2), (PoolSlot{0, 2}));
    EXPECT_EQ(slots.allocate(3), (PoolSlot{2, 3}));
    EXPECT_EQ(slots.unitsTaken(), 8u);
    EXPECT_EQ(SlotAllocator(100, 8).allocate(9), std::nullopt) << "more than a chunk";
}

}  // namespace
}  // namespace vcp
