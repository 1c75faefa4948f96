// Datasets of one scene share a pool: the budget goes to what is seen, whichever dataset it is of.
#include "streaming/residency_policy.h"

#include <algorithm>
#include <array>
#include <random>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "streaming/scene_source.h"
#include "tests/support/test_trees.h"

namespace vcp {
namespace {

using Views = std::vector<std::optional<SelectionView>>;

struct Datasets {
    std::vector<PooledDataset> pooled;

    explicit Datasets(uint64_t seed, size_t count = 4) {
        for (size_t i = 0; i < count; ++i) {
            const auto tree = std::make_shared<const Dataset>(
                test::randomTree(seed * 10 + i, uint32_t(2 + (seed + i) % 3), 0.6, 3 * kPoolUnitBytes));
            pooled.push_back({tree, tree->hasColour()});
        }
    }
    [[nodiscard]] const Dataset& operator[](size_t i) const { return *pooled[i].dataset; }
    [[nodiscard]] std::vector<uint64_t> units(size_t i) const {
        std::vector<uint64_t> all;
        for (const PageEntry& page : pooled[i].dataset->pages) all.push_back(pageUnits(page, pooled[i].withColour));
        return all;
    }
    [[nodiscard]] uint64_t allUnits() const {
        uint64_t sum = 0;
        for (size_t i = 0; i < pooled.size(); ++i)
            for (const uint64_t each : units(i)) sum += each;
        return sum;
    }
    [[nodiscard]] uint64_t coarsestUnits() const {
        uint64_t sum = 0;
        for (size_t i = 0; i < pooled.size(); ++i) sum += units(i)[0];
        return sum;
    }
    [[nodiscard]] Views views(std::mt19937_64& random) const {
        Views all;
        for (size_t i = 0; i < pooled.size(); ++i) all.emplace_back(test::randomView(random, 0.3));
        return all;
    }
};

struct Expected {
    std::vector<std::set<uint64_t>> wanted;
    bool relaxed = false;
};

/// What is to be chosen, by looking through all pages of all datasets for each page that is refined.
Expected slowChoice(const Datasets& datasets, const Views& views, uint64_t budget) {
    Expected expected{std::vector<std::set<uint64_t>>(datasets.pooled.size())};
    std::vector<std::set<uint64_t>> refined(datasets.pooled.size());
    uint64_t taken = datasets.coarsestUnits();
    for (std::set<uint64_t>& wanted : expected.wanted) wanted.insert(0);
    for (;;) {
        double most = 0;
        size_t of = 0;
        uint64_t page = 0;
        for (size_t i = 0; i < datasets.pooled.size(); ++i) {
            if (!views[i]) continue;
            for (const uint64_t each : expected.wanted[i]) {
                const PageEntry& entry = datasets[i].pages[each];
                if (refined[i].contains(each) || entry.childMask == 0 || !inFrustum(datasets[i], entry, *views[i]))
                    continue;
                const double error = projectedError(datasets[i], entry, *views[i]);
                if (error <= views[i]->errorPixels || error / views[i]->errorPixels <= most) continue;
                most = error / views[i]->errorPixels, of = i, page = each;
            }
        }
        if (most == 0) return expected;
        refined[of].insert(page);
        const std::vector<uint64_t> units = datasets.units(of);
        uint64_t more = 0;
        for (const uint64_t child : childrenOf(datasets[of].pages[page])) more += units[child];
        if (taken + more > budget) {
            expected.relaxed = true;
            return expected;
        }
        taken += more;
        for (const uint64_t child : childrenOf(datasets[of].pages[page])) expected.wanted[of].insert(child);
    }
}

TEST(ChooseTogether, RefinesThePageThatErrsMostOfAllDatasets) {
    int relaxed = 0;
    for (uint64_t seed = 0; seed < 40; ++seed) {
        SCOPED_TRACE(seed);
        const Datasets datasets(seed);
        std::mt19937_64 random(seed);
        Views views = datasets.views(random);
        if (seed % 4 == 0) views[seed % 3].reset();
        const uint64_t budget = datasets.coarsestUnits() + random() % datasets.allUnits();
        std::vector<std::vector<uint64_t>> units;
        std::vector<std::vector<uint8_t>> states;
        std::vector<ChoosingDataset> choosing;
        for (size_t i = 0; i < datasets.pooled.size(); ++i) {
            units.push_back(datasets.units(i));
            states.emplace_back(datasets[i].pages.size(), kAvailable);
        }
        for (size_t i = 0; i < datasets.pooled.size(); ++i) {
            const std::span<const SelectionView> seen =
                views[i] ? std::span<const SelectionView>(&*views[i], 1) : std::span<const SelectionView>();
            choosing.push_back({datasets[i], seen, units[i], states[i], {}});
        }
        const std::vector<PageChoice> chosen = chooseTogether(choosing, budget);
        const Expected expected = slowChoice(datasets, views, budget);
        for (size_t i = 0; i < datasets.pooled.size(); ++i) {
            std::set<uint64_t> wanted;
            for (const WantedPage& each : chosen[i].wanted) wanted.insert(each.page);
            EXPECT_EQ(wanted, expected.wanted[i]) << "of dataset " << i;
            EXPECT_EQ(chosen[i].relaxed, expected.relaxed) << "all are relaxed together";
        }
        relaxed += expected.relaxed ? 1 : 0;
    }
    EXPECT_GT(relaxed, 5);
    EXPECT_LT(relaxed, 35);
}

/// Reads that end in any order.
class Flight {
public:
    Flight(const Datasets& datasets, uint64_t budgetBytes, uint64_t seed)
        : datasets_(datasets),
          shape_(poolShapeFor(datasets.pooled, budgetBytes, test::kChunkBytes)),
          random_(seed),
          policy(datasets.pooled, shape_) {}

    bool round(const Views& views) {
        policy.look(views, now_ += 1.0 / 60);
        for (int i = 0; i < 3 && !outcome.wishes.empty(); ++i) {
            std::swap(outcome.wishes[random_() % outcome.wishes.size()], outcome.wishes.back());
            policy.place(outcome.wishes.back().request.number);
            outcome.wishes.pop_back();
        }
        outcome = policy.finish();
        EXPECT_LE(policy.unitsTaken(), shape_.units);
        for (size_t i = 0; i < datasets_.pooled.size(); ++i)
            for (const uint64_t page : outcome.cuts[i].cut)
                EXPECT_TRUE(policy.isResident(policy.numbers().firstPage(i) + page));
        return std::all_of(outcome.cuts.begin(), outcome.cuts.end(),
                           [](const DrawableCut& cut) { return cut.pagesMissing == 0; });
    }
    void settle(const Views& views) {
        for (int i = 0; !round(views); ++i) ASSERT_LT(i, 5000) << "does not settle";
        EXPECT_EQ(policy.counts().reloads, 0u);
        EXPECT_TRUE(outcome.wishes.empty());
    }

private:
    const Datasets& datasets_;
    const PoolShape shape_;
    std::mt19937_64 random_;
    double now_ = 0;

public:
    ResidencyPolicy policy;
    PolicyOutcome outcome;
};

TEST(ScenePolicy, SettlesOnTheSamePagesWhateverTheHistory) {
    int relaxed = 0;
    for (uint64_t seed = 0; seed < 24; ++seed) {
        SCOPED_TRACE(seed);
        const Datasets datasets(seed);
        std::mt19937_64 random(seed);
        Views views = datasets.views(random);
        views[seed % 4].reset();
        const uint64_t budget = (2 * datasets.coarsestUnits() + random() % datasets.allUnits()) * kPoolUnitBytes;
        Flight plain(datasets, budget, seed), wild(datasets, budget, seed + 100);
        if (!plain.policy.hasRoom()) continue;
        plain.settle(views);
        for (int i = 0; i < 30; ++i) {
            Views other = datasets.views(random);
            other[random() % 4].reset();
            wild.round(other);
        }
        wild.settle(views);
        for (size_t i = 0; i < datasets.pooled.size(); ++i) {
            EXPECT_EQ(wild.outcome.cuts[i].cut, plain.outcome.cuts[i].cut);
            relaxed += plain.outcome.cuts[i].isRelaxed ? 1 : 0;
        }
        EXPECT_TRUE(plain.outcome.cuts[seed % 4].cut.empty()) << "what is not shown is not drawn";
        EXPECT_EQ(plain.policy.residentPages(seed % 4), std::vector<uint64_t>{0});
    }
    EXPECT_GT(relaxed, 5);
}

TEST(ScenePolicy, WhatIsSeenHasAllThatTheOthersDoNotNeed) {
    // Four copies share room for one: the one that is in view is as fine as if it were alone.
    const auto tree = std::make_shared<const Dataset>(test::randomTree(4, 4, 0.7, kPoolUnitBytes));
    Datasets datasets(0, 0);
    for (int i = 0; i < 4; ++i) datasets.pooled.push_back({tree, tree->hasColour()});
    Datasets alone(0, 0);
    alone.pooled.push_back(datasets.pooled[0]);
    SelectionView near;
    near.eye = {0.5, 0.5, -0.2};
    near.pixelsPerUnit = 1000;
    near.errorPixels = 0.2;
    SelectionView away = near;
    for (glm::dvec4& plane : away.planes) plane = {1, 0, 0, -100};
    const uint64_t budget = (alone.allUnits() + 3) * kPoolUnitBytes;
    for (size_t shown = 0; shown < 4; ++shown) {
        Views views(4, away);
        views[shown] = near;
        Flight scene(datasets, budget + 64 * kPoolUnitBytes, shown), one(alone, 2 * budget, shown);
        scene.settle(views);
        one.settle({near});
        EXPECT_GT(one.outcome.cuts[0].cut.size(), 50u);
        EXPECT_EQ(scene.outcome.cuts[shown].cut, one.outcome.cuts[0].cut);
        EXPECT_FALSE(scene.outcome.cuts[shown].isRelaxed);
    }
}

TEST(SceneNumbers, NamePagesAndBlocksOnEnd) {
    SceneNumbers numbers;
    const std::array<std::pair<uint64_t, uint64_t>, 4> sizes{{{5, 1}, {0, 0}, {7, 2}, {1, 1}}};
    for (const auto& [pages, blocks] : sizes) numbers.add(pages, blocks);
    EXPECT_EQ(numbers.datasets(), 4u);
    EXPECT_EQ(numbers.pages(), 13u);
    uint64_t page = 0, block = 0;
    for (size_t i = 0; i < sizes.size(); ++i) {
        EXPECT_EQ(numbers.firstPage(i), page);
        for (uint64_t own = 0; own < sizes[i].first; ++own, ++page) {
            EXPECT_EQ(numbers.datasetOf(page), i);
            EXPECT_EQ(numbers.inScene(i, own), Request(page));
            EXPECT_EQ(numbers.inDataset(page), Request(own));
            EXPECT_EQ(numbers.isCoarsest(page), own == 0);
        }
        for (uint64_t own = 0; own < sizes[i].second; ++own, ++block) {
            EXPECT_EQ(numbers.inScene(i, Request::directoryBlock(own)), Request::directoryBlock(block));
            EXPECT_EQ(numbers.inDataset(Request::directoryBlock(block)), Request::directoryBlock(own));
        }
    }
}

/// Pages of a thousand bytes that say which dataset they are of, and a number of kept bytes that grows to the limit.
class NamedSource final : public PageSource {
public:
    explicit NamedSource(std::string name) : name_(std::move(name)) {}
    Result<PageBytes> read(Request request, bool) const override {
        return Error{.code = ErrorCode::Io, .message = name_ + " " + std::to_string(request.number)};
    }
    [[nodiscard]] uint64_t bytesToRead(Request request, bool) const override { return 1000 + request.number; }
    uint64_t keepWithin(uint64_t bytes) const override {
        limit = bytes;
        return kept = std::min(kept, bytes);
    }
    [[nodiscard]] std::string name() const override { return name_; }
    mutable uint64_t limit = 0, kept = 0;

private:
    std::string name_;
};

TEST(SceneSource, ReadsFromTheDatasetThatHoldsThePage) {
    const Datasets datasets(3, 3);
    std::vector<std::shared_ptr<NamedSource>> sources;
    std::vector<SceneSource::Part> parts;
    for (size_t i = 0; i < 3; ++i) {
        sources.push_back(std::make_shared<NamedSource>("file " + std::to_string(i)));
        parts.push_back({datasets.pooled[i].dataset, sources.back()});
    }
    const SceneSource scene(parts);
    uint64_t page = 0;
    for (size_t i = 0; i < 3; ++i)
        for (uint64_t own = 0; own < datasets[i].pages.size(); ++own, ++page) {
            EXPECT_EQ(scene.read(page, true).error().message, "file " + std::to_string(i) + " " + std::to_string(own));
            EXPECT_EQ(scene.bytesToRead(page, true), 1000 + own);
            EXPECT_EQ(scene.originOf(page).file, "file " + std::to_string(i));
            EXPECT_EQ(scene.originOf(page).request, Request(own));
            EXPECT_EQ(scene.partOf(page), i);
        }
    // What is kept stays within the limit together, and who keeps most may go on keeping it.
    EXPECT_EQ(scene.keepWithin(3000), 0u);
    for (const auto& source : sources) EXPECT_EQ(source->limit, 1000u);
    sources[1]->kept = 900;
    EXPECT_EQ(scene.keepWithin(3000), 900u);
    EXPECT_EQ(sources[1]->limit, 1600u);
    EXPECT_EQ(sources[0]->limit, 700u);
    sources[0]->kept = 700, sources[1]->kept = 1500;
    EXPECT_LE(scene.keepWithin(1100), 1100u);
    EXPECT_LE(sources[0]->limit + sources[1]->limit + sources[2]->limit, 1100u);
    EXPECT_GT(sources[1]->limit, 2 * sources[0]->limit);
}

}  // namespace
}  // namespace vcp
