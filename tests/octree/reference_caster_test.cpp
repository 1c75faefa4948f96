// The reference ray-caster on pages made from formulas, where the right answer is known.
#include "octree/reference_caster.h"

#include <cstring>
#include <random>

#include <gtest/gtest.h>

#include "tests/support/analytic_page.h"

namespace vcp {
namespace {

using test::analyticDataset;
using test::AnalyticOptions;

PageCache cacheOf(const test::SignedDistanceField& field, const AnalyticOptions& options) {
    auto made = analyticDataset(field, options);
    auto cache = PageCache::fromPages(std::move(made.dataset), std::move(made.pages));
    EXPECT_TRUE(cache.ok()) << cache.error().line();
    return std::move(*cache);
}

ReferenceCaster casterOf(const PageCache& cache, uint32_t level, CastOptions options = {}) {
    const auto cut = cutAtLevel(cache.dataset(), level);
    auto caster = ReferenceCaster::create(cache, cut, options);
    EXPECT_TRUE(caster.ok()) << caster.error().line();
    return *caster;
}

glm::dvec3 randomDirection(std::mt19937_64& random) {
    std::normal_distribution<double> normal;
    return glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
}

/// Rays from around the sphere at points inside it: every one must hit, near the right distance.
void castAtSphere(const PageCache& cache, const ReferenceCaster& caster, glm::dvec3 centre, double radius,
                  double tolerance, int rays, uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int i = 0; i < rays; ++i) {
        const glm::dvec3 from = centre + randomDirection(random) * radius * (1.5 + 3 * unit(random));
        const glm::dvec3 at = centre + randomDirection(random) * radius * 0.9 * unit(random);
        const glm::dvec3 direction = glm::normalize(at - from);
        const auto hit = caster.cast({from, direction});
        ASSERT_TRUE(hit) << "ray " << i << " of seed " << seed << " slips through";
        EXPECT_NEAR(glm::distance(hit->position, centre), radius, tolerance) << "ray " << i << " of seed " << seed;
        EXPECT_GT(glm::dot(hit->normal, (hit->position - centre) / radius), 0.98) << "ray " << i;
        EXPECT_LE(glm::dot(hit->normal, direction), 0);
        EXPECT_NE(cache.view(hit->page), nullptr);
    }
}

TEST(ReferenceCaster, SphereOnEveryAxisAndLevel) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
        AnalyticOptions o;
        o.origin = {-40, -40, -40};
        o.finestCell = 1.25;
        o.levels = 3;
        o.axis = axis;
        const glm::dvec3 centre{0.3, -0.2, 0.1};
        const PageCache cache = cacheOf(test::sphere(centre, 27), o);
        for (uint32_t level = 0; level < 3; ++level) {
            SCOPED_TRACE(testing::Message() << "axis " << axis << " level " << level);
            const double cell = o.finestCell * std::exp2(2.0 - level);
            castAtSphere(cache, casterOf(cache, level), centre, 27, 0.02 * cell, 4000, 17 * axis + level);
        }
    }
}

TEST(ReferenceCaster, SlabsAreHitWithinTheirThickness) {
    AnalyticOptions o;
    o.levels = o.slabLevels = 3;
    const glm::dvec3 centre(32.1, 31.8, 32.3);
    const double radius = 25.3;
    const PageCache cache = cacheOf(test::sphere(centre, radius), o);
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> unit(0, 1);
    for (uint32_t level = 0; level < 3; ++level)
        for (const bool single : {false, true}) {
            const ReferenceCaster caster = casterOf(cache, level, {.singlePrecision = single});
            CastCounters counters;
            for (int i = 0; i < 4000; ++i) {
                // All rays that meet the sphere, grazing ones too, and some that pass by.
                const glm::dvec3 from = centre + randomDirection(random) * radius * (1.5 + 3 * unit(random));
                const glm::dvec3 towards = glm::normalize(centre - from),
                                 side = glm::normalize(glm::cross(towards, randomDirection(random)));
                const double off = radius * 1.1 * std::sqrt(unit(random));
                const glm::dvec3 direction = glm::normalize(centre + off * side - from);
                const double nearest = glm::length(glm::cross(direction, centre - from));
                const auto hit = caster.cast({from, direction}, &counters);
                if (nearest < radius) {
                    ASSERT_TRUE(hit) << "ray " << i << " slips through on level " << level;
                }
                if (!hit) continue;
                ASSERT_EQ(nodeType(hit->node), kNodeSlab);
                const PageView& view = *cache.view(hit->page);
                const uint32_t code = vectorWord(view.faces, slabVector(hit->node));
                const double cell = cache.dataset().cellOf(level),
                             thick = f64::slabHalfThickness(code) * hit->leafEdge * cell;
                ASSERT_NEAR(glm::distance(hit->position, centre), radius, 2 * thick + 1e-3);
                ASSERT_LT(glm::dot(hit->normal, direction), 1e-12);
                if (glm::dot(hit->normal, direction) < -0.3) {
                    ASSERT_GT(glm::dot(hit->normal, (hit->position - centre) / radius), 0.95) << i;
                }
            }
            EXPECT_EQ(counters.softLeaves + counters.hardLeaves, 0u);
            EXPECT_GT(counters.slabLeaves, 3000u);
        }
}

TEST(ReferenceCaster, RaysThatBeginInASlabMeetItsMiddleOnly) {
    // A page of 2^3 cells that is one slab across z, its middle at 1.
    PageHeader header;
    header.log2Cells = 1;
    header.faces = header.slabLeaves = 1;
    header.root = slabNode(255, 0);
    PageBytes page;
    page.geometry.resize(pageSections(header).end / 16);
    std::memcpy(page.geometry.data(), &header, sizeof header);
    const uint32_t code = packSlab(packSlabDirection({0, 0, 1}), -0.2, 0.2);
    ASSERT_EQ(f64::slabOffset(code), 0);
    page.geometry.back().x = code;
    Dataset dataset;
    dataset.header.cell = dataset.header.levels = dataset.header.log2Cells = 1;
    dataset.pages.push_back({.leaves = 1, .slabLeaves = 1});
    std::vector<PageBytes> pages;
    pages.push_back(std::move(page));
    const auto cache = PageCache::fromPages(std::move(dataset), std::move(pages));
    ASSERT_TRUE(cache.ok()) << cache.error().line();
    for (const bool single : {false, true}) {
        const ReferenceCaster caster = casterOf(*cache, 0, {.singlePrecision = single});
        const auto cast = [&](double z, double up) { return caster.cast({{0.7, 1.1, z}, {0, 0, up}}); };
        // From outside, from within the slab towards the middle, and away from it.
        for (const double side : {-1.0, 1.0}) {
            EXPECT_NEAR(cast(1 - 3 * side, side)->t, 3, 0.02);
            EXPECT_NEAR(cast(1 - 0.25 * side, side)->t, 0.25, 0.02);
            EXPECT_LT(cast(1 - 0.25 * side, side)->normal.z * side, -0.99);
            EXPECT_FALSE(cast(1 + 0.25 * side, side));
            EXPECT_FALSE(cast(1 + 0.6 * side, side));
        }
    }
}

TEST(ReferenceCaster, CutOfMixedLevels) {
    AnalyticOptions o;
    o.levels = 3;
    o.wallCode = 9;  // neighbouring leaves of different size do not agree on their wall
    const glm::dvec3 centre(32);
    const PageCache cache = cacheOf(test::sphere(centre, 25.3), o);
    // Half of the root's children refined, the others not.
    std::vector<uint64_t> cut;
    const auto& pages = cache.dataset().pages;
    for (uint64_t page = 0; page < pages.size(); ++page) {
        if (pages[page].level != 1) continue;
        if (page % 2 == 0) {
            cut.push_back(page);
            continue;
        }
        for (int child = 0; child < std::popcount(pages[page].childMask); ++child)
            cut.push_back(pages[page].firstChild + child);
    }
    const auto caster = ReferenceCaster::create(cache, cut);
    ASSERT_TRUE(caster.ok()) << caster.error().line();
    castAtSphere(cache, *caster, centre, 25.3, 0.15, 10000, 5);
}

TEST(ReferenceCaster, PlaneOnGridPlaneIsClosed) {
    // The surface lies in the walls between cells, and rays run along edges and corners of the grid.
    AnalyticOptions o;
    o.levels = 2;
    const PageCache cache = cacheOf(test::plane({0, 0, 1}, 16), o);
    const ReferenceCaster caster = casterOf(cache, 1);
    for (int x = 1; x < 64; ++x) {
        for (int y = 1; y < 64; ++y) {
            const glm::dvec3 from{x * 0.5, y * 0.5, 100};
            const auto straight = caster.cast({from, {0, 0, -1}});
            ASSERT_TRUE(straight) << x << " " << y;
            EXPECT_NEAR(straight->t, 84, 1e-3);
            const glm::dvec3 slanted = glm::normalize(glm::dvec3(16, 16, 16) - from);
            const auto hit = caster.cast({from, slanted});
            ASSERT_TRUE(hit) << x << " " << y;
            EXPECT_NEAR(hit->position.z, 16, 2e-3);
        }
    }
}

TEST(ReferenceCaster, OriginFarAway) {
    // UTM-like coordinates: a million cells off, millimetre cells.
    AnalyticOptions o;
    o.origin = {483920.0, 3792000.0, 1200.0};
    o.finestCell = 1.0 / 1024;
    o.levels = 2;
    const glm::dvec3 centre = o.origin + glm::dvec3(16.2, 15.7, 16.1) / 1024.0;
    const PageCache cache = cacheOf(test::sphere(centre, 11.0 / 1024), o);
    castAtSphere(cache, casterOf(cache, 1), centre, 11.0 / 1024, 0.02 / 1024, 4000, 23);
    const ReferenceCaster caster = casterOf(cache, 1);
    const glm::dvec3 from = centre - glm::dvec3(1e4, 0, 0);
    const auto hit = caster.cast({from, {1, 0, 0}});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->t, 1e4 - 11.0 / 1024, 0.02 / 1024);
}

TEST(ReferenceCaster, IntervalOfTheRayIsKept) {
    AnalyticOptions o;
    o.log2Cells = 5;
    const PageCache cache = cacheOf(test::sphere(glm::dvec3(16), 10), o);
    const ReferenceCaster caster = casterOf(cache, 0);
    const glm::dvec3 from{-4, 16, 16};
    EXPECT_NEAR(caster.cast({from, {1, 0, 0}})->t, 10, 0.02);
    EXPECT_NEAR(caster.cast({from, {1, 0, 0}, 10.5})->t, 30, 0.02);
    EXPECT_FALSE(caster.cast({from, {1, 0, 0}, 0, 9.5}));
    EXPECT_FALSE(caster.cast({from, {1, 0, 0}, 10.5, 29.5}));
    EXPECT_FALSE(caster.cast({from, {-1, 0, 0}}));
    EXPECT_NEAR(caster.cast({glm::dvec3(16), {0, 0, 1}})->t, 10, 0.02);
    const auto all = caster.castAll({from, {1, 0, 0}});
    ASSERT_GE(all.size(), 2u);
    EXPECT_NEAR(all.front().t, 10, 0.02);
    EXPECT_NEAR(all.back().t, 30, 0.02);
}

TEST(ReferenceCaster, FirstHitIsTheNearestOfAll) {
    AnalyticOptions o;
    o.levels = 2;
    const PageCache cache = cacheOf(test::torus(glm::dvec3(16), 9, 3.5), o);
    const ReferenceCaster caster = casterOf(cache, 1);
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> position(0, 32);
    int hits = 0;
    for (int i = 0; i < 20000; ++i) {
        const Ray ray{{position(random), position(random), position(random)}, randomDirection(random)};
        CastCounters first, every;
        const auto hit = caster.cast(ray, &first);
        const auto all = caster.castAll(ray, &every);
        ASSERT_EQ(hit.has_value(), !all.empty());
        EXPECT_LE(first.softLeaves, every.softLeaves);
        EXPECT_EQ(first.rays, 1u);
        if (!hit) continue;
        ++hits;
        EXPECT_EQ(hit->t, all.front().t);
        EXPECT_NEAR(test::torus(glm::dvec3(16), 9, 3.5)(hit->position).distance, 0, 0.02);
    }
    EXPECT_GT(hits, 2000);
}

TEST(ReferenceCaster, SinglePrecisionAgrees) {
    AnalyticOptions o;
    o.levels = 2;
    const PageCache cache = cacheOf(test::torus(glm::dvec3(16), 9, 3.5), o);
    const ReferenceCaster exact = casterOf(cache, 1);
    const ReferenceCaster single = casterOf(cache, 1, {.singlePrecision = true, .steps = 5});
    std::mt19937_64 random(4);
    std::uniform_real_distribution<double> position(0, 32);
    int hits = 0, differ = 0;
    for (int i = 0; i < 20000; ++i) {
        const Ray ray{{position(random), position(random), position(random)}, randomDirection(random)};
        const auto a = exact.cast(ray), b = single.cast(ray);
        if (!a && !b) continue;
        ++hits;
        // Grazing rays may differ; the rest may not.
        if (!a || !b || std::abs(a->t - b->t) > 1e-3) ++differ;
    }
    EXPECT_GT(hits, 2000);
    EXPECT_LT(differ, hits / 500);
}

TEST(ReferenceCaster, CutIsChecked) {
    AnalyticOptions o;
    o.levels = 2;
    const PageCache cache = cacheOf(test::sphere(glm::dvec3(16), 10), o);
    const std::vector<uint64_t> overlapping = {0, 1};
    EXPECT_FALSE(ReferenceCaster::create(cache, overlapping).ok());
    const std::vector<uint64_t> missing = {cache.dataset().pages.size()};
    EXPECT_FALSE(ReferenceCaster::create(cache, missing).ok());
}

/// A page that is one hard leaf, with a tetrahedron inside.
PageBytes tetrahedronPage(std::array<glm::dvec3, 4> corners) {
    PageHeader h;
    h.log2Cells = 2;
    h.vertices = 4;
    h.hardLeaves = 1;
    std::vector<uint32_t> entries;
    h.root = appendHardLeaf(std::array<Index3, 4>{{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}}, entries);
    h.entries = uint32_t(entries.size());
    const PageSections s = pageSections(h);
    PageBytes bytes;
    bytes.geometry.resize(s.end / 16);
    auto* out = reinterpret_cast<std::byte*>(bytes.geometry.data());
    std::memcpy(out, &h, sizeof(h));
    storeEntries(entries, h.vertices, out + s.strips);
    for (uint32_t v = 0; v < 4; ++v) {
        const glm::dvec3 lattice = corners[v] * double(kLatticePerCell) + double(kLatticeBias);
        const glm::u32vec2 record = pack21(uint32_t(lattice.x), uint32_t(lattice.y), uint32_t(lattice.z));
        std::memcpy(out + s.vertices + 8 * v, &record, 8);
        const uint32_t normal = packNormal({0, 0, 1}, true);
        std::memcpy(out + s.normals + 4 * v, &normal, 4);
    }
    return bytes;
}

TEST(ReferenceCaster, HardLeafIsClosed) {
    Dataset dataset;
    dataset.header.cell = 0.5;
    dataset.header.levels = 1;
    dataset.header.log2Cells = 2;
    dataset.pages.resize(1);
    std::vector<PageBytes> pages;
    const std::array<glm::dvec3, 4> corners = {
        glm::dvec3(0.5, 0.5, 0.5), {3.5, 0.5, 0.5}, {0.5, 3.5, 0.5}, {0.5, 0.5, 3.5}};
    pages.push_back(tetrahedronPage(corners));
    auto cache = PageCache::fromPages(dataset, std::move(pages));
    ASSERT_TRUE(cache.ok()) << cache.error().line();
    for (const bool single : {false, true}) {
        const ReferenceCaster caster = casterOf(*cache, 0, {.singlePrecision = single});
        std::mt19937_64 random(9);
        std::uniform_real_distribution<double> unit(0, 1);
        for (int i = 0; i < 20000; ++i) {
            // Through points inside, on edges and at corners of the solid.
            glm::dvec4 w(unit(random), unit(random), unit(random), unit(random));
            if (i % 3 == 1) w.z = w.w = 0;
            if (i % 3 == 2) w = glm::dvec4(0, 0, 0, 1);
            w /= w.x + w.y + w.z + w.w;
            glm::dvec3 at{0};
            for (int c = 0; c < 4; ++c) at += w[c] * corners[c] * 0.5;
            if (i % 3 != 0) at += (glm::dvec3(0.5) - at) * 1e-4;  // just inside
            const glm::dvec3 from = glm::dvec3(1) + randomDirection(random) * 5.0;
            const auto hit = caster.cast({from, glm::normalize(at - from)});
            ASSERT_TRUE(hit) << "ray " << i << " slips through" << (single ? " in float" : "");
            EXPECT_LE(hit->t, glm::distance(at, from) + 1e-3);
            EXPECT_EQ(nodeType(hit->node), kNodeHard);
        }
    }
}

}  // namespace
}  // namespace vcp
