// Sizes of moving pictures, with frames that take what a model says.
#include "viewer/moving_size.h"

#include <algorithm>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

namespace vcp {
namespace {

/// Draws frames of a motion; `ms` tells what one takes, by its number and reduction. Returns their reductions.
std::vector<int> motion(MovingSize& size, int frames, const std::function<double(int, int)>& ms) {
    std::vector<int> sizes;
    for (int i = 0; i < frames; ++i) {
        const int reduction = size.next(true);
        sizes.push_back(reduction);
        size.take(reduction, ms(i, reduction) * reduction * reduction);
    }
    return sizes;
}

/// A frame that takes so many milliseconds at full size, and some whatever its size.
std::function<double(int, int)> frameOf(double fullMs, double fixedMs = 0) {
    return [=](int, int reduction) { return fixedMs + fullMs / (reduction * reduction); };
}

int changes(const std::vector<int>& sizes) {
    int count = 0;
    for (size_t i = 1; i < sizes.size(); ++i) count += sizes[i] != sizes[i - 1] ? 1 : 0;
    return count;
}

TEST(MovingSize, IsTheLargestThatTheTimeAllowsFromTheFirstFrameOn) {
    for (const auto& [fullMs, reduction] : {std::pair(40.0, 1), {60.0, 2}, {199.0, 2}, {201.0, 3}, {1e6, 8}}) {
        MovingSize size(50);
        size.take(1, fullMs);
        const std::vector<int> sizes = motion(size, 100, frameOf(fullMs));
        EXPECT_EQ(sizes.front(), reduction) << fullMs;
        EXPECT_GE(std::count(sizes.begin(), sizes.end(), reduction), 90) << fullMs;
    }
    MovingSize never(0);
    never.take(1, 1e6);
    EXPECT_EQ(never.next(true), 1);
}

TEST(MovingSize, AFrameThatTakesLongChangesNothing) {
    MovingSize size(50);
    size.take(1, 40);
    const auto slowAtTimes = [](int i, int reduction) {
        return (i % 10 == 5 ? 900.0 : 40.0) / (reduction * reduction);
    };
    EXPECT_EQ(motion(size, 100, slowAtTimes), std::vector<int>(100, 1));
}

TEST(MovingSize, WhatWasSlowForAWhileIsLargeAgain) {
    MovingSize size(50);
    size.take(1, 40);
    // Other programs take the processors, and what a frame takes whatever its size makes small ones look worse.
    const std::vector<int> busy = motion(size, 30, frameOf(400, 8));
    EXPECT_GE(busy.back(), 3);
    const std::vector<int> idle = motion(size, 200, frameOf(30, 2));
    EXPECT_EQ(idle.back(), 1);
    EXPECT_LE(std::count(idle.begin(), idle.end(), 1), 200 - 10 * (busy.back() - 1));
    EXPECT_LE(changes(idle), busy.back()) << "step by step";
}

TEST(MovingSize, DoesNotFlicker) {
    // Too slow at full size, which seems to do at half of it.
    const auto deceiving = [](int, int reduction) { return reduction == 1 ? 80.0 : 8.0; };
    MovingSize size(50);
    size.take(1, 80);
    EXPECT_LE(changes(motion(size, 2000, deceiving)), 12);
}

TEST(MovingSize, AViewThatHoldsStillKeepsItsSizeAndANewMotionBeginsAnew) {
    MovingSize size(50);
    size.take(1, 40);
    EXPECT_EQ(size.next(true), 1);
    for (int i = 0; i < 3; ++i) size.take(1, 300);
    EXPECT_EQ(size.next(false), 1);
    EXPECT_EQ(size.next(true), 3);
    size.rest();
    for (int i = 0; i < 3; ++i) size.take(1, 40);
    EXPECT_EQ(size.next(true), 1);
}

TEST(MovingOcclusion, StaysWhereFramesWithItAreQuick) {
    MovingOcclusion occlusion(50);
    EXPECT_FALSE(occlusion.keeps()) << "nothing is known yet";
    occlusion.take(20);
    EXPECT_TRUE(occlusion.keeps());
    occlusion.take(900);
    occlusion.take(900);
    EXPECT_TRUE(occlusion.keeps()) << "slow frames that pass";
    occlusion.take(31);
    EXPECT_FALSE(occlusion.keeps());
    occlusion.take(29);
    EXPECT_TRUE(occlusion.keeps());
    MovingOcclusion never(0);
    never.take(1);
    EXPECT_FALSE(never.keeps());
}

}  // namespace
}  // namespace vcp
