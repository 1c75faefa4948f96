// Blended normals of slab leaves, on pages made from formulas, where the true normal is known.
#include "octree/surface/slab_blend.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "octree/reference_caster.h"
#include "tests/support/analytic_page.h"

namespace vcp {
namespace {

constexpr double kRootEdge = 32;
constexpr double kWide = 1e-3;  // a pixel so small that all leaves are wide

/// A dataset of two levels that are slabs, of 2^3 pages at the finer one.
PageCache slabsOf(const test::SignedDistanceField& field) {
    test::AnalyticOptions o;
    o.levels = o.slabLevels = 2;
    auto made = analyticDataset(field, o);
    auto cache = PageCache::fromPages(std::move(made.dataset), std::move(made.pages));
    EXPECT_TRUE(cache.ok()) << cache.error().line();
    return std::move(*cache);
}

/// Casts the same rays with normals that are blended and with normals that are not.
class Pair {
public:
    Pair(const PageCache& cache, uint32_t level, double pixelEdge = kWide)
        : plain_(*ReferenceCaster::create(cache, cutAtLevel(cache.dataset(), level))),
          blended_(*ReferenceCaster::create(cache, cutAtLevel(cache.dataset(), level), {.pixelEdge = pixelEdge})) {}

    struct Hits {
        RayHit plain, blended;
    };
    [[nodiscard]] std::optional<Hits> cast(const Ray& ray) const {
        const auto plain = plain_.cast(ray), blended = blended_.cast(ray);
        EXPECT_EQ(plain.has_value(), blended.has_value());
        if (!plain || !blended) return {};
        EXPECT_EQ(plain->t, blended->t);
        EXPECT_NEAR(glm::length(blended->normal), 1, 1e-12);
        EXPECT_LT(glm::dot(blended->normal, ray.direction), 1e-12);
        return Hits{*plain, *blended};
    }

private:
    ReferenceCaster plain_, blended_;
};

class RandomRays {
public:
    explicit RandomRays(uint64_t seed) : random_(seed) {}
    double between(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }
    glm::dvec3 direction() {
        std::normal_distribution<double> normal;
        return glm::normalize(glm::dvec3(normal(random_), normal(random_), normal(random_)));
    }

private:
    std::mt19937_64 random_;
};

double degreesBetween(glm::dvec3 a, glm::dvec3 b) {
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)) * 180 / M_PI;
}

double quantile(std::vector<double> values, double part) {
    std::sort(values.begin(), values.end());
    return values[size_t(part * double(values.size() - 1))];
}

TEST(SlabBlend, WeightsAreThoseOfTheEightOctants) {
    RandomRays dice(1);
    for (int i = 0; i < 1000; ++i) {
        const glm::dvec3 x(dice.between(0, 1), dice.between(0, 1), dice.between(0, 1));
        const glm::dvec3 corner = f64::nearestCorner(x);
        EXPECT_LE(glm::length(corner - x), std::sqrt(0.75));
        double sum = 0, largest = 0;
        for (uint32_t octant = 0; octant < 8; ++octant) {
            sum += f64::octantWeight(f64::shareAbove(x), octant);
            largest = std::max(largest, f64::octantWeight(f64::shareAbove(x), octant));
        }
        EXPECT_NEAR(sum, 1, 1e-12);
        EXPECT_EQ(f64::octantWeight(f64::shareAbove(x), f64::octantOfLeaf(corner)), largest)
            << "the leaf that is hit counts most";
    }
    // In the middle of a leaf it alone counts, at a corner all count alike.
    EXPECT_EQ(
        f64::octantWeight(f64::shareAbove(glm::dvec3(0.5)), f64::octantOfLeaf(f64::nearestCorner(glm::dvec3(0.5)))), 1);
    for (uint32_t octant = 0; octant < 8; ++octant) {
        EXPECT_EQ(f64::octantWeight(f64::shareAbove(glm::dvec3(0)), octant), 0.125);
        EXPECT_EQ(f64::octantWeight(f64::shareAbove(glm::dvec3(1)), octant), 0.125);
    }
}

TEST(SlabBlend, CountsFromOnePixelOnAndWhollyFromTwo) {
    EXPECT_EQ(f64::slabBlendShare(0.3), 0);
    EXPECT_EQ(f64::slabBlendShare(1), 0);
    EXPECT_EQ(f64::slabBlendShare(1.25), 0.25);
    EXPECT_EQ(f64::slabBlendShare(2), 1);
    EXPECT_EQ(f64::slabBlendShare(100), 1);
    EXPECT_EQ(f64::slabBlendShare(1 / std::numeric_limits<double>::infinity()), 0);
}

TEST(SlabBlend, APlaneOfAnyOrientationKeepsItsNormal) {
    RandomRays dice(2);
    for (int i = 0; i < 20; ++i) {
        const glm::dvec3 normal = dice.direction();
        const PageCache cache = slabsOf(test::plane(normal, glm::dot(normal, glm::dvec3(15.7, 16.1, 15.9))));
        for (const uint32_t level : {0u, 1u}) {
            const Pair pair(cache, level);
            int hits = 0;
            for (int k = 0; k < 300; ++k) {
                const glm::dvec3 at(dice.between(2, 30), dice.between(2, 30), dice.between(2, 30));
                const auto found = pair.cast({at + 40.0 * normal, -normal});
                if (!found) continue;
                ++hits;
                ASSERT_EQ(nodeType(found->blended.node), kNodeSlab);
                EXPECT_LT(glm::distance(found->blended.normal, found->plain.normal), 1e-12) << "plane " << i;
            }
            EXPECT_GT(hits, 100);
        }
    }
}

TEST(SlabBlend, NormalsOfASphereAreNearerToTheTruth) {
    const glm::dvec3 centre(16.1, 15.8, 16.3);
    const double radius = 12.3;
    const PageCache cache = slabsOf(test::sphere(centre, radius));
    RandomRays dice(3);
    for (const uint32_t level : {0u, 1u}) {
        const Pair pair(cache, level);
        std::vector<double> plain, blended;
        for (int i = 0; i < 20000; ++i) {
            const glm::dvec3 out = dice.direction();
            const auto found = pair.cast({centre + 3 * radius * out, -out});
            ASSERT_TRUE(found);
            plain.push_back(degreesBetween(found->plain.normal, out));
            blended.push_back(degreesBetween(found->blended.normal, out));
        }
        SCOPED_TRACE(testing::Message() << "level " << level << ", p95 " << quantile(plain, 0.95) << " and "
                                        << quantile(blended, 0.95));
        EXPECT_GT(quantile(plain, 0.95), level == 0 ? 5 : 2.5) << "there is something to mend";
        EXPECT_LT(quantile(blended, 0.95), 0.15 * quantile(plain, 0.95));
        EXPECT_LT(quantile(blended, 1), 0.7 * quantile(plain, 1)) << "across the walls of pages, too";
    }
}

// Two spheres that nearly touch: what is across the gap does not count, nor turns normals over.
TEST(SlabBlend, AFoldIsNotSmeared) {
    const double radius = 7;
    for (const double gap : {0.4, 0.8, 1.2, 2.4}) {
        SCOPED_TRACE(gap);
        const glm::dvec3 across = glm::normalize(glm::dvec3(0.9, 0.3, 0.2)), middle(16.2, 15.9, 16.1);
        const glm::dvec3 a = middle - (radius + gap / 2) * across, b = middle + (radius + gap / 2) * across;
        const auto first = test::sphere(a, radius), second = test::sphere(b, radius);
        const PageCache cache = slabsOf([&](glm::dvec3 p) {
            const test::SignedDistance one = first(p), other = second(p);
            return one.distance < other.distance ? one : other;
        });
        const Pair pair(cache, 1);
        RandomRays dice(4);
        std::vector<double> plain, blended;
        // From within one sphere towards the gap.
        while (blended.size() < 5000) {
            const glm::dvec3 out = glm::normalize(across + 0.5 * dice.direction());
            if (glm::dot(out, across) < 0.9) continue;
            const auto found = pair.cast({a, out});
            ASSERT_TRUE(found);
            plain.push_back(degreesBetween(-found->plain.normal, out));
            blended.push_back(degreesBetween(-found->blended.normal, out));
        }
        SCOPED_TRACE(testing::Message() << "p95 " << quantile(plain, 0.95) << " and " << quantile(blended, 0.95)
                                        << ", worst " << quantile(plain, 1) << " and " << quantile(blended, 1));
        EXPECT_LT(quantile(blended, 0.5), 0.3 * quantile(plain, 0.5));
        EXPECT_LT(quantile(blended, 1), quantile(plain, 1));
        // Where both spheres are in the same cells, their slabs are those of neither.
        if (gap > 0.5) {
            EXPECT_LT(quantile(blended, 0.95), 0.5 * quantile(plain, 0.95));
        }
    }
}

TEST(SlabBlend, LeavesAsNarrowAsAPixelKeepTheirNormals) {
    const glm::dvec3 centre(16.1, 15.8, 16.3);
    const PageCache cache = slabsOf(test::sphere(centre, 12.3));
    const Pair narrow(cache, 1, 1.0), wide(cache, 1, 0.99);
    RandomRays dice(5);
    double most = 0;
    for (int i = 0; i < 2000; ++i) {
        const glm::dvec3 out = dice.direction();
        const auto kept = narrow.cast({centre + kRootEdge * out, -out});
        const auto changed = wide.cast({centre + kRootEdge * out, -out});
        ASSERT_TRUE(kept && changed);
        EXPECT_EQ(kept->blended.normal, kept->plain.normal);
        most = std::max(most, degreesBetween(changed->blended.normal, changed->plain.normal));
    }
    EXPECT_GT(most, 0.01);
    EXPECT_LT(most, 0.3) << "nothing jumps";
}

}  // namespace
}  // namespace vcp
