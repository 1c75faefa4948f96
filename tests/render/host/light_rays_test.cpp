// Rays of light against the reference, on every instruction set; and what one finds is the same whatever others are
// cast with it, to the last bit where they are not parallel.
#include "render/host/light_rays.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "tests/support/built_mesh.h"
#include "tests/support/instruction_sets.h"
#include "tests/support/test_meshes.h"
#include "tests/support/test_scene.h"

namespace vcp {
namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();

/// How the rays of a tile run.
enum class Bundle {
    Parallel,   // as to the sun, from points side by side
    AlongGrid,  // the same along an axis, in walls of the grid
    Apart,      // into all directions, as far as occlusion reaches
    Scattered   // from anywhere, in all directions
};

/// Makes bundles of rays in a box of `cells` finest cells, as a tile's are.
class Bundles {
public:
    Bundles(glm::dvec3 low, glm::dvec3 high, uint32_t seed) : low_(low), high_(high), random_(seed) {}

    std::vector<LightRay> make(Bundle kind, int count) {
        const glm::dvec3 corner = inBox();
        const double width = 6;  // finest cells
        const glm::vec3 sun = direction(), right = direction(), down = direction();
        const int axis = int(random_() % 3);
        const float sign = random_() % 2 == 0 ? 1.0f : -1.0f;
        std::vector<LightRay> rays;
        for (int i = 0; i < count; ++i) {
            LightRay ray{corner + width * glm::dvec3(part(), part(), part()), sun, kNothing};
            if (kind == Bundle::Parallel || kind == Bundle::AlongGrid) {
                const double step = 0.15 + 0.05 * part();
                ray.origin = corner + step * (double(i % 16) * glm::dvec3(right) + double(i / 16) * glm::dvec3(down));
                // Some pixels show what is far behind.
                if (i % 50 == 13) ray.origin += 40.0 * glm::dvec3(right);
            }
            if (kind == Bundle::AlongGrid) {
                ray.origin = glm::round(8.0 * ray.origin) / 8.0;
                ray.direction = glm::vec3(0);
                ray.direction[axis] = sign;
            }
            if (kind == Bundle::Scattered) ray.origin = inBox();
            if (kind == Bundle::Apart || kind == Bundle::Scattered) ray.direction = direction();
            if (kind == Bundle::Apart) ray.reach = float(20 * part());
            rays.push_back(ray);
        }
        return rays;
    }

private:
    double part() { return std::uniform_real_distribution<double>()(random_); }
    glm::dvec3 inBox() { return low_ + glm::dvec3(part(), part(), part()) * (high_ - low_); }
    glm::vec3 direction() {
        std::normal_distribution<double> normal;
        return glm::vec3(glm::normalize(glm::dvec3(normal(random_), normal(random_), normal(random_))));
    }

    const glm::dvec3 low_, high_;
    std::mt19937 random_;
};

struct Found {
    uint64_t hit = 0, miss = 0;
    uint64_t near = 0;   // the reference finds it too, from a ten-thousandth of a cell beside
    uint64_t wrong = 0;  // it does not
};

class LightComparer {
public:
    LightComparer(const PageCache& cache, const std::vector<uint64_t>& cut)
        : cache_(cache),
          scene_(*HostScene::create(cache, cut)),
          reference_(*ReferenceCaster::create(cache, cut)),
          single_(*ReferenceCaster::create(cache, cut, {.singlePrecision = true})) {}

    /// Casts bundles of all kinds, whole and ray by ray.
    [[nodiscard]] Found compare(int bundles, uint32_t seed) const {
        const FileHeader& header = cache_.dataset().header;
        const HostGrid& grid = scene_.grid();
        const glm::dvec3 low =
            (glm::dvec3(header.boundsMin[0], header.boundsMin[1], header.boundsMin[2]) - grid.origin);
        const glm::dvec3 high =
            (glm::dvec3(header.boundsMax[0], header.boundsMax[1], header.boundsMax[2]) - grid.origin);
        Bundles made(low / grid.cell - 2.0, high / grid.cell + 2.0, seed);
        Found found;
        for (int i = 0; i < bundles; ++i) {
            SCOPED_TRACE(i);
            const auto kind = static_cast<Bundle>(i % 4);
            const bool isParallel = kind == Bundle::Parallel || kind == Bundle::AlongGrid;
            const auto rays = made.make(kind, i % 5 == 0 ? 1024 : isParallel ? 128 : 1 + 37 * (i % 4));
            PageMarks together(scene_.pages()), alone(scene_.pages());
            std::vector<float> distances(rays.size());
            castLightRays(scene_, rays, distances.data(), &together);
            for (size_t k = 0; k < rays.size(); ++k) {
                float distance = 0;
                castLightRays(scene_, {&rays[k], 1}, &distance, &alone);
                EXPECT_TRUE(isParallel || distances[k] == distance) << "ray " << k;
                add(rays[k], distances[k], found);
            }
            if (kind == Bundle::AlongGrid) continue;
            for (size_t page = 0; page < scene_.pages(); ++page)
                EXPECT_EQ(together.isMarked(page), alone.isMarked(page)) << "page " << page;
        }
        return found;
    }

private:
    [[nodiscard]] bool agrees(const ReferenceCaster& caster, const LightRay& ray, glm::dvec3 beside,
                              float distance) const {
        const HostGrid& grid = scene_.grid();
        const auto hit = caster.cast({.origin = grid.origin + (ray.origin + beside) * grid.cell,
                                      .direction = glm::normalize(glm::dvec3(ray.direction)),
                                      .tMax = double(ray.reach) * grid.cell});
        if (!hit) return distance == kNothing;
        // At the end of its reach rounding decides.
        if (distance == kNothing) return hit->t > (double(ray.reach) - 1e-3) * grid.cell;
        return std::abs(hit->t / grid.cell - double(distance)) < 1e-2 * double(1u << scene_.grid().levels);
    }

    void add(const LightRay& ray, float distance, Found& found) const {
        if (agrees(reference_, ray, glm::dvec3(0), distance)) {
            ++(distance == kNothing ? found.miss : found.hit);
            return;
        }
        const glm::dvec3 d(ray.direction), aside = glm::normalize(glm::cross(d, glm::dvec3(0.31, 0.57, 0.83)));
        bool isNear = agrees(single_, ray, glm::dvec3(0), distance);
        for (int i = 0; i < 16 && !isNear; ++i) {
            const double angle = i * 0.3927, reach = 3e-4 * double(1u << (scene_.grid().levels - 1));
            isNear = agrees(reference_, ray, (std::cos(angle) * aside + std::sin(angle) * glm::cross(d, aside)) * reach,
                            distance);
        }
        ++(isNear ? found.near : found.wrong);
    }

    const PageCache& cache_;
    HostScene scene_;
    ReferenceCaster reference_, single_;
};

void expectSame(const PageCache& cache, const std::vector<uint64_t>& cut, uint32_t seed, int bundles = 40) {
    const Found found = LightComparer(cache, cut).compare(bundles, seed);
    EXPECT_EQ(found.wrong, 0u);
    EXPECT_GT(found.hit, 1000u);
    EXPECT_GT(found.miss, 1000u);
    // A quarter of the rays run in walls of the grid, where rounding decides which octants of a slab they meet.
    EXPECT_LE(found.near * 25, found.hit);
}

TEST(LightRays, SoftLeavesOnEveryInstructionSet) {
    test::onEveryInstructionSet([] {
        const auto scene = test::torusScene();
        for (const uint32_t level : {0u, 2u})
            expectSame(*scene.cache, cutAtLevel(*scene.dataset, level), 7 + level, 80);
    });
}

TEST(LightRays, BuiltMeshOnEveryLevelAndInAMixedCut) {
    IndexedMesh mesh = test::torusMesh({0.1, 0.2, 0.3}, 1, 0.4, 90, 45);
    test::append(mesh, test::boxMesh({-0.3, -0.3, -0.3}, {0.35, 0.25, 0.3}, 4));
    const test::BuiltMesh built(mesh, 0.03);
    ASSERT_TRUE(built.ok());
    const Dataset& dataset = built.cache().dataset();
    ASSERT_GE(built.levels(), 2u);
    test::onEveryInstructionSet([&] {
        for (uint32_t level = 0; level < built.levels(); ++level) {
            SCOPED_TRACE(level);
            expectSame(built.cache(), cutAtLevel(dataset, level), 11 + level);
        }
        expectSame(built.cache(), test::mixedCut(dataset), 17);
    });
}

TEST(LightRays, NarrowTrianglesAndPoints) {
    const test::BuiltMesh built(test::randomTriangles(3000, 11, true), 0.05);
    ASSERT_TRUE(built.ok());
    expectSame(built.cache(), cutAtLevel(built.cache().dataset(), 99), 5);
}

TEST(LightRays, NoneAndOne) {
    const auto scene = test::torusScene();
    const auto host = HostScene::create(*scene.cache, cutAtLevel(*scene.dataset, 2));
    ASSERT_TRUE(host);
    castLightRays(*host, {}, nullptr);
    const LightRay away{glm::dvec3(-5), {-1, 0, 0}, kNothing};
    float distance = 0;
    castLightRays(*host, {&away, 1}, &distance);
    EXPECT_EQ(distance, kNothing);
}

}  // namespace
}  // namespace vcp
