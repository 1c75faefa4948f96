// What rays hit decides what is read: on random trees with rays that are no more than what they hit, whatever the order
// of arrival, the history and the budget, every view settles on the same pages, and on the picture of all pages.
#include "streaming/pages_seen.h"

#include <algorithm>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "streaming/residency_policy.h"
#include "tests/support/test_trees.h"

namespace vcp {
namespace {

/// Mixes three numbers (SplitMix64).
uint64_t mixed(uint64_t a, uint64_t b, uint64_t c) {
    uint64_t x = a * 0x9e3779b97f4a7c15 + b * 0xd1342543de82ef95 + c;
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9;
    x = (x ^ x >> 27) * 0x94d049bb133111eb;
    return x ^ x >> 31;
}

/// Where a ray ends: the page that it hits, and the one that would be there.
struct RayEnd {
    uint64_t page = 0, asked = 0;
    bool operator==(const RayEnd&) const = default;
};

/// A tree whose pages cover those below them, and rays: of each page, and of each octant of a page, a ray hits the
/// surface or not, by a hash; what it misses, it misses in all that is below.
class World {
public:
    explicit World(uint64_t seed, uint32_t levels = 5, uint32_t rays = 40) : seed_(seed), rays_(rays) {
        Dataset made = test::randomTree(seed, levels, 0.7, 4 * 16384);
        made.header.flags |= kFlagCovering;
        // Some pages are a single leaf: they are replaced as a whole.
        for (uint64_t page = 0; page < made.pages.size(); ++page)
            made.pages[page].leaves = mixed(seed, page, 7) % 6 == 0 ? 1 : 9;
        dataset = std::make_shared<const Dataset>(std::move(made));
    }

    /// All is in view; most levels are too coarse, and the lower ones by so little that rays are asked.
    [[nodiscard]] SelectionView view(double errorPixels = 0.12, glm::dvec3 eye = {-2, 0.4, 0.3}) const {
        SelectionView view;
        view.eye = eye;
        view.pixelsPerUnit = 300;
        view.errorPixels = errorPixels;
        for (glm::dvec4& plane : view.planes) plane = {0, 0, 0, 1};
        return view;
    }

    /// What each ray of a view ends at; nothing where it hits nothing.
    [[nodiscard]] std::vector<std::optional<RayEnd>> castAll(const SelectionView& view,
                                                             const DrawableCut& drawn) const {
        std::vector<std::optional<RayEnd>> ends;
        const Drawn pages(drawn);
        const auto number = uint64_t(view.eye.y * 1000);
        for (uint32_t ray = 0; ray < rays_; ++ray)
            ends.push_back(drawn.cut.empty() ? std::nullopt : cast(mixed(seed_, number, ray), 0, pages));
        return ends;
    }

    [[nodiscard]] PagesHit hits(const SelectionView& view, const DrawableCut& drawn) const {
        PagesHit hit;
        for (const auto& end : castAll(view, drawn)) {
            if (!end) continue;
            hit.byCamera.push_back(end->page);
            hit.byCamera.push_back(end->asked);
        }
        return hit;
    }

    [[nodiscard]] std::vector<uint64_t> units() const {
        std::vector<uint64_t> units;
        for (const PageEntry& page : dataset->pages) units.push_back(pageUnits(page, dataset->hasColour()));
        return units;
    }

    std::shared_ptr<const Dataset> dataset;

private:
    struct Drawn {
        explicit Drawn(const DrawableCut& drawn) : whole(drawn.cut.begin(), drawn.cut.end()) {
            for (const PartialPage& partial : drawn.partial) {
                whole.erase(partial.page);
                octants[partial.page] = partial.octants;
            }
        }
        std::set<uint64_t> whole;
        std::map<uint64_t, uint8_t> octants;
    };

    [[nodiscard]] std::optional<RayEnd> cast(uint64_t ray, uint64_t page, const Drawn& drawn) const {
        if (mixed(ray, page, 0) % 8 == 0) return std::nullopt;  // the page is missed
        if (drawn.whole.contains(page)) return RayEnd{page, page};
        const PageEntry& entry = dataset->pages[page];
        const auto own = drawn.octants.find(page);
        for (uint32_t k = 0; k < 8; ++k) {
            const auto octant = uint32_t(k ^ (ray & 7));
            if ((entry.childMask >> octant & 1) == 0) continue;
            const uint64_t child = childIn(entry, octant);
            if (mixed(ray, child, 1) % 3 != 0) continue;  // the page is missed in this octant
            if (own != drawn.octants.end() && (own->second >> octant & 1) != 0) return RayEnd{page, child};
            if (const auto end = cast(ray, child, drawn)) return end;
        }
        return std::nullopt;
    }

    uint64_t seed_;
    uint32_t rays_;
};

/// The least pages that are enough, found by refining from the coarsest page on.
std::set<uint64_t> leastPages(const World& world, const SelectionView& view) {
    const std::vector<uint64_t> units = world.units();
    const std::vector<uint8_t> states(units.size(), kAvailable);
    PagesSeen seen;
    const PagesSeen* const known[] = {&seen};
    for (;;) {
        const PageChoice choice = choosePages(*world.dataset, {&view, 1}, UINT64_MAX, units, states, known);
        std::vector<uint8_t> resident(units.size(), 0);
        std::set<uint64_t> pages;
        for (const WantedPage& wanted : choice.wanted) {
            resident[wanted.page] = 1;
            pages.insert(wanted.page);
        }
        const DrawableCut drawn = drawableCut(*world.dataset, view, choice, resident, &seen);
        if (!seen.add(*world.dataset, world.hits(view, drawn).byCamera)) return pages;
    }
}

/// What rays end at where all that is in view is there.
std::vector<std::optional<RayEnd>> picture(const World& world, const SelectionView& view) {
    const std::vector<uint8_t> all(world.dataset->pages.size(), 1), states(all.size(), kAvailable);
    return world.castAll(view, selectPages(*world.dataset, view, UINT64_MAX, world.units(), all, states));
}

/// The policy with reads that end in any order, and frames that are drawn now and then.
class WorldFlight {
public:
    WorldFlight(const World& world, uint64_t budgetBytes, uint64_t seed, bool hiddenToo = false)
        : world_(world),
          random_(seed),
          pooled_{world.dataset, world.dataset->hasColour()},
          policy({&pooled_, 1}, poolShapeFor({&pooled_, 1}, budgetBytes, test::kChunkBytes), LoadOrder::Feedback,
                 hiddenToo) {}

    /// One round; true when the view has settled.
    bool round(const SelectionView& view, uint64_t most) {
        policy.look(test::only(view), now_ += 0.02);
        for (uint64_t i = 0; i < most && !wishes_.empty(); ++i) {
            std::swap(wishes_[random_() % wishes_.size()], wishes_.back());
            policy.place(wishes_.back().request.number);
            wishes_.pop_back();
        }
        outcome = policy.finish();
        wishes_ = outcome.wishes;
        const auto cut = std::pair(outcome.cuts[0].cut, outcome.cuts[0].partial);
        const bool wasHeard = outcome.cuts[0].complete && heard_ == cut && heardOf_ == view;
        if (outcome.cuts[0].complete || random_() % 3 == 0) {
            ++frames;
            policy.see(world_.hits(view, outcome.cuts[0]), view);
            heard_ = cut;
            heardOf_ = view;
        }
        return outcome.cuts[0].complete && (outcome.cuts[0].pagesUnseen == 0 || wasHeard);
    }

    void settle(const SelectionView& view) {
        const uint64_t reloads = policy.counts().reloads;
        for (int i = 0; !round(view, 1 + random_() % 7); ++i) ASSERT_LT(i, 5000) << "does not settle";
        EXPECT_EQ(policy.counts().reloads, reloads) << "a still view loaded a page twice";
    }

    [[nodiscard]] std::set<uint64_t> resident() const {
        std::set<uint64_t> pages;
        for (const uint64_t page : policy.residentPages(0)) pages.insert(page);
        return pages;
    }

private:
    const World& world_;
    std::mt19937_64 random_;
    PooledDataset pooled_;

public:
    ResidencyPolicy policy;
    PolicyOutcome outcome;
    uint64_t frames = 0;

private:
    std::vector<Wish> wishes_;
    std::pair<std::vector<uint64_t>, std::vector<PartialPage>> heard_;
    SelectionView heardOf_;
    double now_ = 0;
};

constexpr uint64_t kEnough = UINT64_MAX >> 1;

TEST(PagesSeen, AnyOrderComesToTheLeastPagesThatAreEnough) {
    uint64_t read = 0, inView = 0;
    for (uint64_t seed = 0; seed < 30; ++seed) {
        SCOPED_TRACE(seed);
        const World world(seed);
        const SelectionView view = world.view();
        const std::set<uint64_t> least = leastPages(world, view);
        for (uint64_t order = 0; order < 4; ++order) {
            WorldFlight run(world, kEnough, 10 * seed + order);
            run.settle(view);
            EXPECT_EQ(run.resident(), least);
            EXPECT_EQ(world.castAll(view, run.outcome.cuts[0]), picture(world, view));
        }
        WorldFlight all(world, kEnough, seed, true);
        all.settle(view);
        read += least.size();
        inView += all.resident().size();
    }
    EXPECT_LT(read, inView / 2) << "much of what is in view is hidden";
}

TEST(PagesSeen, APictureDoesNotDependOnWhatCameBefore) {
    for (uint64_t seed = 0; seed < 30; ++seed) {
        SCOPED_TRACE(seed);
        const World world(seed);
        const SelectionView view = world.view();
        WorldFlight wild(world, kEnough, seed);
        for (int i = 0; i < 30; ++i)
            wild.round(world.view(0.05 + 0.1 * (i % 4), {-2, 0.01 * i, 0.3}), 1 + uint64_t(i) % 9);
        wild.settle(view);
        EXPECT_EQ(world.castAll(view, wild.outcome.cuts[0]), picture(world, view));
    }
}

TEST(PagesSeen, NorDoesItWhereTheBudgetIsTooSmall) {
    int hitFits = 0, relaxed = 0;
    for (uint64_t seed = 0; seed < 40; ++seed) {
        const World world(seed);
        const SelectionView view = world.view();
        const std::vector<uint64_t> units = world.units();
        uint64_t least = 0;
        for (const uint64_t page : leastPages(world, view)) least += units[page];
        for (const uint64_t part : {4, 8, 11, 15}) {
            SCOPED_TRACE(std::to_string(seed) + ", " + std::to_string(part));
            const uint64_t budget = least * kPoolUnitBytes * part / 10;
            WorldFlight plain(world, budget, 1);
            if (!plain.policy.hasRoom()) continue;
            plain.settle(view);
            const auto expected = world.castAll(view, plain.outcome.cuts[0]);
            if (!plain.outcome.cuts[0].isRelaxed) {
                ++hitFits;
                EXPECT_EQ(expected, picture(world, view));
            }
            relaxed += plain.outcome.cuts[0].isRelaxed ? 1 : 0;
            for (uint64_t history = 0; history < 3; ++history) {
                WorldFlight wild(world, budget, seed + 100 * history);
                for (int i = 0; i < 20; ++i) wild.round(world.view(0.1, {-2, 0.01 * i, 0.3}), 5);
                wild.settle(view);
                EXPECT_EQ(world.castAll(view, wild.outcome.cuts[0]), expected);
                EXPECT_EQ(wild.outcome.cuts[0].isRelaxed, plain.outcome.cuts[0].isRelaxed);
            }
        }
    }
    EXPECT_GT(hitFits, 10);
    EXPECT_GT(relaxed, 10);
}

TEST(PagesSeen, NobodyIsAskedWhereAllTakesFewBytes) {
    for (uint64_t seed = 0; seed < 10; ++seed) {
        SCOPED_TRACE(seed);
        const World world(seed);
        SelectionView view = world.view();
        WorldFlight all(world, kEnough, seed, true);
        all.settle(view);
        const double bytes = double(all.policy.unitsTaken() * kPoolUnitBytes);
        for (const bool areFew : {true, false}) {
            view.pixels = bytes / kFewBytesAPixel * (areFew ? 1.01 : 0.99);
            WorldFlight flight(world, kEnough, seed);
            flight.settle(view);
            EXPECT_EQ(flight.resident() == all.resident(), areFew);
        }
    }
}

TEST(PagesSeen, RaysOfLightCountOnceTheCamerasAreFinal) {
    const World world(3);
    const SelectionView view = world.view();
    WorldFlight run(world, kEnough, 1);
    run.settle(view);
    const std::set<uint64_t> before = run.resident();
    uint64_t hidden = 0;
    while (before.contains(hidden) || !before.contains(0)) ++hidden;
    const auto see = [&](uint64_t byCamera) {
        run.policy.see({{byCamera}, {hidden}}, view);
        for (int i = 0; i < 200; ++i) run.round(view, 9);
        return run.resident();
    };
    uint64_t asked = hidden + 1;
    while (before.contains(asked)) ++asked;
    EXPECT_FALSE(see(asked).contains(hidden)) << "a ray of the camera asks for a page that is not there";
    EXPECT_TRUE(see(0).contains(hidden));
}

TEST(PagesSeen, AShakingViewLoadsHardlyMore) {
    uint64_t still = 0, shaking = 0;
    for (uint64_t seed = 0; seed < 8; ++seed) {
        const World world(seed);
        const SelectionView views[] = {world.view(0.12, {-2, 0.4, 0.3}), world.view(0.12, {-2, 0.401, 0.3})};
        WorldFlight run(world, kEnough, seed);
        run.settle(views[0]);
        run.settle(views[1]);
        still += run.policy.counts().loads;
        for (int i = 0; i < 400; ++i) run.round(views[i % 2], 9);
        shaking += run.policy.counts().loads;
        EXPECT_EQ(run.policy.counts().evictions, 0u);
    }
    EXPECT_LE(shaking, still + still / 10);
}

TEST(PagesSeen, AFrameOfAnotherViewIsAGuessUntilOneIsHeard) {
    const World world(5);
    const Dataset& dataset = *world.dataset;
    const uint64_t page = dataset.pages.size() - 1;
    PagesSeen seen;
    seen.guess(dataset, {page});
    EXPECT_TRUE(seen.contains(page));
    EXPECT_TRUE(seen.contains(0)) << "and all above it";
    EXPECT_TRUE(seen.add(dataset, {0}));
    EXPECT_FALSE(seen.contains(page));
    seen.guess(dataset, {page});
    EXPECT_FALSE(seen.contains(page)) << "a frame of the view was heard";
    EXPECT_TRUE(seen.add(dataset, {page}));
    EXPECT_FALSE(seen.add(dataset, {0}));
    EXPECT_TRUE(seen.contains(page)) << "it only grows";
    seen.begin();
    EXPECT_TRUE(seen.contains(page));
    seen.begin();
    EXPECT_TRUE(seen.contains(page)) << "no frame of the view in between was heard";
    seen.guess(dataset, {0});
    EXPECT_FALSE(seen.contains(page));
}

}  // namespace
}  // namespace vcp
