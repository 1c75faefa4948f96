// How memory is divided.
#include "builder/memory_plan.h"

#include <gtest/gtest.h>

namespace vcp {
namespace {

constexpr uint64_t kMiB = uint64_t{1} << 20;

TEST(MemoryPlan, SharesFitTheCap) {
    for (const unsigned threads : {1u, 2u, 16u, 64u})
        for (const uint64_t megabytes : {uint64_t{1024}, uint64_t{4096}, uint64_t{100000}}) {
            const auto plan = planMemory(megabytes * kMiB, threads);
            ASSERT_TRUE(plan.ok()) << plan.error().line();
            const uint64_t cap = megabytes * kMiB;
            // While reading; while stepping or building pages: with the blocks of the next level and of what waits.
            EXPECT_LE(plan->vertexBytes + plan->tempBytes + plan->bufferBytes, cap);
            EXPECT_LE(plan->pageBytes + plan->tempBytes + plan->bufferBytes + plan->bufferBytes / 4, cap);
            EXPECT_LE(plan->binTriangles * 260 + plan->tempBytes + plan->bufferBytes + plan->bufferBytes / 4, cap);
            for (const uint64_t share : {plan->vertexBytes, plan->tempBytes, plan->bufferBytes, plan->pageBytes})
                EXPECT_GT(share, cap / 40);
        }
}

TEST(MemoryPlan, MoreMemoryNeverMakesLess) {
    MemoryPlan last;
    for (uint64_t megabytes = 200; megabytes < 20000; megabytes += 37) {
        const auto plan = planMemory(megabytes * kMiB, 2);
        ASSERT_TRUE(plan.ok());
        EXPECT_GE(plan->vertexBytes, last.vertexBytes);
        EXPECT_GE(plan->binTriangles, last.binTriangles);
        EXPECT_GE(plan->pageBytes, last.pageBytes);
        last = *plan;
    }
}

TEST(MemoryPlan, TooLittleSaysWhatIsEnough) {
    for (const unsigned threads : {1u, 2u, 64u}) {
        const auto none = planMemory(10 * kMiB, threads);
        ASSERT_FALSE(none.ok());
        EXPECT_EQ(none.error().code, ErrorCode::Limit);
        const std::string line = none.error().line();
        const size_t at = line.find("memory cap be ");
        ASSERT_NE(at, std::string::npos) << line;
        const uint64_t enough = std::stoull(line.substr(at + 14));
        EXPECT_TRUE(planMemory(enough * kMiB, threads).ok()) << line;
        EXPECT_FALSE(planMemory((enough - 2) * kMiB, threads).ok()) << line;
    }
}

TEST(MemoryPlan, DefaultIsPartOfTheMachine) { EXPECT_GT(defaultMemoryBytes(), 64 * kMiB); }

}  // namespace
}  // namespace vcp
