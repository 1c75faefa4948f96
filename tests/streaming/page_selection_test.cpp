// The cut through the page tree, on trees made by hand.
#include "streaming/page_selection.h"
#include "octree/surface/morton.h"

#include <bit>
#include <cmath>
#include <random>
#include <set>

#include <gtest/gtest.h>

namespace vcp {
namespace {

constexpr uint64_t kPageBytes = 100;

/// A full octree of `levels` levels over the unit cube; each page errs by `error` times its edge.
Dataset fullTree(uint32_t levels, double error) {
    Dataset dataset;
    dataset.header.levels = levels;
    dataset.header.log2Cells = 5;
    dataset.header.cell = std::exp2(-5.0 - (levels - 1));
    std::vector<glm::u32vec3> places{glm::u32vec3(0)};
    for (uint32_t level = 0; level < levels; ++level) {
        std::vector<glm::u32vec3> next;
        const uint64_t firstOfNext = dataset.pages.size() + places.size();
        for (const glm::u32vec3 place : places) {
            PageEntry page;
            page.morton = mortonEncode(place);
            page.level = uint8_t(level);
            page.certifiedError = float(error * std::exp2(-double(level)));
            if (level + 1 < levels) {
                page.childMask = 255;
                page.firstChild = uint32_t(firstOfNext + next.size());
                for (uint32_t o = 0; o < 8; ++o) next.push_back(place * 2u + glm::u32vec3(o & 1, o >> 1 & 1, o >> 2));
            }
            dataset.pages.push_back(page);
        }
        places = std::move(next);
    }
    dataset.header.pages = dataset.pages.size();
    return dataset;
}

/// Looks along +x; everything in front is in view.
SelectionView viewFrom(glm::dvec3 eye, double errorPixels = 1, double pixelsPerUnit = 1000) {
    SelectionView view;
    view.eye = eye;
    view.pixelsPerUnit = pixelsPerUnit;
    view.errorPixels = errorPixels;
    view.planes = {glm::dvec4(1, 0, 0, 0), glm::dvec4(1, 0, 0, 0), glm::dvec4(1, 0, 0, 0), glm::dvec4(1, 0, 0, 0)};
    return view;
}

struct Input {
    Dataset dataset;
    std::vector<uint64_t> bytes;
    std::vector<uint8_t> resident, unavailable;
    explicit Input(Dataset d, bool allResident = true)
        : dataset(std::move(d)),
          bytes(dataset.pages.size(), kPageBytes),
          resident(dataset.pages.size(), allResident ? 1 : 0),
          unavailable(dataset.pages.size(), 0) {}
    [[nodiscard]] Selection select(const SelectionView& view, uint64_t budget = UINT64_MAX) const {
        return selectPages(dataset, view, budget, bytes, resident, unavailable);
    }
};

/// Every point of the surface is shown by exactly one page: volumes of the cut sum to the root's.
void expectCutCovers(const Input& in, const std::vector<uint64_t>& cut) {
    double volume = 0;
    for (const uint64_t page : cut) volume += std::exp2(-3.0 * in.dataset.pages[page].level);
    EXPECT_DOUBLE_EQ(volume, 1);
}

TEST(PageSelection, CoarseFromFarFineFromNear) {
    const Input in(fullTree(4, 0.01));
    EXPECT_EQ(in.select(viewFrom({-100, 0.5, 0.5})).cut, std::vector<uint64_t>{0});
    const Selection near = in.select(viewFrom({-0.5, 0.5, 0.5}, 0.5));
    expectCutCovers(in, near.cut);
    EXPECT_GT(near.cut.size(), 8u);
    EXPECT_TRUE(near.complete);
    EXPECT_FALSE(near.relaxed);
    for (const uint64_t page : near.cut)
        if (in.dataset.pages[page].childMask != 0) {
            EXPECT_LE(projectedError(in.dataset, in.dataset.pages[page], viewFrom({-0.5, 0.5, 0.5})), 0.5);
        }
}

/// The dataset is of the method Paper and has subvolumes everywhere; nothing is certified.
Dataset paperTree(uint32_t levels) {
    Dataset dataset = fullTree(levels, 0);
    dataset.header.method = Method::Paper;
    for (double& high : dataset.header.boundsMax) high = 1;
    return dataset;
}

TEST(PageSelection, PapersSubvolumesAreFineWhereTheyAreNear) {
    const Input in(paperTree(4));
    const auto distanceTo = [&](const PageEntry& page, glm::dvec3 eye) {
        const glm::dvec3 low = in.dataset.originOf(page);
        return glm::length(glm::clamp(eye, low, low + in.dataset.edgeOf(page)) - eye);
    };
    for (const double errorPixels : {0.0, 0.5, 4.0})
        for (const double part : {0.0, 0.1, 0.25, 0.5, 10.0}) {
            SelectionView view = viewFrom({-0.05, 0.3, 0.6}, errorPixels);
            view.paperReach = part;
            const Selection selection = in.select(view);
            EXPECT_TRUE(selection.complete);
            std::set<uint64_t> fine;
            for (const uint64_t page : selection.cut)
                if (in.dataset.pages[page].level == 3) fine.insert(page);
            const double reach = part * std::sqrt(3.0);
            for (uint64_t page = 0; page < in.dataset.pages.size(); ++page) {
                const PageEntry& entry = in.dataset.pages[page];
                if (entry.level < 3) continue;
                EXPECT_EQ(fine.contains(page), distanceTo(entry, view.eye) < reach) << page << " " << part;
            }
            double last = 0;
            for (const WantedPage& wanted : selection.wanted) {
                const PageEntry& entry = in.dataset.pages[wanted.page];
                if (entry.level == 3) last = std::max(last, distanceTo(entry, view.eye));
            }
            EXPECT_LT(last, std::max(reach, 1e-9));
        }
}

TEST(PageSelection, NearestOfThePapersSubvolumesGetTheBudget) {
    const Input in(paperTree(4));
    SelectionView view = viewFrom({-0.05, 0.05, 0.05});
    view.paperReach = 10;
    const Selection few = in.select(view, 40 * kPageBytes);
    EXPECT_TRUE(few.relaxed);
    EXPECT_LE(few.wanted.size(), 40u);
    uint64_t fine = 0;
    for (const uint64_t page : few.cut)
        if (in.dataset.pages[page].level == 3) {
            ++fine;
            EXPECT_LT(glm::length(in.dataset.originOf(in.dataset.pages[page])), 0.7);
        }
    EXPECT_GE(fine, 8u);
}

TEST(PageSelection, NearerPagesAreFinerOrEqual) {
    const Input in(fullTree(5, 0.01));
    const SelectionView view = viewFrom({-0.2, 0.5, 0.5}, 2);
    const Selection selection = in.select(view);
    expectCutCovers(in, selection.cut);
    std::set<int> levels;
    for (const uint64_t page : selection.cut) levels.insert(in.dataset.pages[page].level);
    EXPECT_GT(levels.size(), 1u);
}

TEST(PageSelection, BudgetIsNeverExceededAndRelaxesEvenly) {
    const Input in(fullTree(4, 0.01));
    double last = std::numeric_limits<double>::infinity();
    for (uint64_t pages = 1; pages < 600; pages += 13) {
        const Selection selection = in.select(viewFrom({-0.1, 0.3, 0.6}, 0.01), pages * kPageBytes);
        EXPECT_LE(selection.wanted.size(), pages);
        expectCutCovers(in, selection.cut);
        EXPECT_LE(selection.errorPixels, last) << "more budget, more error";
        last = selection.errorPixels;
        EXPECT_EQ(selection.relaxed, pages < in.dataset.pages.size());
    }
}

/// The full tree, of pages that cover those below them and may be drawn octant by octant.
Dataset coveringTree(uint32_t levels, double error) {
    Dataset dataset = fullTree(levels, error);
    dataset.header.flags |= kFlagCovering;
    for (uint64_t i = 0; i < dataset.pages.size(); ++i) dataset.pages[i].leaves = 64;
    return dataset;
}

TEST(PageSelection, OnlyOctantsThatErrTooMuchAreRefined) {
    const Input in(coveringTree(2, 0.01));
    // The root errs by 10 / distance pixels: its lower octants along x are nearer than 12, its upper ones are not.
    const SelectionView view = viewFrom({-11.8, 0.5, 0.5}, 10 / 12.0);
    const Selection selection = in.select(view);
    ASSERT_EQ(selection.partial.size(), 1u);
    EXPECT_EQ(selection.partial[0], (PartialPage{0, 0b10101010}));
    EXPECT_EQ(selection.wanted.size(), 5u);
    EXPECT_EQ(selection.cut.size(), 5u);
    EXPECT_TRUE(selection.complete);
    // What is left of the root is 12.3 away.
    EXPECT_NEAR(selection.errorPixels, 10 / 12.3, 1e-6);
    EXPECT_EQ(in.select(viewFrom({-12.1, 0.5, 0.5}, 10 / 12.0)).cut, std::vector<uint64_t>{0});
    EXPECT_EQ(in.select(viewFrom({-11.4, 0.5, 0.5}, 10 / 12.0)).cut.size(), 8u);
}

TEST(PageSelection, WhatOctantsShowIsAsGoodAsAsked) {
    const Input in(coveringTree(5, 0.01));
    for (const glm::dvec3 eye : {glm::dvec3(-1.2, 0.3, 0.6), glm::dvec3(-2, 1.5, 0.1), glm::dvec3(-7, -1, 2)}) {
        const SelectionView view = viewFrom(eye, 0.7);
        const Selection selection = in.select(view);
        EXPECT_TRUE(selection.complete);
        EXPECT_LE(selection.errorPixels, 0.7);
        // With whole pages more is read.
        EXPECT_LE(selection.wanted.size(), Input(fullTree(5, 0.01)).select(view).wanted.size());
    }
}

/// The full tree, whose slabs' colours are off by so much (a code of colourErrorOf), but those of the finest pages.
Dataset colouredTree(uint32_t levels, double error, uint8_t code) {
    Dataset dataset = fullTree(levels, error);
    for (uint64_t i = 0; i < dataset.pages.size(); ++i) {
        PageEntry& page = dataset.pages[i];
        if (page.childMask != 0) page.colourErrorP95 = code, page.colourErrorMax = code;
    }
    return dataset;
}

SelectionView colouredView(glm::dvec3 eye, double colourError, double errorPixels = 1) {
    SelectionView view = viewFrom(eye, errorPixels);
    view.colourError = colourError;
    return view;
}

TEST(PageSelection, ColoursThatAreOffAreRefinedUntilTheirSlabsAreSmall) {
    const uint8_t code = colourErrorCode(5);
    const Input in(colouredTree(5, 1e-6, code));
    const SelectionView view = colouredView({-12, 0.5, 0.5}, 2);
    const Selection selection = in.select(view);
    expectCutCovers(in, selection.cut);
    std::set<int> levels;
    for (const uint64_t page : selection.cut) {
        const PageEntry& entry = in.dataset.pages[page];
        levels.insert(entry.level);
        const double distance = 12 + in.dataset.originOf(entry).x;  // at least
        const double slab = in.dataset.cellOf(entry.level) * view.pixelsPerUnit / distance;
        EXPECT_TRUE(entry.childMask == 0 || slab < view.errorPixels * 1.1) << slab;
        EXPECT_GT(slab, view.errorPixels / 2.2) << "finer than needed";
    }
    EXPECT_EQ(levels.count(0), 0u);
    EXPECT_GT(selection.colourPixels, selection.errorPixels);
    EXPECT_LE(selection.colourPixels, view.errorPixels);
    EXPECT_LT(selection.errorPixels, 0.01);
}

TEST(PageSelection, ColoursThatAreNearEnoughRefineNothing) {
    const Input coloured(colouredTree(5, 0.01, colourErrorCode(5))), plain(fullTree(5, 0.01));
    for (const glm::dvec3 eye : {glm::dvec3(-12, 0.5, 0.5), glm::dvec3(-0.5, 0.2, 0.7), glm::dvec3(0.5)}) {
        const Selection wanted = plain.select(viewFrom(eye));
        for (const double allowed : {5.2, 100.0, std::numeric_limits<double>::infinity()}) {
            const Selection selection = coloured.select(colouredView(eye, allowed));
            EXPECT_EQ(selection.cut, wanted.cut);
            EXPECT_EQ(selection.errorPixels, wanted.errorPixels);
            EXPECT_EQ(selection.colourPixels, 0);
        }
        EXPECT_EQ(plain.select(colouredView(eye, 0)).cut, wanted.cut) << "nothing is known of colours";
    }
}

TEST(PageSelection, ABudgetRelaxesColoursEvenly) {
    const Input in(colouredTree(4, 1e-6, 255));
    double last = std::numeric_limits<double>::infinity();
    for (uint64_t pages = 1; pages < 600; pages += 13) {
        const Selection selection = in.select(colouredView({-2, 0.3, 0.6}, 2, 0.01), pages * kPageBytes);
        EXPECT_LE(selection.wanted.size(), pages);
        expectCutCovers(in, selection.cut);
        EXPECT_LE(selection.colourPixels, last) << "more budget, more error";
        last = selection.colourPixels;
        EXPECT_EQ(selection.relaxed, pages < in.dataset.pages.size());
    }
    EXPECT_EQ(last, 0);
}

TEST(PageSelection, NothingFitsAnEmptyBudget) {
    const Input in(fullTree(2, 0.01));
    const Selection selection = in.select(viewFrom({-1, 0, 0}), kPageBytes - 1);
    EXPECT_TRUE(selection.cut.empty());
    EXPECT_TRUE(selection.wanted.empty());
    EXPECT_TRUE(std::isinf(selection.errorPixels));
}

TEST(PageSelection, ParentsAreWantedBeforeChildren) {
    const Input in(fullTree(4, 0.01), false);
    const Selection selection = in.select(viewFrom({-0.1, 0.4, 0.5}, 0.1));
    EXPECT_TRUE(selection.cut.empty());
    EXPECT_FALSE(selection.complete);
    std::set<uint64_t> seen;
    double last = std::numeric_limits<double>::infinity();
    for (const WantedPage& wanted : selection.wanted) {
        if (wanted.page != 0) {
            uint64_t parent = 0;
            while (wanted.page < in.dataset.pages[parent].firstChild ||
                   wanted.page >= in.dataset.pages[parent].firstChild + 8u)
                ++parent;
            EXPECT_TRUE(seen.contains(parent));
        }
        EXPECT_TRUE(seen.insert(wanted.page).second) << "wanted twice";
        EXPECT_GE(last, 0);
        last = wanted.priority;
    }
}

TEST(PageSelection, AnyResidencyGivesACutThatCovers) {
    for (uint64_t seed = 0; seed < 200; ++seed) {
        Input in(fullTree(4, 0.01));
        std::mt19937_64 random(seed);
        for (size_t i = 1; i < in.resident.size(); ++i) in.resident[i] = random() % 8 != 0;
        const Selection selection = in.select(viewFrom({-0.1, 0.4, 0.5}, 0.1));
        SCOPED_TRACE(seed);
        expectCutCovers(in, selection.cut);
        for (const uint64_t page : selection.cut) EXPECT_NE(in.resident[page], 0);
    }
}

TEST(PageSelection, AnUnavailablePageIsDrawnFromItsParent) {
    Input in(fullTree(3, 0.01));
    in.unavailable[9] = 1;  // a child of page 1
    in.resident[9] = 0;
    const Selection selection = in.select(viewFrom({-0.1, 0.4, 0.5}, 0.001));
    EXPECT_TRUE(selection.complete) << "it must settle";
    EXPECT_NE(std::find(selection.cut.begin(), selection.cut.end(), 1u), selection.cut.end());
    expectCutCovers(in, selection.cut);
}

TEST(PageSelection, OutOfViewIsNotRefined) {
    const Input in(fullTree(3, 0.01));
    SelectionView view = viewFrom({0.5, 0.5, 0.5}, 0.001);
    view.planes[0] = glm::dvec4(1, 0, 0, -0.01);  // only x > 0.51
    const Selection selection = in.select(view);
    for (const uint64_t page : selection.cut) {
        const PageEntry& entry = in.dataset.pages[page];
        const double highest = in.dataset.originOf(entry).x + in.dataset.edgeOf(entry);
        EXPECT_EQ(entry.level, highest <= 0.5 ? 1 : 2) << page;
    }
}

TEST(PageSelection, FrustumNeverLosesAPointInView) {
    const Input in(fullTree(3, 0.01));
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> unit(0, 1), wide(-3, 3);
    for (int i = 0; i < 20000; ++i) {
        SelectionView view = viewFrom({wide(random), wide(random), wide(random)});
        for (glm::dvec4& plane : view.planes)
            plane = {wide(random), wide(random), wide(random), i % 2 != 0 ? 0 : wide(random)};
        const PageEntry& entry = in.dataset.pages[random() % in.dataset.pages.size()];
        const glm::dvec3 p = in.dataset.originOf(entry) +
                             in.dataset.edgeOf(entry) * glm::dvec3(unit(random), unit(random), unit(random)) - view.eye;
        bool inside = true;
        for (const glm::dvec4& plane : view.planes)
            inside = inside && plane.x * p.x + plane.y * p.y + plane.z * p.z + plane.w >= 0;
        if (inside) {
            EXPECT_TRUE(inFrustum(in.dataset, entry, view)) << i;
        }
    }
}

TEST(PageSelection, ProjectedErrorOfKnownCases) {
    const Input in(fullTree(1, 0.01));
    const PageEntry& root = in.dataset.pages[0];
    EXPECT_NEAR(projectedError(in.dataset, root, viewFrom({-2, 0.5, 0.5})), 0.01 * 1000 / 2, 1e-5);
    EXPECT_TRUE(std::isinf(projectedError(in.dataset, root, viewFrom({0.5, 0.5, 0.5}))));
    SelectionView flat = viewFrom({-2, 0.5, 0.5});
    flat.orthographic = true;
    EXPECT_NEAR(projectedError(in.dataset, root, flat), 10, 1e-5);
}

}  // namespace
}  // namespace vcp
