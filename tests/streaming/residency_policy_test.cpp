// The policy with a source, a pool and a time made by hand: whatever the tree, the budget, the order of
// arrival, the faults and the history, budgets hold and every view settles on the same pages.
#include "streaming/residency_policy.h"

#include <algorithm>
#include <set>

#include <gtest/gtest.h>

#include "streaming/request_queue.h"
#include "tests/support/test_trees.h"

namespace vcp {
namespace {

constexpr double kFrameSeconds = 1.0 / 60;

struct Conditions {
    uint64_t budgetBytes = 0;
    double failRate = 0;     // of single reads
    std::set<uint64_t> bad;  // pages that never can be read
    uint64_t seed = 0;       // order of arrival
    size_t perRound = 3;     // pages that arrive
    LoadOrder order = LoadOrder::Feedback;
    uint64_t chunkBytes = test::kChunkBytes;
};

/// A pool that remembers which page's bytes are in each unit, a queue, and reads that end in any order.
class Simulation {
public:
    Simulation(std::shared_ptr<const Dataset> dataset, Conditions conditions)
        : dataset_(std::move(dataset)),
          c_(std::move(conditions)),
          random_(c_.seed),
          pooled_{dataset_, dataset_->hasColour()},
          shape_(poolShapeFor({&pooled_, 1}, c_.budgetBytes, c_.chunkBytes)),
          policy({&pooled_, 1}, shape_, c_.order),
          queue_({.attempts = 12, .damagedAttempts = 12}),
          content_(shape_.units, kNothing) {
        EXPECT_LE(shape_.units * kPoolUnitBytes, c_.budgetBytes);
    }

    /// One round; true when it says that it has settled.
    bool round(const SelectionView& view, ViewNumber number = 0) {
        now_ += kFrameSeconds;
        std::vector<uint64_t> read;
        for (size_t i = 0; i < c_.perRound; ++i) {
            begin();
            if (underWay_.empty()) break;
            const auto at = underWay_.begin() + std::ptrdiff_t(random_() % underWay_.size());
            const uint64_t page = *at;
            underWay_.erase(at);
            if (c_.bad.contains(page) || double(random_() % 1000) < 1000 * c_.failRate) {
                if (!queue_.failed(page, ErrorCode::Io, now_)) continue;
                queue_.delivered(page);
                EXPECT_TRUE(policy.giveUp(page)) << "reported twice";
                continue;
            }
            queue_.delivered(page);
            ++reads;
            read.push_back(page);
        }
        policy.look(test::only(view), now_, number);
        for (const uint64_t page : read) carryOut(page, policy.place(page));
        // Rays may ask for anything.
        if (c_.failRate > 0)
            policy.hear({.hits = {{random_() % dataset_->pages.size(), glm::ivec3(int(random_() >> 34))}},
                         .passed = {{random_() % dataset_->pages.size(), 1}}},
                        view);
        outcome = policy.finish(number);
        queue_.replace(outcome.wishes);
        check();
        // Nothing wanted is missing, so nothing of it is queued or under way.
        return outcome.cuts[0].complete;
    }

    /// Rounds of a still view until it has settled.
    void settle(const SelectionView& view) {
        round(view);
        const uint64_t reloads = policy.counts().reloads;
        for (int i = 0; !round(view); ++i) ASSERT_LT(i, 20000) << "does not settle";
        EXPECT_EQ(policy.counts().reloads, reloads) << "a still view loaded a page twice";
        const auto cut = outcome.cuts[0].cut;
        const uint64_t loads = policy.counts().loads;
        // What was under way for other views may still arrive; the picture stays.
        for (int i = 0; i < 20; ++i) {
            EXPECT_TRUE(round(view));
            EXPECT_EQ(outcome.cuts[0].cut, cut);
        }
        for (const Wish& wish : outcome.wishes) ADD_FAILURE() << "settled, and wishes for page " << wish.request.number;
        EXPECT_GE(policy.counts().loads, loads);
    }

    /// Another pool; its content is lost.
    void setBudget(uint64_t budgetBytes) {
        shape_ = poolShapeFor({&pooled_, 1}, budgetBytes, c_.chunkBytes);
        content_.assign(shape_.units, kNothing);
        policy.setPool(shape_);
        EXPECT_EQ(policy.unitsTaken(), 0u);
    }

    uint64_t reads = 0;
    uint64_t mostBytes = 0;  // of the policy
    size_t mostEntries = 0;  // of the queue

private:
    static constexpr uint64_t kNothing = UINT64_MAX;

    void begin() {
        while (underWay_.size() < 4u) {
            const auto wish = queue_.next(now_);
            if (!wish) return;
            EXPECT_FALSE(policy.isResident(wish->request.number)) << "what is there is not read";
            queue_.begin(wish->request.number);
            underWay_.push_back(wish->request.number);
        }
    }

    void carryOut(uint64_t page, const Placement& placement) {
        for (const PageMove& move : placement.moves) {
            ASSERT_LT(move.to.firstUnit, move.from.firstUnit);
            for (uint64_t i = 0; i < move.from.units; ++i) {
                ASSERT_EQ(content_[move.from.firstUnit + i], move.page) << "moves what is not there";
                content_[move.to.firstUnit + i] = move.page;
            }
        }
        if (!placement.slot) return;
        ASSERT_EQ(placement.slot->firstUnit / shape_.unitsPerChunk, (placement.slot->end() - 1) / shape_.unitsPerChunk);
        for (uint64_t i = placement.slot->firstUnit; i < placement.slot->end(); ++i) content_[i] = page;
    }

    /// What is resident is where the policy says, whole; the sum is within the budget.
    void check() {
        uint64_t units = 0;
        for (uint64_t page = 0; page < dataset_->pages.size(); ++page) {
            if (!policy.isResident(page)) continue;
            const PoolSlot slot = policy.slotOf(page);
            ASSERT_LE(slot.end(), content_.size());
            for (uint64_t i = slot.firstUnit; i < slot.end(); ++i) ASSERT_EQ(content_[i], page);
            units += slot.units;
        }
        ASSERT_EQ(units, policy.unitsTaken());
        mostBytes = std::max(mostBytes, policy.bytesHeld());
        mostEntries = std::max(mostEntries, queue_.entries());
        for (const uint64_t page : outcome.cuts[0].cut) ASSERT_TRUE(policy.isResident(page));
    }

    std::shared_ptr<const Dataset> dataset_;
    Conditions c_;
    std::mt19937_64 random_;
    PooledDataset pooled_;
    PoolShape shape_;

public:
    ResidencyPolicy policy;
    PolicyOutcome outcome;

private:
    RequestQueue queue_;
    std::vector<uint64_t> underWay_;
    std::vector<uint64_t> content_;
    double now_ = 0;
};

std::shared_ptr<const Dataset> treeFor(uint64_t seed) {
    const uint32_t maxBytes = seed % 3 == 0 ? 16384 : 12 * 16384;
    return std::make_shared<const Dataset>(test::randomTree(seed, 3 + seed % 2, seed % 2 == 0 ? 0.7 : 0.5, maxBytes));
}

uint64_t allBytes(const Dataset& dataset) {
    uint64_t units = 0;
    for (const PageEntry& page : dataset.pages) units += pageUnits(page, dataset.hasColour());
    return units * kPoolUnitBytes;
}

/// From just more than the coarsest page to all.
uint64_t randomBudget(const Dataset& dataset, std::mt19937_64& random) {
    const uint64_t least = (pageUnits(dataset.pages[0], dataset.hasColour()) + 1) * kPoolUnitBytes;
    const double part = std::pow(double(random() % 1000) / 999, 2);
    return least + uint64_t(part * double(allBytes(dataset)));
}

/// What a view should settle on, from selection alone.
std::vector<uint64_t> idealCut(const Dataset& dataset, const SelectionView& view, const std::set<uint64_t>& bad) {
    std::vector<uint64_t> units;
    std::vector<uint8_t> all(dataset.pages.size(), 1), unavailable(dataset.pages.size(), 0);
    for (const PageEntry& page : dataset.pages) units.push_back(pageUnits(page, dataset.hasColour()));
    for (const uint64_t page : bad) unavailable[page] = 1, all[page] = 0;
    return selectPages(dataset, view, UINT64_MAX, units, all, unavailable).cut;
}

TEST(ResidencyPolicy, MovesLittleMoreThanItLoads) {
    uint64_t loaded = 0, moved = 0;
    for (uint64_t seed = 0; seed < 6; ++seed) {
        const auto dataset = std::make_shared<const Dataset>(test::randomTree(seed, 5, 0.6, 6 * 16384));
        Simulation fly(dataset, {.budgetBytes = allBytes(*dataset) / 4,
                                 .failRate = 0,
                                 .bad = {},
                                 .seed = seed,
                                 .perRound = 40,
                                 .order = LoadOrder::Feedback,
                                 .chunkBytes = uint64_t{1} << 40});
        std::mt19937_64 random(seed);
        SelectionView view = test::randomView(random, 0.1);
        for (int i = 0; i < 60; ++i) {
            if (i % 20 == 0) view = test::randomView(random, 0.1);
            view.eye += glm::dvec3(0.02, 0.01, 0.015);
            fly.round(view);
        }
        fly.settle(view);
        loaded += fly.policy.counts().unitsLoaded;
        moved += fly.policy.counts().unitsMoved;
    }
    EXPECT_GT(loaded, 2000u);
    EXPECT_LT(moved, loaded) << loaded;
}

TEST(ResidencyPolicy, SettlesOnTheSamePagesWhateverTheHistoryOrderAndFaults) {
    int differentFromIdeal = 0, relaxed = 0;
    for (uint64_t seed = 0; seed < 60; ++seed) {
        SCOPED_TRACE(seed);
        const auto dataset = treeFor(seed);
        std::mt19937_64 random(seed);
        const uint64_t budget = randomBudget(*dataset, random);
        const SelectionView view = test::randomView(random, 0.5);
        Simulation plain(dataset, {.budgetBytes = budget, .failRate = 0, .bad = {}, .seed = 1, .perRound = 8});
        if (!plain.policy.hasRoom()) continue;
        plain.settle(view);
        for (uint64_t other = 0; other < 5; ++other) {
            Simulation wild(dataset, {.budgetBytes = budget,
                                      .failRate = 0.2,
                                      .bad = {},
                                      .seed = seed * 10 + other,
                                      .perRound = 1 + random() % 5,
                                      .order = static_cast<LoadOrder>(other)});
            SelectionView moving = view;
            for (int i = 0; i < 40; ++i) {
                if (random() % 5 == 0) moving = test::randomView(random, 0.5);
                if (random() % 2 == 0) moving.eye.x += 0.02;
                wild.round(moving);
            }
            wild.settle(view);
            EXPECT_EQ(wild.outcome.cuts[0].cut, plain.outcome.cuts[0].cut);
            EXPECT_EQ(wild.outcome.cuts[0].errorPixels, plain.outcome.cuts[0].errorPixels);
        }
        const bool same = plain.outcome.cuts[0].cut == idealCut(*dataset, view, {});
        EXPECT_EQ(same, !plain.outcome.cuts[0].isRelaxed)
            << "relaxed is said where, and only where, the budget is too small";
        differentFromIdeal += same ? 0 : 1;
        relaxed += plain.outcome.cuts[0].isRelaxed ? 1 : 0;
    }
    EXPECT_GT(relaxed, 5);
    EXPECT_LT(differentFromIdeal, 55) << "and budgets that suffice were among them";
}

TEST(ResidencyPolicy, ABudgetThatSufficesGivesTheUnbudgetedPicture) {
    for (uint64_t seed = 0; seed < 40; ++seed) {
        SCOPED_TRACE(seed);
        const auto dataset = treeFor(seed);
        std::mt19937_64 random(seed);
        const SelectionView view = test::randomView(random, 0.5);
        Simulation all(dataset, {.budgetBytes = UINT64_MAX >> 1, .failRate = 0, .bad = {}, .seed = seed});
        all.settle(view);
        EXPECT_EQ(all.outcome.cuts[0].cut, idealCut(*dataset, view, {}));
        EXPECT_FALSE(all.outcome.cuts[0].isRelaxed);
    }
}

TEST(ResidencyPolicy, PagesThatCannotBeReadAreDrawnFromTheirParents) {
    for (uint64_t seed = 0; seed < 30; ++seed) {
        SCOPED_TRACE(seed);
        const auto dataset = treeFor(seed);
        std::mt19937_64 random(seed);
        std::set<uint64_t> bad;
        for (uint64_t page = 1; page < dataset->pages.size(); ++page)
            if (random() % 10 == 0) bad.insert(page);
        SelectionView view = test::randomView(random, 0);
        for (glm::dvec4& plane : view.planes) plane = {0, 0, 0, 1};  // all is in view: all is wanted
        Simulation damaged(dataset, {.budgetBytes = UINT64_MAX >> 1, .failRate = 0.1, .bad = bad, .seed = seed});
        damaged.settle(view);
        EXPECT_EQ(damaged.outcome.cuts[0].cut, idealCut(*dataset, view, bad));
    }
}

TEST(ResidencyPolicy, AShakingViewDoesNotThrash) {
    // In turn ahead and behind, each of which wants all of the pool.
    uint64_t shaking = 0, without = 0;
    for (uint64_t seed = 0; seed < 4; ++seed) {
        const auto dataset = std::make_shared<const Dataset>(test::randomTree(seed, 4, 0.9, 16384));
        SelectionView views[2];
        for (int i = 0; i < 2; ++i) {
            views[i].eye = {0.5, 0.4, 0.6};
            views[i].errorPixels = 0.05;
            views[i].pixelsPerUnit = 1000;
            for (glm::dvec4& plane : views[i].planes) plane = {i == 0 ? 1 : -1, 0, 0, -0.01};
        }
        Simulation sim(dataset,
                       {.budgetBytes = allBytes(*dataset) / 3, .failRate = 0, .bad = {}, .seed = seed, .perRound = 50});
        if (!sim.policy.hasRoom()) continue;
        sim.settle(views[0]);
        const uint64_t before = sim.policy.counts().loads;
        for (int i = 1; i <= 240; ++i) sim.round(views[i % 2]);
        shaking += sim.policy.counts().loads - before;
        // What one exchange takes.
        const uint64_t base = sim.policy.counts().loads;
        for (int i = 0; i < 4; ++i) sim.settle(views[i % 2]);
        without += (sim.policy.counts().loads - base) / 4;
    }
    EXPECT_GT(without, 50u) << "the views do want different pages";
    EXPECT_LT(shaking, without * 240 / 10);
}

TEST(ResidencyPolicy, LooksAheadAlongTheMotionOnly) {
    const auto dataset = std::make_shared<const Dataset>(test::randomTree(4, 4, 1, 16384));
    SelectionView view;
    view.pixelsPerUnit = 1000;
    view.errorPixels = 1;
    for (glm::dvec4& plane : view.planes) plane = {1, 0, 0, 0};  // all that is ahead in x
    view.eye = {-6, 0.5, 0.5};
    Simulation sim(dataset, {.budgetBytes = UINT64_MAX >> 1, .failRate = 0, .bad = {}, .seed = 1, .perRound = 1000});
    sim.settle(view);
    const uint64_t still = sim.policy.counts().loads;
    view.eye.x += 0.3;
    sim.round(view);
    EXPECT_GT(sim.outcome.wishes.size(), sim.outcome.missing[0]) << "nearer pages, which this view does not want yet";
    const auto wishes = sim.outcome.wishes;
    EXPECT_TRUE(std::is_sorted(wishes.begin(), wishes.end(),
                               [](const auto& a, const auto& b) { return a.priority > b.priority; }));
    sim.round(view);
    EXPECT_EQ(sim.outcome.wishes.size(), sim.outcome.missing[0]) << "it stands still";
    EXPECT_GE(sim.policy.counts().loads, still);
}

TEST(ResidencyPolicy, ChildrenGoBeforeParentsAndTheCoarsestStays) {
    for (uint64_t seed = 0; seed < 20; ++seed) {
        const auto dataset = treeFor(seed);
        std::mt19937_64 random(seed);
        std::vector<uint64_t> parent(dataset->pages.size(), 0);
        for (uint64_t page = 0; page < dataset->pages.size(); ++page)
            for (uint32_t i = 0; i < uint32_t(std::popcount(dataset->pages[page].childMask)); ++i)
                parent[dataset->pages[page].firstChild + i] = page;
        Simulation sim(dataset, {.budgetBytes = allBytes(*dataset) / 2, .failRate = 0, .bad = {}, .seed = seed});
        if (!sim.policy.hasRoom()) continue;
        sim.settle(test::randomView(random, 0.5));
        for (int i = 0; i < 10; ++i) {
            sim.settle(test::randomView(random, 0.2));
            for (uint64_t page = 0; page < dataset->pages.size(); ++page)
                EXPECT_TRUE(!sim.policy.isResident(page) || sim.policy.isResident(parent[page])) << page;
        }
    }
}

TEST(ResidencyPolicy, WithAnotherPoolItSettlesAsIfItHadAlwaysBeenThere) {
    for (uint64_t seed = 0; seed < 20; ++seed) {
        SCOPED_TRACE(seed);
        const auto dataset = treeFor(seed);
        std::mt19937_64 random(seed);
        const SelectionView view = test::randomView(random, 0.5);
        const std::set<uint64_t> bad{dataset->pages.size() - 1};
        Simulation sim(dataset, {.budgetBytes = allBytes(*dataset), .failRate = 0, .bad = bad, .seed = seed});
        for (int i = 0; i < 6; ++i) {
            const uint64_t budget = randomBudget(*dataset, random);
            Simulation fresh(dataset, {.budgetBytes = budget, .failRate = 0, .bad = bad, .seed = seed});
            if (!fresh.policy.hasRoom()) continue;
            fresh.settle(view);
            sim.setBudget(budget);
            sim.settle(view);
            EXPECT_EQ(sim.outcome.cuts[0].cut, fresh.outcome.cuts[0].cut);
        }
    }
}

TEST(ResidencyPolicy, AfterALossTheSameViewSettlesAgain) {
    const auto dataset = treeFor(5);
    std::mt19937_64 random(5);
    const SelectionView view = test::randomView(random, 0.5);
    Simulation sim(dataset, {.budgetBytes = allBytes(*dataset), .failRate = 0, .bad = {}, .seed = 5});
    sim.settle(view);
    const auto cut = sim.outcome.cuts[0].cut;
    sim.policy.clear();
    EXPECT_EQ(sim.policy.unitsTaken(), 0u);
    for (int i = 0; !sim.round(view); ++i) ASSERT_LT(i, 10000);
    EXPECT_EQ(sim.outcome.cuts[0].cut, cut);
}

/// `count` views of a dataset, near each other or not.
std::vector<SelectionView> manyViews(std::mt19937_64& random, size_t count) {
    std::vector<SelectionView> views;
    while (views.size() < count) views.push_back(test::randomView(random, 0.5));
    return views;
}

/// Rounds of all views in turn until all have settled; what each can draw.
std::vector<DrawableCut> settleAll(Simulation& sim, std::span<const SelectionView> views) {
    const auto all = [&] {
        bool settled = true;
        for (ViewNumber number = 0; number < views.size(); ++number)
            settled = sim.round(views[number], number) && settled;
        return settled;
    };
    for (int i = 0; !all(); ++i)
        if (i > 5000) {
            ADD_FAILURE() << "does not settle";
            break;
        }
    EXPECT_TRUE(all()) << "settled views stay settled";
    EXPECT_TRUE(sim.outcome.wishes.empty());
    std::vector<DrawableCut> drawn;
    for (ViewNumber number = 0; number < views.size(); ++number) drawn.push_back(sim.policy.drawable(number, 0));
    return drawn;
}

TEST(ResidencyPolicy, ViewsThatShareAPoolDrawWhatEachWouldDrawAlone) {
    for (uint64_t seed = 0; seed < 12; ++seed) {
        SCOPED_TRACE(seed);
        const auto dataset = treeFor(seed);
        std::mt19937_64 random(seed);
        const std::vector<SelectionView> views = manyViews(random, 10);
        Simulation sim(dataset, {.budgetBytes = UINT64_MAX >> 1, .failRate = 0.1, .bad = {}, .seed = seed});
        const auto drawn = settleAll(sim, views);
        uint64_t wanted = 0;
        for (size_t i = 0; i < views.size(); ++i) {
            EXPECT_EQ(drawn[i].cut, idealCut(*dataset, views[i], {}));
            EXPECT_FALSE(drawn[i].isRelaxed);
            wanted += drawn[i].pagesWanted;
        }
        EXPECT_EQ(sim.policy.counts().loads, sim.policy.pagesResident()) << "what several views want is read once";
        EXPECT_GT(wanted, sim.policy.counts().loads);
    }
}

TEST(ResidencyPolicy, ViewsThatShareATooSmallPoolAreRelaxedTogether) {
    int relaxed = 0;
    for (uint64_t seed = 0; seed < 24; ++seed) {
        SCOPED_TRACE(seed);
        const auto dataset = treeFor(seed);
        std::mt19937_64 random(seed);
        const std::vector<SelectionView> views = manyViews(random, 10);
        const uint64_t budget = randomBudget(*dataset, random) / 2;
        Simulation plain(dataset, {.budgetBytes = budget, .failRate = 0, .bad = {}, .seed = seed, .perRound = 8});
        if (!plain.policy.hasRoom()) continue;
        const auto expected = settleAll(plain, views);
        // Another history, with a view that is gone at the end.
        Simulation wild(dataset, {.budgetBytes = budget, .failRate = 0.2, .bad = {}, .seed = seed + 100});
        for (int i = 0; i < 40; ++i) wild.round(test::randomView(random, 0.2), static_cast<ViewNumber>(random() % 12));
        wild.policy.forgetView(10);
        wild.policy.forgetView(11);
        const auto drawn = settleAll(wild, views);
        for (size_t i = 0; i < views.size(); ++i) {
            EXPECT_EQ(drawn[i].cut, expected[i].cut);
            relaxed += drawn[i].isRelaxed ? 1 : 0;
        }
        // The same view twice is drawn the same.
        std::vector<SelectionView> twins(views.begin(), views.begin() + 3);
        twins.push_back(views[0]);
        for (ViewNumber number = 4; number < 10; ++number) wild.policy.forgetView(number);
        const auto pair = settleAll(wild, twins);
        EXPECT_EQ(pair[0].cut, pair[3].cut);
    }
    EXPECT_GT(relaxed, 20);
}

TEST(ResidencyPolicy, WhatJustCameStaysForAWhileInSeconds) {
    // Two views in turn, each of which wants all of the pool: what one brought the other may not take before its time.
    const auto dataset = std::make_shared<const Dataset>(test::randomTree(1, 4, 0.9, 16384));
    const uint64_t budget = allBytes(*dataset) / 3;
    const PooledDataset pooled{dataset, dataset->hasColour()};
    ResidencyPolicy policy({&pooled, 1}, poolShapeFor({&pooled, 1}, budget, test::kChunkBytes));
    SelectionView views[2];
    for (int i = 0; i < 2; ++i) {
        views[i].eye = {0.5, 0.4, 0.6};
        views[i].errorPixels = 0.05;
        views[i].pixelsPerUnit = 1000;
        for (glm::dvec4& plane : views[i].planes) plane = {i == 0 ? 1 : -1, 0, 0, -0.01};
    }
    const auto placeAll = [&](const SelectionView& view, double seconds) {
        policy.look(test::only(view), seconds);
        for (PolicyOutcome outcome = policy.finish(); !outcome.wishes.empty(); outcome = policy.finish())
            for (const Wish& wish : outcome.wishes) policy.place(wish.request.number);
    };
    placeAll(views[0], 10);
    const uint64_t before = policy.counts().evictions;
    placeAll(views[1], 10 + 0.9 * kSettlingSeconds);
    EXPECT_EQ(policy.counts().evictions, before);
    placeAll(views[0], 10 + 0.95 * kSettlingSeconds);
    placeAll(views[1], 10 + 1.01 * kSettlingSeconds);
    EXPECT_GT(policy.counts().evictions, before);
}

TEST(ResidencyPolicy, NoThrashingAtAnyBudgetDownToTheCoarsestLevel) {
    for (uint64_t seed = 0; seed < 4; ++seed) {
        const auto dataset = treeFor(seed);
        std::mt19937_64 random(seed);
        const SelectionView view = test::randomView(random, 0.01), other = test::randomView(random, 0.01);
        const uint64_t least = pageUnits(dataset->pages[0], dataset->hasColour()) * kPoolUnitBytes;
        for (uint64_t part = 0; part <= 24; ++part) {
            SCOPED_TRACE(part);
            Simulation sim(
                dataset,
                {.budgetBytes = least + allBytes(*dataset) * part / 24, .failRate = 0.1, .bad = {}, .seed = seed});
            if (!sim.policy.hasRoom()) continue;
            sim.settle(other);
            sim.settle(view);
            const uint64_t loads = sim.policy.counts().loads, evictions = sim.policy.counts().evictions;
            for (int i = 0; i < 200; ++i) sim.round(view);
            EXPECT_EQ(sim.policy.counts().loads, loads) << "a settled view goes on loading";
            EXPECT_EQ(sim.policy.counts().evictions, evictions);
        }
    }
}

TEST(ResidencyPolicy, MemoryIsFlatOverAHundredThousandFrames) {
    const auto dataset = std::make_shared<const Dataset>(test::randomTree(2, 3, 0.9, 16384));
    Simulation sim(
        dataset,
        {.budgetBytes = allBytes(*dataset) / 3, .failRate = 0.05, .bad = {dataset->pages.size() - 1}, .seed = 2});
    ASSERT_TRUE(sim.policy.hasRoom());
    std::mt19937_64 random(2);
    SelectionView view = test::randomView(random, 4);
    uint64_t most = 0, entries = 0;
    for (int frame = 1; frame <= 100'000; ++frame) {
        if (frame % 40 == 0) view = test::randomView(random, 4);
        if (frame % 20 == 0) view.eye.x += 0.001;
        sim.round(view, static_cast<ViewNumber>(frame / 40 % 3));
        // What the first tenth took is enough for the rest.
        if (frame == 10'000) most = sim.mostBytes, entries = sim.mostEntries;
    }
    EXPECT_GT(sim.policy.counts().evictions, 2000u);
    EXPECT_LE(sim.mostBytes, most + most / 50);
    EXPECT_LE(sim.mostEntries, entries + entries / 50);
    EXPECT_LE(sim.mostEntries, 6 * dataset->pages.size());
}

}  // namespace
}  // namespace vcp
