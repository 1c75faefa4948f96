#include "viewer/asset/share_out.h"

#include <atomic>
#include <vector>

#include <gtest/gtest.h>

namespace vcp {
namespace {

TEST(ShareOut, EachIsDoneOnce) {
    for (const size_t count : {size_t(0), size_t(1), size_t(17), size_t(5000)}) {
        std::vector<std::atomic<int>> times(count);
        EXPECT_TRUE(shareOut(count,
                             [&](size_t first, size_t last) {
                                 for (size_t i = first; i < last; ++i) ++times[i];
                             },
                             {}));
        for (size_t i = 0; i < count; ++i) ASSERT_EQ(times[i], 1) << i;
    }
}

TEST(ShareOut, StopsWhenTold) {
    std::atomic<size_t> done = 0;
    EXPECT_FALSE(shareOut(
        size_t{1} << 40, [&](size_t first, size_t last) { done += last - first; },
        [&](double) { return done < 1000; }));
    EXPECT_GE(done, 1000u);
}

}  // namespace
}  // namespace vcp
