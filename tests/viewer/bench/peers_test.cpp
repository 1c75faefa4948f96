// The peers of the ray benchmark on shapes whose answer is known, and against slow references.
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "builder/paper/grid_points.h"
#include "builder/paper/paper_file.h"
#include "builder/paper/paper_octree.h"
#include "builder/paper/region_growing.h"
#include "tests/support/paper_subvolumes.h"
#include "tests/support/test_folder.h"
#include "tests/support/test_meshes.h"
#include "viewer/bench/peers/distance_octree.h"
#include "viewer/bench/peers/grid_rays.h"
#include "viewer/bench/peers/subvolume_caster.h"
#include "viewer/bench/peers/voxel_octree.h"
#include "viewer/bench/rays/analytic_models.h"
#include "viewer/bench/rays/bench_cameras.h"
#include "viewer/bench/rays/peer_tracer.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

constexpr double kRadius = 16;
constexpr int kRays = 4000;

/// Rays of random directions through random points near the middle, from outside.
struct TestRay {
    glm::dvec3 origin, direction;
};
TestRay randomRay(std::mt19937_64& random, double reach, double from) {
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> unit(-reach, reach);
    const glm::dvec3 d = glm::normalize(glm::dvec3(normal(random), normal(random), normal(random)));
    return {glm::dvec3(unit(random), unit(random), unit(random)) - from * d, d};
}

/// World t of the first hit; infinite for a miss, not a number where the caster gave up.
template <class Caster>
double castWorld(const Caster& caster, const TestRay& ray) {
    const RootGrid& frame = caster.frame();
    const GridRay grid = GridRays::along(frame.gridFromWorld(ray.origin), ray.direction, frame.cells());
    NoWork work;
    const GridHit hit = caster.cast(grid, work);
    return (grid.tStart + double(hit.t)) * frame.cell;
}

/// What random rays of a caster make of a mesh, cell edge 1.
struct Outcome {
    int hits = 0, missed = 0, falseHits = 0, gaveUp = 0;
    double p99 = 0, max = 0;  ///< distance of the hits to the mesh
    double leastDistance = std::numeric_limits<double>::infinity();
};
template <class Caster>
Outcome judge(const Caster& caster, const MeshBvh& mesh, double reach, double from, double cell = 1) {
    std::mt19937_64 random(7);
    Outcome outcome;
    std::vector<double> distances;
    for (int i = 0; i < kRays; ++i) {
        const TestRay ray = randomRay(random, reach, from);
        const double t = castWorld(caster, ray);
        const auto exact = mesh.nearestHit(ray.origin, ray.direction);
        if (std::isnan(t)) ++outcome.gaveUp;
        if (!std::isfinite(t)) {
            outcome.missed += exact ? 1 : 0;
            continue;
        }
        if (!exact) {
            ++outcome.falseHits;
            continue;
        }
        ++outcome.hits;
        distances.push_back(mesh.nearestPoint(ray.origin + t * ray.direction)->distance / cell);
        // The first sheet, not the one behind it.
        EXPECT_LT(std::abs(t - exact->t), 20 * cell) << "ray " << i;
    }
    std::ranges::sort(distances);
    if (distances.empty()) return outcome;
    outcome.p99 = distances[distances.size() * 99 / 100];
    outcome.max = distances.back();
    outcome.leastDistance = distances.front();
    return outcome;
}

class PeersOnASphere : public testing::Test {
protected:
    PeersOnASphere() : mesh_(test::sphereMesh({0.31, -0.17, 0.23}, kRadius, 64)), bvh_(mesh_), sides_(mesh_) {}

    IndexedMesh mesh_;
    MeshBvh bvh_;
    MeshSides sides_;
};

TEST_F(PeersOnASphere, AnalyticRootsAreExactToSecondOrder) {
    const auto caster = AnalyticCaster::create(bvh_, sides_, {.threads = 1});
    ASSERT_TRUE(caster);
    const Outcome outcome = judge(*caster, bvh_, 10, 60);
    EXPECT_GT(outcome.hits, kRays * 9 / 10);
    EXPECT_LT(outcome.p99, 0.05);
    EXPECT_LT(outcome.max, 0.06);
    EXPECT_EQ(outcome.missed, 0);
    EXPECT_EQ(outcome.gaveUp, 0);
}

TEST_F(PeersOnASphere, SphereTracingFindsTheSameSurface) {
    const auto caster = DistanceCaster::create(bvh_, sides_, {}, {.threads = 1});
    ASSERT_TRUE(caster);
    const Outcome outcome = judge(*caster, bvh_, 10, 60);
    EXPECT_GT(outcome.hits, kRays * 9 / 10);
    EXPECT_LT(outcome.p99, 0.1);
    EXPECT_EQ(outcome.missed, 0);
    EXPECT_EQ(outcome.gaveUp, 0);
}

TEST_F(PeersOnASphere, ThePaperShowsASurfaceEpsilonAway) {
    auto caster = PaperCaster::create(bvh_, {}, {.threads = 2});
    ASSERT_TRUE(caster);
    for (const float epsilon : {0.5f, 0.25f, 0.1f}) {
        caster->setMarch({.epsilon = epsilon});
        const Outcome outcome = judge(*caster, bvh_, 10, 60);
        EXPECT_GT(outcome.hits, kRays * 9 / 10);
        EXPECT_NEAR(outcome.p99, epsilon, 0.05) << epsilon;
        EXPECT_NEAR(outcome.leastDistance, epsilon, 0.1) << epsilon;
        EXPECT_EQ(outcome.missed, 0);
        EXPECT_EQ(outcome.gaveUp, 0);
    }
}

TEST_F(PeersOnASphere, VoxelsAreWithinTheirDiagonalAndContoursNearer) {
    auto voxels = buildVoxelOctree(mesh_, 1, false, 1), contours = buildVoxelOctree(mesh_, 1, true, 1);
    ASSERT_TRUE(voxels && contours);
    EXPECT_EQ(voxels->voxels, contours->voxels);
    EXPECT_EQ(contours->contours.size(), contours->voxels);
    const Outcome blocky = judge(VoxelCaster(std::move(*voxels)), bvh_, 10, 60);
    const Outcome flat = judge(VoxelCaster(std::move(*contours)), bvh_, 10, 60);
    EXPECT_GT(blocky.hits, kRays * 9 / 10);
    EXPECT_LE(blocky.max, std::sqrt(3.0));
    EXPECT_GT(blocky.p99, 0.3);
    EXPECT_LT(flat.p99, 0.15);
    EXPECT_EQ(blocky.missed, 0);
    EXPECT_EQ(flat.missed, 0);
}

TEST_F(PeersOnASphere, CountersAndHitsAreTheSameOnAnyThreads) {
    const auto caster = AnalyticCaster::create(bvh_, sides_, {.threads = 1});
    const auto again = AnalyticCaster::create(bvh_, sides_, {.threads = 4});
    ASSERT_TRUE(caster && again);
    EXPECT_EQ(caster->bytes(), again->bytes());
    const glm::ivec2 size(60, 40);
    const Camera camera = *benchCamera("whole", bvh_, {}, size, 0, 1);
    PeerTracer<AnalyticCaster> one(std::make_shared<AnalyticCaster>(*caster), "cell 1", 1),
        four(std::make_shared<AnalyticCaster>(*again), "cell 1", 4);
    const auto a = one.trace(camera, size, 1), b = four.trace(camera, size, 2);
    ASSERT_TRUE(a && b);
    const RaysWork &ofOne = a->work, &ofFour = b->work;
    EXPECT_EQ(ofOne.steps.rays(), 2400u);
    EXPECT_GT(ofOne.cells.mean(), 0);
    EXPECT_GT(ofOne.steps.mean(), ofOne.cells.mean());
    EXPECT_GT(ofOne.fetches.mean(), ofOne.steps.mean());
    EXPECT_EQ(ofOne.steps.mean(), ofFour.steps.mean());
    EXPECT_EQ(ofOne.cells.mean(), ofFour.cells.mean());
    EXPECT_EQ(ofOne.fetches.mean(), ofFour.fetches.mean());
    EXPECT_LE(ofOne.steps.quantile(0.95), ofOne.steps.quantile(0.99));
    EXPECT_EQ(ofOne.steps.quantile(0.99), ofFour.steps.quantile(0.99));
    int hits = 0;
    for (size_t i = 0; i < a->hits.size(); ++i) {
        ASSERT_EQ(a->hits[i].has_value(), b->hits[i].has_value());
        if (!a->hits[i]) continue;
        ++hits;
        EXPECT_EQ(a->hits[i]->t, b->hits[i]->t);
        EXPECT_NEAR(glm::length(a->hits[i]->normal), 1, 1e-9);
    }
    EXPECT_GT(hits, 600);
}

TEST_F(PeersOnASphere, MergingSavesBytesAndEveryRuleCanBeSwitched) {
    // The signed distances' tree is made of exact points.
    PaperOptions options;
    options.growRounds = CornerOctreeOptions::kExactPoints;
    const auto merged = PaperCaster::create(bvh_, options, {.threads = 2});
    options.mergeThreshold = -1;
    const auto whole = PaperCaster::create(bvh_, options, {.threads = 2});
    options.band = 1;
    auto thin = PaperCaster::create(bvh_, options, {.threads = 2});
    ASSERT_TRUE(merged && whole && thin);
    const auto distances = DistanceCaster::create(bvh_, sides_, {}, {.threads = 2});
    ASSERT_TRUE(distances);
    EXPECT_EQ(distances->bytes(), merged->bytes());
    EXPECT_LT(merged->tree().leaves, whole->tree().leaves);
    EXPECT_LT(thin->tree().leaves, whole->tree().leaves);
    EXPECT_LT(thin->bytes(), whole->bytes());
    // Shared along x: between the 4 codes of a fully shared leaf and 8.
    EXPECT_LT(whole->tree().slices.size(), 2 * whole->tree().leaves);
    EXPECT_GT(whole->tree().slices.size(), whole->tree().leaves);
    // Steps by the plane save steps.
    const auto steps = [&](const PaperCaster& caster) {
        std::mt19937_64 random(3);
        RayWork work;
        for (int i = 0; i < 1000; ++i) {
            const TestRay ray = randomRay(random, 12, 60);
            (void)caster.cast(
                GridRays::along(caster.frame().gridFromWorld(ray.origin), ray.direction, caster.frame().cells()), work);
        }
        return work.steps;
    };
    const uint32_t planar = steps(*thin);
    thin->setMarch({.step = PaperStep::Distance});
    const uint32_t distance = steps(*thin);
    thin->setMarch({.step = PaperStep::Onward});
    EXPECT_GT(distance, planar);
    EXPECT_GT(planar, steps(*thin));
}

TEST(Peers, RegionGrowingIsNeverNearerAndFiveRoundsReachTheBand) {
    const IndexedMesh mesh = test::randomTriangles(60, 3, false);
    const MeshBvh bvh(mesh);
    RootGrid frame = RootGrid::around(bvh.low(), bvh.high(), 0.05, 4);
    GridPoints<CornerSample> points;
    const glm::ivec3 cells = frame.cells();
    for (int i = 0; i < cells.x; ++i)
        for (int j = 0; j < cells.y; ++j)
            for (int k = 0; k < cells.z; ++k)
                if (bvh.nearestPoint(frame.worldFromGrid(glm::dvec3(i, j, k)), 5 * frame.cell)) points.add({i, j, k});
    double reached = 0, tooLong = std::numeric_limits<double>::infinity();
    for (const int rounds : {0, 1, 3, 5}) {
        growClosestPoints(mesh, frame, rounds, 2, points);
        double count = 0, longer = 0;
        for (size_t slot = 0; slot < points.slots(); ++slot) {
            if (!points.isUsed(slot)) continue;
            const glm::ivec3 at = points.pointAt(slot);
            const CornerSample grown = *points.find(at);
            const double exact = bvh.nearestPoint(frame.worldFromGrid(glm::dvec3(at)))->distance / frame.cell;
            if (!grown.isReached()) {
                EXPECT_GT(exact, rounds);
                continue;
            }
            ++count;
            EXPECT_GE(grown.distance, exact - 1e-5);
            EXPECT_NEAR(glm::length(grown.toSurface), grown.distance, 1e-5);
            longer += grown.distance > exact + 1e-4 ? 1 : 0;
        }
        EXPECT_GT(count, reached) << rounds;
        reached = count;
        tooLong = longer / count;
    }
    EXPECT_EQ(reached, double(points.size()));
    EXPECT_LT(tooLong, 0.05);
}

TEST_F(PeersOnASphere, KDecidesWhatTheBandHolds) {
    const auto made = [&](int rounds) {
        PaperOptions options;
        options.growRounds = rounds;
        auto caster = PaperCaster::create(bvh_, options, {.threads = 2});
        EXPECT_TRUE(caster);
        return std::move(*caster);
    };
    const PaperCaster exact = made(CornerOctreeOptions::kExactPoints), five = made(5), one = made(1), none = made(0);
    EXPECT_NEAR(double(five.tree().leaves), double(exact.tree().leaves), 0.02 * double(exact.tree().leaves));
    EXPECT_LT(one.tree().leaves, exact.tree().leaves);
    EXPECT_LT(none.tree().leaves, one.tree().leaves);
    EXPECT_EQ(judge(five, bvh_, 10, 60).missed, 0);
    // Blocks that the surface crosses have points that no triangle reached.
    std::mt19937_64 random(5);
    int through = 0;
    for (int i = 0; i < kRays; ++i) {
        const TestRay ray = randomRay(random, 10, 60);
        const auto front = bvh_.nearestHit(ray.origin, ray.direction);
        through += front && !(std::abs(castWorld(none, ray) - front->t) < 4) ? 1 : 0;
    }
    EXPECT_GT(through, kRays / 20);
}

TEST(Peers, EmptyNodesStoreTheLeastDistanceOnTheirBoundary) {
    const IndexedMesh mesh = test::randomTriangles(12, 5, true);
    const MeshBvh bvh(mesh);
    PaperOptions options;
    options.band = 1;
    const auto caster = PaperCaster::create(bvh, options, {.cell = 0.02, .threads = 2});
    ASSERT_TRUE(caster);
    const CornerOctree& tree = caster->tree();
    int checked = 0;
    std::mt19937_64 random(11);
    for (int i = 0; i < 40; ++i) {
        std::uniform_int_distribution<int> x(0, tree.frame.cells().x - 1), y(0, tree.frame.cells().y - 1),
            z(0, tree.frame.cells().z - 1);
        NodeFinder finder(tree);
        NoWork work;
        const int32_t word = finder.find({x(random), y(random), z(random)}, work);
        if (CornerOctree::isLeaf(word)) continue;
        const glm::ivec3 low = finder.low();
        const int size = 1 << finder.level();
        double least = std::numeric_limits<double>::infinity();
        for (int c = 0; c <= size; ++c)
            for (int b = 0; b <= size; ++b)
                for (int a = 0; a <= size; ++a) {
                    if (std::min({a, b, c}) > 0 && std::max({a, b, c}) < size) continue;
                    least = std::min(
                        least,
                        bvh.nearestPoint(tree.frame.worldFromGrid(glm::dvec3(low + glm::ivec3(a, b, c))))->distance);
                }
        EXPECT_NEAR(tree.emptyDistance(word), least / 0.02, 1e-4 * least / 0.02) << "level " << finder.level();
        ++checked;
    }
    EXPECT_GT(checked, 20);
}

TEST(Peers, ABoxOnTheGridsPlanes) {
    const IndexedMesh mesh = test::boxMesh(glm::dvec3(-8), glm::dvec3(8), 4);
    const MeshBvh bvh(mesh);
    const MeshSides sides(mesh);
    const auto analytic = AnalyticCaster::create(bvh, sides, {.threads = 2});
    const auto distance = DistanceCaster::create(bvh, sides, {}, {.threads = 2});
    auto contours = buildVoxelOctree(mesh, 1, true, 2);
    ASSERT_TRUE(analytic && distance && contours);
    const VoxelCaster slabs(std::move(*contours));
    EXPECT_EQ(judge(*analytic, bvh, 7, 40).missed, 0);
    EXPECT_EQ(judge(*distance, bvh, 7, 40).missed, 0);
    const Outcome outcome = judge(slabs, bvh, 7, 40);
    EXPECT_EQ(outcome.missed, 0);
    // Voxels that the box touches with an edge only are slabs as wide as they are.
    EXPECT_LE(outcome.max, std::sqrt(3.0));
    // Along the axes, in the planes of the grid.
    for (int axis = 0; axis < 3; ++axis) {
        TestRay ray{glm::dvec3(2), glm::dvec3(0)};
        ray.origin[axis] = -30;
        ray.direction[axis] = 1;
        EXPECT_NEAR(castWorld(*analytic, ray), 22, 1e-3);
        EXPECT_NEAR(castWorld(*distance, ray), 22, 1e-2);
        EXPECT_NEAR(castWorld(slabs, ray), 22, 0.05);
    }
}

TEST(Peers, OriginFarAway) {
    const IndexedMesh mesh = test::sphereMesh({500000, 5000000, 100}, kRadius, 64);
    const MeshBvh bvh(mesh);
    const MeshSides sides(mesh);
    const auto caster = AnalyticCaster::create(bvh, sides, {.threads = 2});
    ASSERT_TRUE(caster);
    const TestRay ray{{500000, 5000000, 2100}, {0, 0, -1}};
    EXPECT_NEAR(castWorld(*caster, ray), 2000 - kRadius, 0.05);
}

TEST(Peers, RaysOutsideOfTheGridMiss) {
    const IndexedMesh mesh = test::sphereMesh({0, 0, 0}, kRadius, 16);
    auto tree = buildVoxelOctree(mesh, 1, false, 1);
    ASSERT_TRUE(tree);
    const VoxelCaster caster(std::move(*tree));
    EXPECT_TRUE(std::isinf(castWorld(caster, {{0, 0, 100}, {0, 0, 1}})));
    EXPECT_TRUE(std::isinf(castWorld(caster, {{200, 0, 100}, {0, 0, -1}})));
}

TEST(Peers, CellsTooSmallAreRefused) {
    const IndexedMesh mesh = test::sphereMesh({0, 0, 0}, kRadius, 8);
    const MeshBvh bvh(mesh);
    const auto voxels = buildVoxelOctree(mesh, 1e-6, false, 1);
    ASSERT_FALSE(voxels);
    EXPECT_EQ(voxels.error().code, ErrorCode::Limit);
    const auto paper = PaperCaster::create(bvh, {}, {.cell = 1e-6});
    ASSERT_FALSE(paper);
    EXPECT_EQ(paper.error().code, ErrorCode::Limit);
}

TEST(AnalyticModels, AreClosedAndOrientedOutwards) {
    for (const AnalyticModel& model : analyticModels()) {
        double volume = 0;
        std::map<std::pair<std::array<double, 3>, std::array<double, 3>>, int> edges;
        const auto key = [](glm::dvec3 p) { return std::array<double, 3>{p.x, p.y, p.z}; };
        for (uint64_t t = 0; t < model.mesh.triangles.size(); ++t) {
            const auto v = model.mesh.corners(t);
            volume += glm::dot(v[0], glm::cross(v[1], v[2])) / 6;
            if (model.mesh.triangles.size() > 100) continue;
            for (int k = 0; k < 3; ++k) {
                ++edges[{key(v[k]), key(v[(k + 1) % 3])}];
                --edges[{key(v[(k + 1) % 3]), key(v[k])}];
            }
        }
        for (const auto& [edge, count] : edges) EXPECT_EQ(count, 0) << model.name;
        const double exact = model.name == "sphere"  ? 4.0 / 3 * std::numbers::pi
                             : model.name == "torus" ? 2 * std::numbers::pi * std::numbers::pi * 0.7 * 0.09
                                                     : 8 * 0.7 * 0.2 * kAnalyticModelCell;
        EXPECT_NEAR(volume, exact, 1e-3 * exact) << model.name;
    }
}

TEST(MeshSides, BoxFromAllSides) {
    IndexedMesh mesh = test::boxMesh(glm::dvec3(-1), glm::dvec3(1), 3);
    const MeshBvh bvh(mesh);
    const MeshSides sides(mesh);
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> unit(-2, 2);
    for (int i = 0; i < 5000; ++i) {
        const glm::dvec3 p(unit(random), unit(random), unit(random));
        const bool inside = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) < 1;
        EXPECT_EQ(sides.isInside(p, *bvh.nearestPoint(p)), inside) << i;
    }
}

/// The same mesh as a file in subvolumes and as one octree over the same grid, cells of edge 0.05.
class PaperInSubvolumes : public testing::Test {
protected:
    static constexpr double kCell = 0.05;
    PaperInSubvolumes()
        : folder_("vcp_subvolume_caster_test"), mesh_(test::torusMesh({0.3, 0.2, 0.1}, 2, 0.8, 90, 40)) {
        const fs::path file = test::buildSubvolumes(folder_, mesh_, kCell);
        mesh_ = *loadMesh(folder_ / "mesh.ply");
        bvh_.emplace(mesh_);
        auto opened = SubvolumeCaster::open(file, {});
        EXPECT_TRUE(opened) << opened.error().line();
        cut_.emplace(std::move(*opened));
        whole_.emplace(*PaperCaster::create(*bvh_, {}, {.cell = kCell, .threads = 2}));
    }
    /// Casts rays through points near walls between subvolumes, from all around.
    template <class Visit>
    void forRaysNearWalls(const Visit& visit) const {
        std::mt19937_64 random(11);
        std::uniform_real_distribution<double> unit(0, 1);
        for (int i = 0; i < kRays; ++i) {
            TestRay ray = randomRay(random, 1, 0);
            const double around = unit(random) * 2 * std::numbers::pi;
            glm::dvec3 target =
                glm::dvec3(0.3, 0.2, 0.1) + 2.0 * glm::dvec3(std::cos(around), std::sin(around), 0) + 0.5 * ray.origin;
            // On a wall of the grid of subvolumes, or a hair beside it.
            glm::dvec3 grid = cut_->frame().gridFromWorld(target) / 16.0;
            grid[i % 3] = std::round(grid[i % 3]) + (unit(random) - 0.5) * 1e-3;
            target = cut_->frame().worldFromGrid(grid * 16.0);
            visit(TestRay{target - 8.0 * ray.direction, ray.direction});
        }
    }

    TestFolder folder_;
    IndexedMesh mesh_;
    std::optional<MeshBvh> bvh_;
    std::optional<SubvolumeCaster> cut_;
    std::optional<PaperCaster> whole_;
};

TEST_F(PaperInSubvolumes, HitWhatTheOneOctreeHits) {
    cut_->setMarch({.reach = 1e6f});
    int both = 0, different = 0;
    forRaysNearWalls([&](const TestRay& ray) {
        const double cut = castWorld(*cut_, ray), whole = castWorld(*whole_, ray);
        both += std::isfinite(cut) && std::isfinite(whole) ? 1 : 0;
        // They start elsewhere, so a ray may pass an outline on its other side.
        const bool isSame = std::isfinite(cut) && std::isfinite(whole) ? std::abs(cut - whole) < 0.2 * kCell
                                                                       : std::isinf(cut) == std::isinf(whole);
        different += isSame ? 0 : 1;
    });
    EXPECT_GT(both, kRays / 2);
    EXPECT_LE(different, kRays / 200);
    EXPECT_GT(cut_->subvolumes(), 100u);
}

TEST_F(PaperInSubvolumes, NoRaySlipsThroughWallsOrWhereTheTwoLevelsMeet) {
    for (const float reach : {0.0f, 0.25f, 0.6f, 1e6f}) {
        cut_->setMarch({.reach = reach});
        int hits = 0, missed = 0, wrong = 0;
        double farthest = 0;
        forRaysNearWalls([&](const TestRay& ray) {
            const auto exact = bvh_->nearestHit(ray.origin, ray.direction);
            const double t = castWorld(*cut_, ray);
            if (!exact) return;
            ++hits;
            if (!std::isfinite(t)) {
                ++missed;
                return;
            }
            wrong += t > exact->t + 20 * kCell ? 1 : 0;
            farthest = std::max(farthest, bvh_->nearestPoint(ray.origin + t * ray.direction)->distance / kCell);
        });
        EXPECT_GT(hits, kRays / 2);
        EXPECT_EQ(missed, 0) << reach;
        EXPECT_LE(wrong, hits / 1000) << reach;
        EXPECT_LT(farthest, reach > 1 ? 0.5 : 2.0) << "cells; the larger ones are four wide";
        EXPECT_TRUE(reach > 0 || farthest > 0.8) << farthest;
    }
}

TEST(SubvolumeCaster, OtherFilesAreRefused) {
    const TestFolder folder("vcp_subvolume_caster_test");
    test::writePly(test::sphereMesh({0, 0, 0}, 1, 8), folder / "mesh.ply");
    BuildOptions build;
    build.inputs = {folder / "mesh.ply"};
    build.output = folder / "one.vcp";
    build.cell = 0.2;
    ASSERT_TRUE(buildPaperFile(build, {}));
    const auto opened = SubvolumeCaster::open(build.output, {});
    ASSERT_FALSE(opened);
    EXPECT_EQ(opened.error().code, ErrorCode::Usage);
}

TEST(PaperPacking, VectorsSurvive) {
    std::mt19937_64 random(2);
    std::uniform_real_distribution<float> unit(-1, 1);
    constexpr float kLongest = 6;
    for (const PaperPacking packing : {PaperPacking::Spherical, PaperPacking::Octahedral}) {
        const PaperDecoder decode(kLongest, packing);
        for (int i = 0; i < 20000; ++i) {
            const glm::vec3 v = 3.4f * glm::vec3(unit(random), unit(random), unit(random));
            const float length = glm::length(v);
            const glm::vec3 back = decode(packPaperVector(v, kLongest, packing));
            // Half a step of the root, and 0.35 degrees.
            EXPECT_NEAR(glm::length(back), length, 2 * std::sqrt(length * kLongest) * 0.51f / 8191 + 1e-5f);
            EXPECT_LT(glm::distance(back, v), 0.0062f * length + 1e-3f) << i;
        }
        EXPECT_EQ(glm::length(decode(packPaperVector(glm::vec3(0), kLongest, packing))), 0);
    }
}

TEST(PaperScheme, TheLongerOfTheNearestPlaneAndTheTrilinearVector) {
    // Opposite corners that point at each other: the trilinear vector cancels, the planes do not.
    LeafVectors corners{};
    for (int k = 0; k < 8; ++k) corners.x[k] = k < 4 ? -0.2f : 0.2f;
    const glm::vec3 middle(0.5f);
    EXPECT_NEAR(glm::length(interpolateVectors(corners, 1, middle, PaperScheme::Trilinear)), 0, 1e-6);
    EXPECT_NEAR(glm::length(interpolateVectors(corners, 1, middle, PaperScheme::MinPlane)), 0.7, 1e-6);
    EXPECT_NEAR(glm::length(interpolateVectors(corners, 1, middle, PaperScheme::Longer)), 0.7, 1e-6);
    // One plane x = 0.25 of a leaf of edge 2: all schemes agree.
    for (int k = 0; k < 8; ++k) corners.x[k] = 0.25f - (k < 4 ? 0.0f : 2.0f);
    for (const PaperScheme scheme : {PaperScheme::Trilinear, PaperScheme::MinPlane, PaperScheme::Longer})
        EXPECT_NEAR(interpolateVectors(corners, 2, {0.5f, 0.3f, 0.8f}, scheme).x, -0.75, 1e-6);
}

TEST(Trilinear, AlongARayIsItsCubic) {
    std::mt19937_64 random(4);
    std::uniform_real_distribution<float> unit(-1, 1);
    for (int i = 0; i < 2000; ++i) {
        std::array<float, 8> v;
        for (float& value : v) value = unit(random);
        const Trilinear f(v);
        const glm::vec3 p = 0.5f + 0.5f * glm::vec3(unit(random), unit(random), unit(random));
        const glm::vec3 d(unit(random), unit(random), unit(random));
        double blended = 0;
        for (int k = 0; k < 8; ++k)
            blended += double(v[k]) * (k & 4 ? p.x : 1 - p.x) * (k & 2 ? p.z : 1 - p.z) * (k & 1 ? p.y : 1 - p.y);
        EXPECT_NEAR(f.at(p), blended, 1e-5);
        const Cubic cubic = cubicAlong(f, p, d);
        for (const float u : {0.0f, 0.3f, 1.0f}) EXPECT_NEAR(cubic.at(u), f.at(p + u * d), 2e-5);
        // The first root, against small steps.
        const float root = firstRoot(cubic, 1);
        float walked = std::numeric_limits<float>::infinity();
        for (int step = 0; step < 2000 && std::isinf(walked); ++step)
            if ((cubic.at(float(step) / 2000) < 0) != (cubic.at(float(step + 1) / 2000) < 0))
                walked = float(step) / 2000;
        if (std::isinf(walked)) continue;
        EXPECT_LE(root, walked + 6e-4f) << i;
        EXPECT_NEAR(cubic.at(root), 0, 2e-6) << i;
    }
}

TEST(Contour, HoldsItsPoints) {
    std::mt19937_64 random(6);
    std::uniform_real_distribution<double> unit(-0.5, 0.5);
    for (int i = 0; i < 500; ++i) {
        const glm::dvec3 n = glm::normalize(glm::dvec3(unit(random), unit(random), unit(random)));
        const double offset = 0.3 * unit(random);
        std::vector<glm::dvec3> points;
        for (int k = 0; k < 6; ++k) {
            const glm::dvec3 p(unit(random), unit(random), unit(random));
            const glm::dvec3 onPlane = p - (glm::dot(p, n) - offset) * n;
            if (std::max({std::abs(onPlane.x), std::abs(onPlane.y), std::abs(onPlane.z)}) <= 0.5)
                points.push_back(onPlane);
        }
        if (points.empty()) continue;
        const Contour slab = unpackContour(packContour(points, {n, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}));
        for (const glm::dvec3& p : points) {
            const double at = glm::dot(p, glm::dvec3(slab.normal));
            EXPECT_GE(at, slab.low - 1e-4);
            EXPECT_LE(at, slab.high + 1e-4);
        }
        EXPECT_LT((slab.high - slab.low) / glm::length(slab.normal), 0.09) << i;
    }
}

TEST(GridPoints, FindsWhatWasAddedOnly) {
    GridPoints<int> points;
    for (int i = 0; i < 3000; ++i) points.add({i % 20, i / 20 % 20, i % 7});
    points.fill(3, [](glm::ivec3 p) { return p.x + 100 * p.y + 10000 * p.z; });
    for (int i = 0; i < 3000; ++i) {
        const int* found = points.find({i % 20, i / 20 % 20, i % 7});
        ASSERT_TRUE(found);
        EXPECT_EQ(*found, i % 20 + 100 * (i / 20 % 20) + 10000 * (i % 7));
    }
    EXPECT_EQ(points.find({20, 0, 0}), nullptr);
}

TEST(WorkHistogram, MeansAndQuantiles) {
    WorkHistogram a, b;
    for (uint32_t i = 1; i <= 50; ++i) a.add(i);
    for (uint32_t i = 51; i <= 100; ++i) b.add(i);
    a.merge(b);
    EXPECT_EQ(a.rays(), 100u);
    EXPECT_EQ(a.mean(), 50.5);
    EXPECT_EQ(a.quantile(0.95), 95u);
    EXPECT_EQ(a.quantile(0.99), 99u);
    EXPECT_EQ(a.quantile(1), 100u);
    EXPECT_EQ(WorkHistogram().mean(), 0);
}

}  // namespace
}  // namespace vcp
