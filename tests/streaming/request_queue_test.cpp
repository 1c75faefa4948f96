// The order of reads and the rule for those that fail, with time made by hand.
#include "streaming/request_queue.h"

#include <algorithm>
#include <map>
#include <random>

#include <gtest/gtest.h>

namespace vcp {
namespace {

uint64_t beginNext(RequestQueue& queue, double now = 0) {
    const auto wish = queue.next(now);
    EXPECT_TRUE(wish);
    if (!wish) return UINT64_MAX;
    queue.begin(wish->request);
    return wish->request.number;
}

TEST(RequestQueue, UrgentFirstOfEqualsInOrder) {
    RequestQueue queue;
    queue.replace({{1, 1}, {2, 5}, {3, 5}, {4, 9}});
    for (const uint64_t page : {4u, 2u, 3u, 1u}) EXPECT_EQ(beginNext(queue), page);
    EXPECT_FALSE(queue.next(0));
    EXPECT_EQ(queue.pending(), 4u);
}

TEST(RequestQueue, UnderWayAndDeliveredAreNotBegunAgain) {
    RequestQueue queue;
    queue.replace({{1, 1}, {2, 1}});
    EXPECT_EQ(beginNext(queue), 1u);
    queue.replace({{1, 1}, {2, 1}});
    EXPECT_EQ(beginNext(queue), 2u);
    queue.delivered(1);
    EXPECT_FALSE(queue.next(0)) << "until it is wished for anew";
    EXPECT_EQ(queue.pending(), 1u);
    queue.replace({{1, 1}});
    EXPECT_EQ(beginNext(queue), 1u);
    queue.returned(1);
    EXPECT_EQ(beginNext(queue), 1u) << "a cancelled read";
}

TEST(RequestQueue, StaleWishesAreGone) {
    RequestQueue queue;
    queue.replace({{1, 1}, {2, 2}});
    queue.replace({{3, 1}});
    EXPECT_EQ(beginNext(queue), 3u);
    EXPECT_FALSE(queue.next(0));
    EXPECT_FALSE(queue.mayBegin(1, 0, 0));
}

TEST(RequestQueue, BackOffGrowsToALimitThenThePageIsGivenUpForGood) {
    const RetryPolicy policy{
        .attempts = 6, .damagedAttempts = 6, .firstDelaySeconds = 1, .growth = 2, .longestDelaySeconds = 5};
    RequestQueue queue(policy);
    queue.replace({{7, 1}});
    double now = 100;
    for (const double delay : {1.0, 2.0, 4.0, 5.0, 5.0}) {
        EXPECT_EQ(beginNext(queue, now), 7u);
        EXPECT_FALSE(queue.failed(7, ErrorCode::Io, now));
        EXPECT_FALSE(queue.next(now + 0.99 * delay));
        EXPECT_DOUBLE_EQ(queue.nextTry(now), now + delay);
        EXPECT_EQ(queue.pending(), 1u) << "it is still wanted: the view has not settled";
        now += delay;
    }
    EXPECT_EQ(beginNext(queue, now), 7u);
    EXPECT_TRUE(queue.failed(7, ErrorCode::Io, now));
    queue.delivered(7);
    for (int i = 0; i < 5; ++i) {
        queue.replace({{7, 1}});
        EXPECT_FALSE(queue.next(now + 1e6));
        EXPECT_EQ(queue.pending(), 0u);
    }
}

TEST(RequestQueue, AFailedPageHoldsNobodyUpAndKeepsItsCountWhenItIsNotWanted) {
    RequestQueue queue({.attempts = 2, .damagedAttempts = 2, .firstDelaySeconds = 10, .longestDelaySeconds = 10});
    queue.replace({{1, 9}, {2, 1}});
    EXPECT_EQ(beginNext(queue), 1u);
    EXPECT_FALSE(queue.failed(1, ErrorCode::Io, 0));
    EXPECT_EQ(beginNext(queue), 2u);
    queue.replace({});
    EXPECT_EQ(queue.nextTry(0), std::numeric_limits<double>::infinity());
    queue.replace({{1, 9}});
    EXPECT_FALSE(queue.next(5)) << "a new list does not shorten the wait";
    EXPECT_EQ(beginNext(queue, 10), 1u);
    EXPECT_TRUE(queue.failed(1, ErrorCode::Io, 10));
}

TEST(RequestQueue, WhatMayNotBeReadNowHoldsNobodyUp) {
    RequestQueue queue({.attempts = 3, .damagedAttempts = 3, .firstDelaySeconds = 10, .longestDelaySeconds = 10});
    queue.replace({{1, 9}, {2, 1}});
    const auto notTheFirst = [](Request request) { return request != Request(1); };
    EXPECT_FALSE(queue.failed(1, ErrorCode::Io, 0));
    EXPECT_FALSE(queue.failed(2, ErrorCode::Io, 5));
    EXPECT_FALSE(queue.next(12, notTheFirst)) << "the second waits still";
    EXPECT_EQ(queue.nextTry(12), 15) << "the first is due, and waits for something else";
    ASSERT_TRUE(queue.next(15, notTheFirst));
    EXPECT_EQ(queue.next(15, notTheFirst)->request, Request(2));
    EXPECT_EQ(queue.next(15)->request, Request(1));
}

TEST(RequestQueue, WrongBytesAreGivenUpSooner) {
    RequestQueue queue({.attempts = 8, .damagedAttempts = 3});
    queue.replace({{1, 1}});
    int attempts = 0;
    for (bool givenUp = false; !givenUp; ++attempts) {
        ASSERT_LT(attempts, 20);
        EXPECT_EQ(beginNext(queue, 1e3 * attempts), 1u);
        givenUp = queue.failed(1, ErrorCode::InvalidInput, 1e3 * attempts);
    }
    EXPECT_EQ(attempts, 3);
}

/// Whatever happens, no page is begun twice at once, nor more often than the policy allows, and all ends.
TEST(RequestQueue, AnyHistoryEnds) {
    for (uint64_t seed = 0; seed < 200; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937_64 random(seed);
        const RetryPolicy policy{.attempts = 4, .damagedAttempts = 2};
        RequestQueue queue(policy);
        std::vector<Wish> wishes;
        for (uint64_t page = 0; page < 20; ++page) wishes.push_back({page, double(random() % 4)});
        std::map<uint64_t, int> attempts;
        std::vector<uint64_t> underWay;
        std::vector<uint8_t> over(20, 0);
        double now = 0;
        for (int step = 0; queue.pending() > 0 || step == 0; ++step) {
            ASSERT_LT(step, 10000);
            if (step % 7 == 0) {
                std::erase_if(wishes, [&](const Wish& wish) { return over[wish.request.number] != 0; });
                queue.replace(wishes);
            }
            if (const auto wish = queue.next(now); wish && underWay.size() < 3) {
                EXPECT_EQ(std::find(underWay.begin(), underWay.end(), wish->request.number), underWay.end());
                queue.begin(wish->request.number);
                underWay.push_back(wish->request.number);
                EXPECT_LE(++attempts[wish->request.number], 4);
            }
            if (!underWay.empty() && random() % 2 == 0) {
                const auto at = underWay.begin() + std::ptrdiff_t(random() % underWay.size());
                const uint64_t page = *at;
                underWay.erase(at);
                const bool fails = random() % 3 == 0;
                const bool ends =
                    !fails || queue.failed(page, random() % 2 == 0 ? ErrorCode::Io : ErrorCode::InvalidInput, now);
                if (ends) {
                    queue.delivered(page);
                    over[page] = 1;
                }
            }
            now += 0.05;
        }
        EXPECT_EQ(std::count(over.begin(), over.end(), 1), 20);
    }
}

}  // namespace
}  // namespace vcp
