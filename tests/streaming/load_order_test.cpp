// Which missing pages are read first.
#include "streaming/load_order.h"

#include <bit>
#include <cmath>
#include <map>

#include <gtest/gtest.h>

#include "tests/support/test_trees.h"

namespace vcp {
namespace {

struct Fixture {
    std::shared_ptr<const Dataset> dataset;
    std::vector<uint64_t> units, parents;
    SelectionView view;

    explicit Fixture(Dataset made)
        : dataset(std::make_shared<const Dataset>(std::move(made))),
          units(dataset->pages.size(), 2),
          parents(dataset->pages.size(), 0) {
        for (uint64_t page = 0; page < parents.size(); ++page)
            for (uint32_t i = 0; i < uint32_t(std::popcount(dataset->pages[page].childMask)); ++i)
                parents[dataset->pages[page].firstChild + i] = page;
        view.eye = {0.5, 0.5, -1};
        view.pixelsPerUnit = 1000;
        view.errorPixels = 0.5;
        for (glm::dvec4& plane : view.planes) plane = {0, 0, 0, 1};
    }
    [[nodiscard]] LoadPriorities priorities(LoadOrder order) const { return {dataset, units, order}; }
    /// What the view wants, from a level on.
    [[nodiscard]] std::vector<WantedPage> missing(uint32_t level) const {
        const std::vector<uint8_t> none(units.size(), 0);
        auto wanted = choosePages(*dataset, {&view, 1}, UINT64_MAX, units, none).wanted;
        std::erase_if(wanted, [&](const WantedPage& w) { return dataset->pages[w.page].level < level; });
        return wanted;
    }
    /// The lattice point in the middle of a page.
    [[nodiscard]] glm::ivec3 middleOf(uint64_t page) const {
        const glm::dvec3 at = dataset->originOf(dataset->pages[page]) + dataset->edgeOf(dataset->pages[page]) / 2;
        return glm::ivec3(at * std::ldexp(1.0, 30));
    }
};

std::map<uint64_t, double> byPage(const std::vector<WantedPage>& pages) {
    std::map<uint64_t, double> map;
    for (const WantedPage& wanted : pages) map[wanted.page] = wanted.priority;
    return map;
}

TEST(LoadOrder, NamesGoBothWays) {
    for (const LoadOrder order :
         {LoadOrder::Feedback, LoadOrder::Error, LoadOrder::Nearest, LoadOrder::Breadth, LoadOrder::Random})
        EXPECT_EQ(loadOrderNamed(nameOf(order)), order);
    EXPECT_FALSE(loadOrderNamed("newest"));
}

TEST(LoadOrder, EveryOrderHasAllPagesAndParentsFirst) {
    for (uint64_t seed = 0; seed < 20; ++seed) {
        SCOPED_TRACE(seed);
        Fixture f(test::randomTree(seed, 4, 0.7, 16384));
        std::mt19937_64 random(seed);
        f.view = test::randomView(random, 0.5);
        const auto missing = f.missing(1);
        for (const LoadOrder order :
             {LoadOrder::Feedback, LoadOrder::Error, LoadOrder::Nearest, LoadOrder::Breadth, LoadOrder::Random}) {
            SCOPED_TRACE(nameOf(order));
            LoadPriorities priorities = f.priorities(order);
            RayFeedback feedback;
            for (int i = 0; i < 50; ++i) {
                const uint64_t page = random() % f.units.size();
                feedback.hits.push_back({page, f.middleOf(page)});
                feedback.passed.push_back({random() % f.units.size(), 1});
            }
            priorities.hear(feedback, f.view);
            const auto ordered = priorities.ordered(missing, {&f.view, 1});
            const auto given = byPage(ordered);
            ASSERT_EQ(given.size(), missing.size());
            std::map<uint64_t, size_t> place;
            for (size_t i = 0; i < ordered.size(); ++i) place[ordered[i].page] = i;
            // Errors need not fall from parent to child: the list itself is the order then.
            const auto moreUrgent = [](const auto& a, const auto& b) { return a.priority > b.priority; };
            EXPECT_TRUE(order == LoadOrder::Error || std::is_sorted(ordered.begin(), ordered.end(), moreUrgent));
            for (const auto& [page, priority] : given) {
                if (order != LoadOrder::Error) {
                    EXPECT_GE(priority, 1e-3);
                    EXPECT_LE(priority, 1e6);
                }
                const auto parent = place.find(f.parents[page]);
                if (parent != place.end()) {
                    EXPECT_LT(parent->second, place[page]);
                }
                // Brothers have the same priority.
                for (const auto& [other, otherPriority] : given)
                    if (f.parents[other] == f.parents[page]) {
                        EXPECT_EQ(otherPriority, priority);
                    }
            }
        }
    }
}

TEST(LoadOrder, ARayGainsWhatRefinementTakesOffItsError) {
    Dataset tree = test::randomTree(2, 3, 1, 16384);
    for (size_t i = 0; i < tree.pages.size(); ++i)
        tree.pages[i].certifiedError = float(0.016 * std::pow(0.25, tree.pages[i].level));
    Fixture f(std::move(tree));
    LoadPriorities priorities = f.priorities(LoadOrder::Feedback);
    const uint64_t finest = f.units.size() - 1, above = f.parents[finest];
    const glm::ivec3 place = f.middleOf(finest);
    const double distance = glm::length(glm::dvec3(place) * std::ldexp(1.0, -30) - f.view.eye);
    const auto pixels = [&](uint64_t page) {
        return double(f.dataset->pages[page].certifiedError) * f.view.pixelsPerUnit / distance;
    };
    ASSERT_GT(pixels(above), f.view.errorPixels);
    priorities.hear({.hits = {{0, place}}, .passed = {}}, f.view);
    EXPECT_NEAR(priorities.gainOf(0), pixels(0) - pixels(above), 1e-9);
    EXPECT_NEAR(priorities.gainOf(above), pixels(above) - pixels(finest), 1e-9);
    EXPECT_EQ(priorities.gainOf(finest), 0) << "nothing finer exists";
    // What is fine enough at its distance asks for nothing.
    f.view.errorPixels = pixels(above) * 1.01;
    LoadPriorities content = f.priorities(LoadOrder::Feedback);
    content.hear({.hits = {{0, place}}, .passed = {}}, f.view);
    EXPECT_GT(content.gainOf(0), 0);
    EXPECT_EQ(content.gainOf(above), 0);
}

TEST(LoadOrder, RequestsThenCountersThenTheRest) {
    Fixture f(test::randomTree(2, 3, 1, 16384));
    LoadPriorities priorities = f.priorities(LoadOrder::Feedback);
    const uint64_t hit = 3, passedOften = 5, passed = 7, untouched = 8;
    priorities.hear({.hits = {{hit, f.middleOf(hit)}}, .passed = {{passed, 1}, {passedOften, 9}, {hit, 0.1}}}, f.view);
    const auto first = [&](uint64_t page) {
        return byPage(priorities.ordered(f.missing(2), {&f.view, 1})).at(f.dataset->pages[page].firstChild);
    };
    EXPECT_GT(first(hit), first(passedOften));
    EXPECT_GT(first(passedOften), first(passed));
    EXPECT_GT(first(passed), first(untouched));
    // The more rays ask, the sooner; for more bytes, the later.
    priorities.hear({.hits = {{passed, f.middleOf(passed)}, {passed, f.middleOf(passed)}, {passed, f.middleOf(passed)}},
                     .passed = {}},
                    f.view);
    EXPECT_GT(first(passed), first(hit));
    for (uint32_t i = 0; i < 8; ++i) f.units[f.dataset->pages[passed].firstChild + i] = 200;
    LoadPriorities dear = f.priorities(LoadOrder::Feedback);
    dear.hear({.hits = {{hit, f.middleOf(hit)}, {passed, f.middleOf(passed)}}, .passed = {}}, f.view);
    const auto given = byPage(dear.ordered(f.missing(2), {&f.view, 1}));
    EXPECT_GT(given.at(f.dataset->pages[hit].firstChild), given.at(f.dataset->pages[passed].firstChild));
}

TEST(LoadOrder, WhatNoRayAsksForAnyMoreIsForgotten) {
    Fixture f(test::randomTree(2, 3, 1, 16384));
    LoadPriorities priorities = f.priorities(LoadOrder::Feedback);
    priorities.hear({.hits = {{3, f.middleOf(3)}}, .passed = {}}, f.view);
    double last = priorities.gainOf(3);
    ASSERT_GT(last, 0);
    for (int i = 0; i < 100; ++i) {
        priorities.hear({}, f.view);
        EXPECT_LE(priorities.gainOf(3), last);
        last = priorities.gainOf(3);
    }
    EXPECT_EQ(last, 0);
}

}  // namespace
}  // namespace vcp
