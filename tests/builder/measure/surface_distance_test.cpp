// The measured two-sided distance, on pages made from formulas and meshes that are a known distance away.
#include "builder/measure/surface_distance.h"

#include <gtest/gtest.h>

#include "tests/support/analytic_page.h"
#include "tests/support/test_meshes.h"

namespace vcp {
namespace {

const glm::dvec3 kCentre(16.3, 15.8, 16.1);

PageCache sphereCache(double radius, double errorCells = 0.05) {
    test::AnalyticOptions o;
    o.levels = 2;
    o.errorCells = errorCells;
    auto made = test::analyticDataset(test::sphere(kCentre, radius), o);
    auto cache = PageCache::fromPages(std::move(made.dataset), std::move(made.pages));
    EXPECT_TRUE(cache.ok()) << cache.error().line();
    return std::move(*cache);
}

SurfaceDistance measured(const PageCache& cache, const IndexedMesh& mesh, unsigned threads = 2) {
    const MeshBvh bvh(mesh);
    SurfaceDistanceOptions options;
    options.samples = 8000;
    options.threads = threads;
    const auto result = measureSurfaceDistance(cache, bvh, options);
    EXPECT_TRUE(result.ok()) << result.error().line();
    return *result;
}

TEST(SurfaceDistance, SphereAgainstItsMesh) {
    const SurfaceDistance d = measured(sphereCache(11), test::sphereMesh(kCentre, 11, 300));
    EXPECT_LT(d.meshToSurface.p50, 2e-3);
    EXPECT_LT(d.meshToSurface.max, 1e-2);
    EXPECT_LT(d.surfaceToMesh.p50, 2e-3);
    EXPECT_LT(d.surfaceToMesh.max, 1e-2);
    EXPECT_EQ(d.cell, 1);
    EXPECT_FLOAT_EQ(float(d.certifiedErrorMax), 0.05f);
    EXPECT_GT(d.samples, 12000u);
}

TEST(SurfaceDistance, NormalsAreComparedWithThoseOfTheNearestTriangles) {
    // Facets of 600 meridians and 300 parallels turn 0.6 degrees from one to the next, those of 48 and 24 turn 7.5: the
    // ball's normals turn away by at most some 0.7 of that, at a facet's corners.
    const Quantiles fine = measured(sphereCache(11), test::sphereMesh(kCentre, 11, 300)).normalDegrees;
    EXPECT_GT(fine.p50, 0.05);
    EXPECT_LT(fine.p99, 1);
    const Quantiles coarse = measured(sphereCache(11), test::sphereMesh(kCentre, 11, 24)).normalDegrees;
    EXPECT_GT(coarse.p50, 1);
    EXPECT_LT(coarse.p50, 4);
    EXPECT_GT(coarse.p95, 2.5);
    EXPECT_LT(coarse.p99, 7);
}

TEST(SurfaceDistance, OffsetIsMeasuredBothWays) {
    const SurfaceDistance d = measured(sphereCache(11.25), test::sphereMesh(kCentre, 11, 300));
    EXPECT_NEAR(d.meshToSurface.p50, 0.25, 3e-3);
    EXPECT_NEAR(d.surfaceToMesh.p50, 0.25, 3e-3);
    EXPECT_NEAR(d.meshToSurface.max, 0.25, 1e-2);
    EXPECT_NEAR(d.surfaceToMesh.max, 0.25, 1e-2);
}

TEST(SurfaceDistance, MissingAndAddedPartsShowOnTheirSide) {
    IndexedMesh more = test::sphereMesh(kCentre, 11, 100);
    test::append(more, test::sphereMesh(kCentre, 3, 20));
    // The mesh has a part that the surface lacks: eight cells away from it.
    const SurfaceDistance lacking = measured(sphereCache(11), more);
    EXPECT_NEAR(lacking.meshToSurface.max, 8, 0.05);
    EXPECT_LT(lacking.surfaceToMesh.max, 0.02);
    EXPECT_NEAR(glm::distance(lacking.worstOfMesh, kCentre), 3, 0.05);
    // And half of the mesh is not there.
    IndexedMesh half = test::sphereMesh(kCentre, 11, 100);
    std::erase_if(half.triangles, [&](const auto& t) { return half.positions[t[0]].z > kCentre.z; });
    const SurfaceDistance added = measured(sphereCache(11), half);
    EXPECT_GT(added.surfaceToMesh.max, 10);
    EXPECT_LT(added.meshToSurface.max, 0.02);
    EXPECT_GT(added.worstOfSurface.z, kCentre.z + 5);
}

TEST(SurfaceDistance, SameForAnyThreads) {
    const PageCache cache = sphereCache(11);
    const IndexedMesh mesh = test::sphereMesh(kCentre, 11, 60);
    const SurfaceDistance one = measured(cache, mesh, 1), four = measured(cache, mesh, 4);
    EXPECT_EQ(one.samples, four.samples);
    EXPECT_EQ(one.meshToSurface.p99, four.meshToSurface.p99);
    EXPECT_EQ(one.surfaceToMesh.max, four.surfaceToMesh.max);
    EXPECT_EQ(one.worstOfMesh, four.worstOfMesh);
    EXPECT_EQ(one.worstOfSurface, four.worstOfSurface);
}

TEST(SurfaceDistance, CancelsAndRefuses) {
    const PageCache cache = sphereCache(11);
    const IndexedMesh mesh = test::sphereMesh(kCentre, 11, 20), empty;
    SurfaceDistanceOptions options;
    options.progress = [](double) { return false; };
    const auto cancelled = measureSurfaceDistance(cache, MeshBvh(mesh), options);
    ASSERT_FALSE(cancelled.ok());
    EXPECT_EQ(cancelled.error().code, ErrorCode::Cancelled);
    EXPECT_FALSE(measureSurfaceDistance(cache, MeshBvh(empty), {}).ok());
}

}  // namespace
}  // namespace vcp
