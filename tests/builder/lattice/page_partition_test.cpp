// Pages of a level, and the runs of them that fit memory.
#include "builder/lattice/page_partition.h"

#include <random>
#include <set>

#include <gtest/gtest.h>

namespace vcp {
namespace {

constexpr int32_t kCell = kLatticePerCell;

TEST(PageGrid, PointsLieInPages) {
    const PageGrid grid{5, 2};  // 4 pages of 32 cells an axis
    EXPECT_EQ(grid.pageOf({0, 0, 0}), 0u);
    EXPECT_EQ(grid.pageOf({32 * kCell - 1, 0, 0}), 0u);
    EXPECT_EQ(grid.pageOf({32 * kCell, 0, 0}), 1u);
    EXPECT_EQ(grid.pageOf({0, 32 * kCell, 64 * kCell}), mortonEncode({0, 1, 2}));
    // The far wall belongs to the last page.
    EXPECT_EQ(grid.pageOf({128 * kCell, 128 * kCell, 128 * kCell}), mortonEncode({3, 3, 3}));
    EXPECT_EQ((PageGrid{5, 0}.pageOf({40 * kCell, 5, 5})), 0u);
}

TEST(PageGrid, NearPagesAreThoseThatTheTriangleOverlaps) {
    const PageGrid grid{3, 3};
    std::mt19937_64 random(2);
    for (int i = 0; i < 300; ++i) {
        glm::i32vec3 corner[3];
        const glm::i32vec3 base(random() % (64 * kCell), random() % (64 * kCell), random() % (64 * kCell));
        const int reach = i % 3 == 0 ? 40 * kCell : 2 * kCell;
        for (auto& c : corner) {
            c = base + glm::i32vec3(random() % uint64_t(reach), random() % uint64_t(reach), random() % uint64_t(reach));
            c = glm::min(c, 64 * kCell);
        }
        const double margin = i % 2 ? 4 : 0.25;
        std::set<uint64_t> near;
        grid.forPagesNear(corner, margin, [&](uint64_t page) { EXPECT_TRUE(near.insert(page).second) << "twice"; });
        // Where its corners are it overlaps.
        for (const auto& c : corner) EXPECT_TRUE(near.contains(grid.pageOf(c)));
        const BoxOverlap overlap({glm::dvec3(corner[0]) / double(kCell), glm::dvec3(corner[1]) / double(kCell),
                                  glm::dvec3(corner[2]) / double(kCell)});
        for (uint32_t page = 0; page < 512; ++page) {
            const glm::dvec3 centre = (glm::dvec3(mortonDecode(page)) + 0.5) * 8.0;
            ASSERT_EQ(near.contains(page), overlap.test(centre, 4 + margin)) << i << " page " << page;
        }
    }
}

TEST(PagePartition, OneBinHasAll) {
    const PagePartition one;
    EXPECT_EQ(one.bins(), 1u);
    EXPECT_EQ(one.binOf(0), 0u);
    EXPECT_EQ(one.binOf(~uint64_t{0}), 0u);
    EXPECT_EQ(one.coarser().bins(), 1u);
}

TEST(PagePartition, HoldsAtMostTheLimit) {
    for (uint64_t seed = 0; seed < 100; ++seed) {
        std::mt19937_64 random(seed);
        std::vector<std::pair<uint64_t, uint64_t>> pages;
        for (uint64_t code = random() % 5; pages.size() < 200; code += 1 + random() % 9)
            pages.emplace_back(code, random() % (seed % 4 == 0 ? 2000 : 300));
        constexpr uint64_t limit = 1000;
        const PagePartition partition(pages, limit);
        std::vector<uint64_t> held(partition.bins()), count(partition.bins());
        size_t last = 0;
        for (const auto& [code, triangles] : pages) {
            const size_t bin = partition.binOf(code);
            ASSERT_TRUE(bin == last || bin == last + 1) << "bins are runs";
            last = bin;
            held[bin] += triangles;
            ++count[bin];
        }
        for (size_t bin = 0; bin < held.size(); ++bin) {
            ASSERT_GT(count[bin], 0u);
            if (held[bin] > limit) {
                // Only because of a page that has more alone; what came before it has nothing.
                uint64_t most = 0;
                for (const auto& [code, triangles] : pages)
                    if (partition.binOf(code) == bin) most = std::max(most, triangles);
                ASSERT_EQ(most, held[bin]) << seed;
            }
        }
        // As few as can be, taken one after the other: a bin and the first page of the next are too many.
        for (size_t bin = 0; bin + 1 < held.size(); ++bin) {
            const auto next = std::find_if(pages.begin(), pages.end(),
                                           [&](const auto& p) { return partition.binOf(p.first) == bin + 1; });
            ASSERT_GT(held[bin] + next->second, limit) << seed;
        }
    }
}

TEST(PagePartition, CoarserBinsKeepFamiliesTogether) {
    for (uint64_t seed = 0; seed < 100; ++seed) {
        std::mt19937_64 random(seed);
        std::vector<uint64_t> first{0};
        while (first.size() < 40) first.push_back(first.back() + 1 + random() % 20);
        PagePartition fine(first);
        EXPECT_EQ(fine.first(), first);
        for (int level = 0; level < 4; ++level) {
            const PagePartition coarse = fine.coarser();
            ASSERT_LE(coarse.bins(), fine.bins());
            size_t last = 0;
            for (uint64_t page = 0; page < uint64_t{1000} >> 3 * level; ++page) {
                // Ascending, and no bin without a page.
                ASSERT_TRUE(coarse.binOf(page) == last || coarse.binOf(page) == last + 1);
                last = coarse.binOf(page);
                // A parent's bin begins where one of the finer bins does, rounded down.
                ASSERT_LE(coarse.first()[last], page);
            }
            for (const uint64_t code : coarse.first())
                ASSERT_TRUE(code == 0 || std::any_of(fine.first().begin(), fine.first().end(),
                                                     [&](uint64_t f) { return f >> 3 == code; }));
            fine = coarse;
        }
        EXPECT_EQ(PagePartition(std::vector<uint64_t>{0, 1, 2, 7}).coarser().bins(), 1u);
    }
}

}  // namespace
}  // namespace vcp
