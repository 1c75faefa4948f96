// Scenes whose answer is known, as meshes through the real builder: every ray in its class, no hole, no hit
// farther from the mesh than the certified error, at every level.
#include <algorithm>
#include <bit>
#include <cmath>

#include <gtest/gtest.h>

#include "builder/measure/ray_classes.h"
#include "octree/reference_caster.h"
#include "tests/support/built_mesh.h"

namespace vcp {
namespace {

class Scene : public test::BuiltMesh {
public:
    using BuiltMesh::BuiltMesh;

    /// Judges pictures of 8 cameras of a level.
    RayClassTable look(uint32_t level, int pixels, CastOptions options = {}) const {
        const auto cut = cutAtLevel(cache().dataset(), level);
        const auto caster = ReferenceCaster::create(cache(), cut, options);
        EXPECT_TRUE(caster.ok());
        const double cell = cache().dataset().cellOf(level);
        const RayJudge judge(bvh(), cell, cache().dataset().header.level[level].certifiedError);
        const glm::dvec3 centre = 0.5 * (bvh().low() + bvh().high());
        const double radius = 0.5 * glm::distance(bvh().low(), bvh().high());
        RayClassTable table;
        for (int view = 0; view < 8; ++view) {
            // The first three along axes: rays in the planes of the grid.
            glm::dvec3 back(0);
            if (view < 3)
                back[view] = 1;
            else
                back = glm::normalize(glm::dvec3(std::sin(view * 2.4), std::cos(view * 2.4), (view - 5) * 0.4));
            const glm::dvec3 right =
                glm::normalize(glm::cross(std::abs(back.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0), back));
            const glm::dvec3 up = glm::cross(back, right);
            const bool parallel = view % 2 == 0;
            for (int y = 0; y <= pixels; ++y)
                for (int x = 0; x <= pixels; ++x) {
                    const glm::dvec3 side = radius * ((2.0 * x / pixels - 1) * right + (2.0 * y / pixels - 1) * up);
                    const glm::dvec3 eye = centre + 3.5 * radius * back + (parallel ? side : glm::dvec3(0));
                    const glm::dvec3 d = parallel ? -back : glm::normalize(side - 3.5 * radius * back);
                    const auto hit = caster->cast({eye, d});
                    table.add(judge.judge(
                        eye, d,
                        hit ? std::optional(SurfaceHit{hit->t, hit->normal, hit->certifiedError}) : std::nullopt));
                }
        }
        return table;
    }

    void expectRight(int pixels = 120) const {
        ASSERT_TRUE(ok());
        for (uint32_t level = 0; level < levels(); ++level) {
            SCOPED_TRACE(testing::Message() << "level " << level);
            for (const bool single : {false, true}) {
                const RayClassTable table = look(level, pixels, {.singlePrecision = single, .steps = single ? 8 : 64});
                EXPECT_EQ(table.holes(), 0u) << (single ? "in float" : "");
                EXPECT_EQ(table.tooFar(), 0u) << (single ? "in float" : "");
                EXPECT_EQ(table.count(RayClass::Unresolved), 0u);
                EXPECT_GT(table.count(RayClass::Hit), 0u);
                EXPECT_LE(table.overCertifiedMax(), 1.01);
            }
        }
    }

    void expectMeasuredWithinCertified() const { test::expectWithinCertified(*this, 4000); }
};

TEST(AnalyticScenes, RotatingSphere) {
    for (const double angle : {0.0, 0.4, 1.1}) {
        IndexedMesh mesh = test::sphereMesh({0, 0, 0}, 1, 40);
        test::rotate(mesh, {0, 0, 0}, {1, 2, 3}, angle);
        const Scene scene(mesh, 1.0 / 24);
        scene.expectRight(80);
        scene.expectMeasuredWithinCertified();
    }
}

TEST(AnalyticScenes, Torus) {
    const Scene scene(test::torusMesh({10, -3, 5}, 1, 0.35, 90, 40), 1.0 / 32);
    scene.expectRight();
    scene.expectMeasuredWithinCertified();
}

TEST(AnalyticScenes, ThinPlate) {
    // A fiftieth of a cell thick, askew.
    IndexedMesh mesh = test::boxMesh({-1, -0.6, 0}, {1, 0.6, 0.001}, 12);
    test::rotate(mesh, {0, 0, 0}, {1, 0.5, 0.2}, 0.5);
    const Scene scene(mesh, 0.05);
    scene.expectRight();
    scene.expectMeasuredWithinCertified();
}

TEST(AnalyticScenes, Wire) {
    // Half a cell thick, winding up.
    const Scene scene(test::gridSurface(12, 200, false,
                                        [](double u, double v) {
                                            const double turn = v * 3 * test::kTwoPi, around = u * test::kTwoPi;
                                            const double r = 1 + 0.012 * std::cos(around);
                                            return glm::dvec3(r * std::cos(turn), r * std::sin(turn),
                                                              v + 0.012 * std::sin(around));
                                        }),
                      0.05);
    scene.expectRight(200);
    scene.expectMeasuredWithinCertified();
}

TEST(AnalyticScenes, TouchingSpheres) {
    IndexedMesh mesh = test::sphereMesh({-1, 0, 0}, 1, 40);
    test::append(mesh, test::sphereMesh({1, 0, 0}, 1, 40));
    const Scene scene(mesh, 1.0 / 20);
    scene.expectRight();
    scene.expectMeasuredWithinCertified();
}

TEST(AnalyticScenes, AxisAlignedOnGridPlanes) {
    // Its faces, edges and many vertices lie on planes of the grid; cameras look along them.
    const Scene scene(test::boxMesh({0, 0, 0}, {2, 2, 2}, 8), 1.0 / 16);
    scene.expectRight(128);
    scene.expectMeasuredWithinCertified();
}

TEST(AnalyticScenes, OriginFarAway) {
    IndexedMesh mesh = test::sphereMesh({0, 0, 0}, 1, 30);
    for (glm::dvec3& p : mesh.positions) p += glm::dvec3(483920.25, 3792000.5, 1200.125);
    const Scene scene(mesh, 1.0 / 16);
    scene.expectRight(80);
    scene.expectMeasuredWithinCertified();
}

TEST(AnalyticScenes, OpenBorderAndSlivers) {
    // An open tube cut slantwise, made of needles of aspect 1000.
    const Scene scene(test::gridSurface(60, 1, false,
                                        [](double u, double v) {
                                            const double a = u * test::kTwoPi;
                                            return glm::dvec3(0.1 * std::cos(a), 0.1 * std::sin(a),
                                                              5 * v + 0.03 * std::cos(a));
                                        }),
                      0.04);
    scene.expectRight(160);
    scene.expectMeasuredWithinCertified();
}

/// Clearances are promises that the GPU steps by: no surface in an empty node's grown box.
class ClearanceCheck {
public:
    ClearanceCheck(const PageCache& cache, const MeshBvh& bvh) : cache_(cache), bvh_(bvh) {}

    /// The largest overlap of any clearance with the mesh, in cells; 0 where all are honest.
    double worst(uint64_t page) {
        worst_ = 0;
        visit(page, cache_.view(page)->header.root, glm::dvec3(0),
              double(uint64_t{1} << cache_.dataset().header.log2Cells));
        return worst_;
    }

private:
    void visit(uint64_t page, uint32_t node, glm::dvec3 lowest, double edge) {
        if (nodeType(node) == kNodeInternal)
            for (uint32_t o = 0; o < 8; ++o)
                visit(page, cache_.view(page)->nodes[8 * (node & kNodePayloadMask) + o],
                      lowest + glm::dvec3(o & 1, o >> 1 & 1, o >> 2) * (edge / 2), edge / 2);
        if (nodeType(node) != kNodeEmpty) return;
        const Dataset& dataset = cache_.dataset();
        const PageEntry& entry = dataset.pages[page];
        const double cell = dataset.cellOf(entry.level), clearance = nodeClearance(node);
        const double side = double(uint64_t{1} << dataset.header.log2Cells);
        const glm::dvec3 low = glm::max(lowest - clearance, glm::dvec3(0)),
                         high = glm::min(lowest + edge + clearance, glm::dvec3(side));
        const glm::dvec3 origin = dataset.originOf(entry);
        // Points of the grown box, its corners and faces among them, are outside the mesh by their distance.
        for (int i = 0; i < 27; ++i) {
            const glm::dvec3 p = low + (high - low) * (glm::dvec3(i % 3, i / 3 % 3, i / 9) / 2.0);
            const auto nearest = bvh_.nearestPoint(origin + p * cell, entry.certifiedError);
            if (!nearest) continue;
            const glm::dvec3 q = (nearest->point - origin) / cell;
            const glm::dvec3 in = glm::min(q - low, high - q);
            worst_ = std::max(worst_, std::min({in.x, in.y, in.z}) - entry.certifiedError / cell);
        }
    }

    const PageCache& cache_;
    const MeshBvh& bvh_;
    double worst_ = 0;
};

TEST(AnalyticScenes, ClearancesAreHonest) {
    const Scene scene(test::torusMesh({10, -3, 5}, 1, 0.35, 90, 40), 1.0 / 32);
    ASSERT_TRUE(scene.ok());
    ClearanceCheck check(scene.cache(), scene.bvh());
    for (uint64_t page = 0; page < scene.cache().dataset().pages.size(); ++page)
        EXPECT_LE(check.worst(page), 1e-6) << "page " << page;
}

}  // namespace
}  // namespace vcp
