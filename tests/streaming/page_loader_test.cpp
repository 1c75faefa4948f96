// Loader threads with a fake source. Run under TSan as well.
#include "streaming/page_loader.h"

#include <sys/resource.h>
#include <unistd.h>
#include <algorithm>
#include <atomic>
#include <set>
#include <thread>

#include <gtest/gtest.h>

namespace vcp {
namespace {

using std::chrono::milliseconds;
constexpr milliseconds kLong(20000);

/// Pages whose first word is their number; can be held back, and fails where asked to.
class FakeSource final : public PageSource {
public:
    explicit FakeSource(size_t wordsPerPage = 1) : words_(wordsPerPage) {}

    Result<PageBytes> read(Request request, bool withColour) const override {
        const uint64_t page = request.number;
        {
            std::unique_lock lock(mutex_);
            begun_.push_back(page);
            threads_.insert(std::this_thread::get_id());
            changed_.notify_all();
            changed_.wait(lock, [&] {
                return !held_ && ((page != stalling && !(stallingOdd && page % 2 == 1)) || interrupted_);
            });
        }
        niceness = ::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()));
        if (page == failing) return Error{.code = ErrorCode::Io, .message = "broken", .element = "page 13"};
        if (page == throwing) throw std::bad_alloc();
        PageBytes bytes;
        bytes.geometry.assign(words_, uint4(uint32_t(page)));
        if (withColour) bytes.colour.assign(1, uint4(7));
        return bytes;
    }
    [[nodiscard]] uint64_t bytesToRead(Request, bool withColour) const override {
        return (words_ + (withColour ? 1 : 0)) * sizeof(uint4);
    }
    void hold(bool held) {
        const std::lock_guard lock(mutex_);
        held_ = held;
        changed_.notify_all();
    }
    void waitUntilBegun(size_t pages) const {
        std::unique_lock lock(mutex_);
        changed_.wait_for(lock, kLong, [&] { return begun_.size() >= pages; });
    }
    [[nodiscard]] std::vector<uint64_t> begun() const {
        const std::lock_guard lock(mutex_);
        return begun_;
    }
    /// How many threads have read.
    [[nodiscard]] size_t threads() const {
        const std::lock_guard lock(mutex_);
        return threads_.size();
    }

    void interrupt() const override {
        const std::lock_guard lock(mutex_);
        interrupted_ = true;
        changed_.notify_all();
    }
    void letGo() const { interrupt(); }
    [[nodiscard]] std::string name() const override { return "fake.vcp"; }
    /// Keeps all it may.
    uint64_t keepWithin(uint64_t bytes) const override { return kept = keeps ? bytes : 0; }
    bool keeps = false;
    mutable std::atomic<uint64_t> kept{0};

    mutable std::atomic<int> niceness{0};
    bool stallingOdd = false;
    uint64_t failing = UINT64_MAX, stalling = UINT64_MAX, throwing = UINT64_MAX;

private:
    size_t words_;
    mutable std::mutex mutex_;
    mutable std::condition_variable changed_;
    mutable std::vector<uint64_t> begun_;
    mutable std::set<std::thread::id> threads_;
    bool held_ = false;
    mutable bool interrupted_ = false;
};

LoaderOptions options(bool withColour, uint32_t threads, uint64_t heldBytes) {
    LoaderOptions made;
    made.withColour = withColour;
    made.threads = {threads};
    made.heldBytes = heldBytes;
    made.retry = {.attempts = 3, .damagedAttempts = 2, .firstDelaySeconds = 1e-3};
    return made;
}

std::vector<Loaded> collectAll(PageLoader& loader, size_t pages) {
    std::vector<Loaded> all;
    while (all.size() < pages && loader.waitForPage(kLong))
        for (Loaded& page : loader.collect()) all.push_back(std::move(page));
    return all;
}

TEST(PageLoader, DeliversEveryWishOnce) {
    const auto source = std::make_shared<FakeSource>();
    PageLoader loader(source, options(true, 3, 1 << 20));
    std::vector<Wish> wishes;
    for (uint64_t page = 0; page < 100; ++page) wishes.push_back({page, double(page % 7)});
    loader.request(wishes);
    std::set<uint64_t> seen;
    for (const Loaded& page : collectAll(loader, 100)) {
        ASSERT_TRUE(page.bytes) << page.bytes.error().line();
        EXPECT_EQ(page.bytes->geometry[0].x, page.request.number);
        EXPECT_EQ(page.bytes->colour.size(), 1u);
        EXPECT_TRUE(seen.insert(page.request.number).second);
    }
    EXPECT_EQ(seen.size(), 100u);
    EXPECT_EQ(loader.pending(), 0u);
    EXPECT_EQ(loader.stats().bytesRead, 100u * 32);
    EXPECT_FALSE(loader.waitForPage(kLong)) << "nothing is under way: it must not wait";
}

TEST(PageLoader, ItsThreadsGiveWayToThoseThatDraw) {
    const auto source = std::make_shared<FakeSource>();
    PageLoader loader(source, options(false, 1, 1 << 20));
    loader.request({{3, 1}});
    collectAll(loader, 1);
    const int own = ::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()));
    EXPECT_EQ(source->niceness, std::min(own + 8, 19));
    // Eight of them together no more than two.
    PageLoader many(source, options(false, 8, 1 << 20));
    many.request({{3, 1}});
    collectAll(many, 1);
    EXPECT_EQ(source->niceness, std::min(own + 14, 19));
}

/// Two parts: the even pages and the odd ones.
class TwoParts final : public PageSource {
public:
    explicit TwoParts(std::shared_ptr<const FakeSource> pages) : pages_(std::move(pages)) {}
    Result<PageBytes> read(Request request, bool withColour) const override {
        return pages_->read(request, withColour);
    }
    [[nodiscard]] uint64_t bytesToRead(Request request, bool withColour) const override {
        return pages_->bytesToRead(request, withColour);
    }
    [[nodiscard]] uint32_t partOf(Request request) const override { return request.number % 2; }
    void interrupt() const override { pages_->interrupt(); }

private:
    std::shared_ptr<const FakeSource> pages_;
};

TEST(PageLoader, APartThatAnswersNothingKeepsNoOtherWaiting) {
    const auto pages = std::make_shared<FakeSource>();
    pages->stallingOdd = true;
    LoaderOptions two = options(false, 0, 1 << 20);
    two.threads = {1, 3};
    PageLoader loader(std::make_shared<TwoParts>(pages), two);
    std::vector<Wish> wishes;
    for (uint64_t page = 0; page < 100; ++page) wishes.push_back({page, page % 2 ? 100.0 : 1.0});
    loader.request(wishes);
    for (const Loaded& page : collectAll(loader, 50)) EXPECT_EQ(page.request.number % 2, 0u);
    // Its threads may have been slow to start.
    const auto stalled = [&] {
        const std::vector<uint64_t> begun = pages->begun();
        return std::ranges::count_if(begun, [](uint64_t page) { return page % 2 == 1; });
    };
    while (stalled() < 3) std::this_thread::yield();
    EXPECT_EQ(stalled(), 3) << "threads of that part";
    EXPECT_EQ(pages->begun().size(), 53u);
    pages->letGo();
    EXPECT_EQ(collectAll(loader, 50).size(), 50u);
}

/// A hundred parts, whose pages lie between one another's.
class ManyParts final : public PageSource {
public:
    explicit ManyParts(std::shared_ptr<const FakeSource> pages) : pages_(std::move(pages)) {}
    Result<PageBytes> read(Request request, bool withColour) const override {
        return pages_->read(request, withColour);
    }
    [[nodiscard]] uint64_t bytesToRead(Request request, bool withColour) const override {
        return pages_->bytesToRead(request, withColour);
    }
    [[nodiscard]] uint32_t partOf(Request request) const override { return uint32_t(request.number % 100); }
    void interrupt() const override { pages_->interrupt(); }

private:
    std::shared_ptr<const FakeSource> pages_;
};

TEST(PageLoader, AHundredPartsShareSixteenThreads) {
    for (const bool hasWide : {false, true}) {
        LoaderOptions hundred = options(false, 0, 1 << 20);
        hundred.threads.assign(100, 1);
        if (hasWide) hundred.threads[7] = 8;
        const size_t threads = hasWide ? 24 : 16;
        const auto pages = std::make_shared<FakeSource>();
        pages->hold(true);
        PageLoader loader(std::make_shared<ManyParts>(pages), hundred);
        std::vector<Wish> wishes;
        for (uint64_t page = 0; page < 1000; ++page) wishes.push_back({page, 1});
        loader.request(wishes);
        pages->waitUntilBegun(threads);
        EXPECT_EQ(pages->begun().size(), threads) << "each thread waits for one page";
        pages->hold(false);
        EXPECT_EQ(collectAll(loader, wishes.size()).size(), wishes.size());
        EXPECT_EQ(pages->threads(), threads);
    }
}

TEST(PageLoader, ReadsNoFurtherThanTheNextUpdateTakesIn) {
    PageLoader loader(std::make_shared<FakeSource>(), options(false, 1, 1 << 20));
    std::vector<Wish> wishes;
    for (uint64_t page = 0; page < 2000; ++page) wishes.push_back({page, 1});
    loader.request(wishes, 5 * sizeof(uint4));
    for (uint64_t round = 1; round <= 100; ++round) {
        while (loader.stats().pagesRead < 5 * round) std::this_thread::yield();
        EXPECT_EQ(loader.collect().size(), 5u);
    }
}

TEST(PageLoader, UrgentFirstOfEqualsInOrder) {
    const auto source = std::make_shared<FakeSource>();
    source->hold(true);
    PageLoader loader(source, options(false, 1, 1 << 20));
    loader.request({{50, 1}});
    source->waitUntilBegun(1);
    loader.request({{1, 1}, {2, 5}, {3, 5}, {4, 9}});
    source->hold(false);
    collectAll(loader, 5);
    EXPECT_EQ(source->begun(), (std::vector<uint64_t>{50, 4, 2, 3, 1}));
}

TEST(PageLoader, AFrameTakesNoMoreThanItsShare) {
    const auto source = std::make_shared<FakeSource>();
    PageLoader loader(source, options(true, 2, 1 << 20));
    std::vector<Wish> wishes;
    for (uint64_t page = 0; page < 30; ++page) wishes.push_back({page, 1});
    loader.request(wishes);
    // 32 bytes a page: three have 96, and one comes even where the share is less.
    std::set<uint64_t> seen;
    for (uint64_t share = 100; seen.size() < 30; share = share == 100 ? 10 : 100) {
        ASSERT_TRUE(loader.waitForPage(kLong));
        const auto pages = loader.collect(share);
        EXPECT_GE(pages.size(), 1u);
        EXPECT_LE(pages.size(), share == 100 ? 3u : 1u);
        for (const Loaded& page : pages) EXPECT_TRUE(seen.insert(page.request.number).second);
    }
}

TEST(PageLoader, StaleWishesAreNotRead) {
    const auto source = std::make_shared<FakeSource>();
    source->hold(true);
    PageLoader loader(source, options(false, 1, 1 << 20));
    loader.request({{1, 9}, {2, 8}, {3, 7}});
    source->waitUntilBegun(1);
    loader.request({{4, 1}});
    source->hold(false);
    EXPECT_EQ(collectAll(loader, 2).size(), 2u);
    EXPECT_EQ(source->begun(), (std::vector<uint64_t>{1, 4}));
}

TEST(PageLoader, APageBeingReadOrHeldIsNotReadAgain) {
    const auto source = std::make_shared<FakeSource>();
    PageLoader loader(source, options(false, 2, 1 << 20));
    for (int i = 0; i < 50; ++i) loader.request({{1, 1}, {2, 1}, {1, 2}});
    ASSERT_TRUE(loader.waitForPage(kLong));
    for (int i = 0; i < 50; ++i) loader.request({{1, 1}, {2, 1}});
    EXPECT_EQ(collectAll(loader, 2).size(), 2u);
    EXPECT_EQ(source->begun().size(), 2u);
}

TEST(PageLoader, AnErrorIsDeliveredLikeAPage) {
    const auto source = std::make_shared<FakeSource>();
    source->failing = 13;
    PageLoader loader(source, options(false, 2, 1 << 20));
    loader.request({{13, 1}});
    const auto pages = collectAll(loader, 1);
    ASSERT_EQ(pages.size(), 1u);
    ASSERT_FALSE(pages[0].bytes);
    EXPECT_EQ(pages[0].bytes.error().line(), "page 13: broken");
    EXPECT_EQ(loader.stats().bytesRead, 0u);
}

TEST(PageLoader, WhatAReadThrowsIsAnErrorOfItsPage) {
    const auto source = std::make_shared<FakeSource>();
    source->throwing = 13;
    PageLoader loader(source, options(false, 2, 1 << 20));
    loader.request({{12, 1.0}, {13, 1.0}, {14, 1.0}});
    const auto pages = collectAll(loader, 3);
    ASSERT_EQ(pages.size(), 3u);
    for (const Loaded& page : pages) {
        EXPECT_EQ(page.bytes.ok(), page.request.number != 13);
        if (page.bytes) continue;
        EXPECT_EQ(page.bytes.error().code, ErrorCode::Limit);
        EXPECT_TRUE(page.bytes.error().line().starts_with("fake.vcp: page 13: needs more memory"))
            << page.bytes.error().line();
    }
}

TEST(PageLoader, APageThatIsTooLargeIsRefusedWithItsFile) {
    const auto source = std::make_shared<FakeSource>(64);
    PageLoader loader(source, options(false, 1, 1000));
    loader.request(std::vector<Wish>{{28, 0}});
    ASSERT_TRUE(loader.waitForPage(kLong));
    const auto pages = loader.collect();
    ASSERT_EQ(pages.size(), 1u);
    ASSERT_FALSE(pages[0].bytes.ok());
    const std::string line = pages[0].bytes.error().line();
    EXPECT_TRUE(line.starts_with("fake.vcp: page 28: reading it takes 1024 bytes")) << line;
    EXPECT_NE(line.find("allow more"), std::string::npos) << line;
}

TEST(PageLoader, MemoryIsNeverExceeded) {
    const auto source = std::make_shared<FakeSource>(64);  // 1 KiB a page
    PageLoader loader(source, options(false, 3, 4096 + 512));
    std::vector<Wish> wishes;
    for (uint64_t page = 0; page < 64; ++page) wishes.push_back({page, 0});
    loader.request(wishes);
    size_t collected = 0;
    while (collected < 64 && loader.waitForPage(kLong)) {
        std::this_thread::sleep_for(milliseconds(2));
        const auto pages = loader.collect();
        EXPECT_LE(pages.size(), 4u);
        collected += pages.size();
    }
    EXPECT_EQ(collected, 64u);
    EXPECT_EQ(loader.stats().heldBytesMax, 4096u) << "all of it is used";
    EXPECT_EQ(loader.stats().heldBytes, 0u);
}

TEST(PageLoader, TheSourceKeepsPagesInWhatMemoryIsLeft) {
    constexpr uint64_t kMemory = 4096 + 512;
    const auto source = std::make_shared<FakeSource>(64);  // 1 KiB a page
    source->keeps = true;
    PageLoader loader(source, options(false, 3, kMemory));
    EXPECT_EQ(source->kept, kMemory);
    source->hold(true);
    loader.request({{0, 1}, {1, 1}, {2, 1}});
    source->waitUntilBegun(3);
    EXPECT_EQ(source->kept, kMemory - 3 * 1024) << "pages on their way come first";
    EXPECT_EQ(loader.stats().heldBytes, 3 * 1024u);
    source->hold(false);
    EXPECT_EQ(collectAll(loader, 3).size(), 3u);
    EXPECT_EQ(loader.stats().heldBytesMax, kMemory);
}

TEST(PageLoader, APageLargerThanTheMemoryIsAnError) {
    const auto source = std::make_shared<FakeSource>(64);
    PageLoader loader(source, options(false, 2, 1023));
    loader.request({{0, 2}, {1, 1}});
    for (const Loaded& page : collectAll(loader, 2)) {
        ASSERT_FALSE(page.bytes);
        EXPECT_EQ(page.bytes.error().code, ErrorCode::Limit);
    }
    EXPECT_TRUE(source->begun().empty());
    EXPECT_EQ(loader.stats().heldBytesMax, 0u);
}

TEST(PageLoader, AStalledReadHoldsNobodyUp) {
    const auto source = std::make_shared<FakeSource>();
    source->stalling = 5;
    PageLoader loader(source, options(false, 2, 1 << 20));
    std::vector<Wish> wishes{{5, 9}};
    for (uint64_t page = 10; page < 40; ++page) wishes.push_back({page, 1});
    loader.request(wishes);
    EXPECT_EQ(collectAll(loader, 30).size(), 30u) << "while page 5 is being read";
    EXPECT_EQ(loader.pending(), 1u);
    source->letGo();
    EXPECT_EQ(collectAll(loader, 1).size(), 1u);
}

TEST(PageLoader, AFailedReadIsTriedAgainAndGivenUpOnce) {
    const auto source = std::make_shared<FakeSource>();
    source->failing = 13;
    PageLoader loader(source, options(false, 2, 1 << 20));
    loader.request({{13, 1}, {14, 1}});
    const auto pages = collectAll(loader, 2);
    ASSERT_EQ(pages.size(), 2u);
    EXPECT_EQ(loader.stats().failures, 3u);
    const auto begun = source->begun();
    EXPECT_EQ(std::count(begun.begin(), begun.end(), 13u), 3);
    for (int i = 0; i < 3; ++i) loader.request({{13, 1}});
    EXPECT_FALSE(loader.waitForPage(kLong)) << "nobody asks for it again";
    EXPECT_EQ(source->begun().size(), begun.size());
}

TEST(PageLoader, StopsDuringAStalledRead) {
    const auto source = std::make_shared<FakeSource>();
    source->stalling = 3;
    {
        PageLoader loader(source, options(false, 2, 1 << 20));
        loader.request({{3, 1}});
        source->waitUntilBegun(1);
    }
    EXPECT_EQ(source->begun().size(), 1u);
}

TEST(PageLoader, StopsAtAnyMoment) {
    for (int i = 0; i < 200; ++i) {
        const auto source = std::make_shared<FakeSource>();
        PageLoader loader(source, options(false, 1 + i % 4, 1 << 20));
        std::vector<Wish> wishes;
        for (uint64_t page = 0; page < 20; ++page) wishes.push_back({page, 0});
        loader.request(wishes);
        if (i % 3 == 0) loader.collect();
    }
}

}  // namespace
}  // namespace vcp
