// How memory is divided.
#include "builder/memory_plan.h"

#include <gtest/gtest.h>

namespace vcp {
namespace {

constexpr uint64_t kMebibyte = uint64_t{1} << 20;

TEST(MemoryPlan, SharesFitTheCap) {
    for (const unsigned threads : {1u, 2u, 16u, 64u})
        for (const uint64_t megabytes : {uint64_t{1024}, uint64_t{4096}, uint64_t{100000}}) {
            const auto plan = planMemory(megabytes * kMebibyte, threads);
            ASSERT_TRUE(plan.ok()) << plan.error().line();
            const uint64_t cap = megabytes * kMebibyte;
            // While reading; while stepping or building pages: with the blocks of the next level and of what waits.
            EXPECT_LE(plan->vertexBytes + plan->tempBytes + plan->bufferBytes, cap);
            EXPECT_LE(plan->pageBytes + plan->tempBytes + plan->bufferBytes + plan->bufferBytes / 4, cap);
            EXPECT_LE(plan->binTriangles(false) * 260 + plan->tempBytes + plan->bufferBytes + plan->bufferBytes / 4,
                      cap);
            for (const uint64_t share : {plan->vertexBytes, plan->tempBytes, plan->bufferBytes, plan->pageBytes})
                EXPECT_GT(share, cap / 40);
        }
}

TEST(MemoryPlan, MoreMemoryNeverMakesLess) {
    MemoryPlan last;
    for (uint64_t megabytes = 200; megabytes < 20000; megabytes += 37) {
        const auto plan = planMemory(megabytes * kMebibyte, 2);
        ASSERT_TRUE(plan.ok());
        EXPECT_GE(plan->vertexBytes, last.vertexBytes);
        EXPECT_GE(plan->binTriangles(false), last.binTriangles(false));
        EXPECT_GE(plan->pageBytes, last.pageBytes);
        last = *plan;
    }
}

TEST(MemoryPlan, TooLittleSaysWhatIsEnough) {
    for (const unsigned threads : {1u, 2u, 64u}) {
        const auto none = planMemory(10 * kMebibyte, threads);
        ASSERT_FALSE(none.ok());
        EXPECT_EQ(none.error().code, ErrorCode::Limit);
        const std::string line = none.error().line();
        const size_t at = line.find("memory cap be ");
        ASSERT_NE(at, std::string::npos) << line;
        const uint64_t enough = std::stoull(line.substr(at + 14));
        EXPECT_TRUE(planMemory(enough * kMebibyte, threads).ok()) << line;
        EXPECT_FALSE(planMemory((enough - 2) * kMebibyte, threads).ok()) << line;
    }
}

TEST(MemoryPlan, TenBillionTrianglesFitOneGibibyte) {
    // A scan has some 8,000 triangles a page, and each triangle lies in one or two bins.
    for (const auto& [megabytes, triangles] : {std::pair(150, 1e9), std::pair(1024, 1e10)}) {
        const auto plan = planMemory(uint64_t(megabytes) * kMebibyte, 2);
        ASSERT_TRUE(plan.ok());
        const auto bins = uint64_t(1.5 * triangles / double(plan->binTriangles(false)));
        const auto planned = planPages(*plan, uint64_t(triangles / 8000), bins);
        ASSERT_TRUE(planned.ok()) << planned.error().line();
        EXPECT_GE(planned->pageBytes, plan->binTriangles(false) * 260);
        EXPECT_LT(planned->pageBytes, plan->pageBytes);
        EXPECT_GE(plan->mostCountedPages(), uint64_t(triangles / 8000));
    }
}

TEST(MemoryPlan, TooManyPagesOrBinsSayWhatIsEnough) {
    const auto plan = planMemory(256 * kMebibyte, 2);
    ASSERT_TRUE(plan.ok());
    const auto enough = [](const Error& error) {
        EXPECT_EQ(error.code, ErrorCode::Limit);
        const size_t at = error.line().find("memory cap be ");
        EXPECT_NE(at, std::string::npos) << error.line();
        return std::stoull(error.line().substr(at + 14));
    };
    const auto pages = planPages(*plan, 10000000, 1);
    ASSERT_FALSE(pages.ok());
    EXPECT_TRUE(planPages(*planMemory(enough(pages.error()) * kMebibyte, 2), 10000000, 1).ok());
    const auto bins = planPages(*plan, 1, 1000000);
    ASSERT_FALSE(bins.ok());
    const auto more = planMemory(enough(bins.error()) * kMebibyte, 2);
    ASSERT_TRUE(more.ok());
    // Bins are as many as are needed for the triangles.
    EXPECT_TRUE(
        planPages(*more, 1, uint64_t(1e6 * double(plan->binTriangles(false)) / double(more->binTriangles(false))))
            .ok());
}

TEST(MemoryPlan, DefaultIsPartOfTheMachine) { EXPECT_GT(defaultMemoryBytes(), 64 * kMebibyte); }

}  // namespace
}  // namespace vcp
