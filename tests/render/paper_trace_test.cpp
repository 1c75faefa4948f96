// Datasets of the method `paper`: what the GPU shows, ray by ray, against the same march on the CPU.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "builder/paper/paper_file.h"
#include "streaming/page_source.h"
#include "tests/support/paper_subvolumes.h"
#include "tests/support/renderer_fixture.h"
#include "tests/support/test_folder.h"
#include "tests/support/test_meshes.h"
#include "viewer/bench/peers/grid_rays.h"
#include "viewer/bench/peers/paper_dataset.h"
#include "viewer/bench/peers/subvolume_caster.h"

namespace vcp {
namespace {

constexpr uint32_t kWidth = 160, kHeight = 120;

/// A mesh, its octree with finest cells of edge `cell`, and the octree as a dataset.
struct PaperScene {
    PaperScene(IndexedMesh from, double cell, PaperOptions options = {}) : mesh(std::move(from)), bvh(mesh) {
        auto made = PaperCaster::create(bvh, options, {.cell = cell, .threads = 2});
        EXPECT_TRUE(made);
        caster = std::make_unique<PaperCaster>(std::move(*made));
        dataset = *paperDataset(*caster, mesh);
    }
    [[nodiscard]] Camera camera(glm::dvec3 forward, double nearer = 1) const {
        Camera camera = fitCamera(bvh.low(), bvh.high(), forward, {0.1, 1, 0.2}, 0.6, double(kWidth) / kHeight);
        const glm::dvec3 middle = 0.5 * (bvh.low() + bvh.high());
        camera.eye = middle + nearer * (camera.eye - middle);
        return camera;
    }

    IndexedMesh mesh;
    MeshBvh bvh;
    std::unique_ptr<PaperCaster> caster;
    PaperDataset dataset;
};

IndexedMesh ball(glm::dvec3 centre = {0.31, -0.17, 0.23}, double radius = 1) {
    return test::sphereMesh(centre, radius, 48);
}

struct Comparison {
    uint64_t hits = 0, different = 0, stepsDifferent = 0;
    double depthMean = 0;  // cells
};

class PaperTrace : public test::RendererFixture {
protected:
    void open(const PaperScene& scene) {
        const auto opened = renderer_->open(scene.dataset.dataset, scene.dataset.source);
        ASSERT_TRUE(opened) << opened.error().line();
    }
    /// Hit or miss, more than a tenth of a cell apart, and unequal numbers of samples.
    Comparison compare(const PaperScene& scene, const FrameRequest& request) { return compare(*scene.caster, request); }
    template <class Caster>
    Comparison compare(Caster caster, FrameRequest request) {
        caster.setMarch(request.march);
        request.shading.mode = ShadingMode::Steps;
        draw(request);
        const auto depth = renderer_->readDepth();
        const auto steps = renderer_->readWork();
        EXPECT_TRUE(depth && steps);
        Comparison c;
        for (uint32_t y = 0; y < kHeight; ++y)
            for (uint32_t x = 0; x < kWidth; ++x) {
                const CameraRay ray = cameraRay(request.camera, kWidth, kHeight, x + 0.5, y + 0.5);
                const GridRay grid =
                    GridRays::along(caster.frame().gridFromWorld(ray.origin), ray.direction, caster.frame().cells());
                RayWork work;
                const GridHit expected = caster.cast(grid, work);
                const size_t at = size_t{y} * kWidth + x;
                const double shown = double((*depth)[at]) / caster.frame().cell,
                             known = grid.tStart + double(expected.t);
                const bool both = std::isfinite(shown) && std::isfinite(known);
                const bool same =
                    both ? std::abs(shown - known) < 0.1
                         : std::isinf(shown) == std::isinf(known) && std::isnan(shown) == std::isnan(known);
                c.hits += both ? 1 : 0;
                c.different += same ? 0 : 1;
                c.stepsDifferent += (*steps)[at] != work.steps ? 1 : 0;
                if (both && same) c.depthMean += std::abs(shown - known);
            }
        c.depthMean /= double(std::max<uint64_t>(c.hits, 1));
        return c;
    }
    template <class Scene>
    void expectSame(const Scene& scene, const FrameRequest& request) {
        const Comparison c = compare(scene, request);
        EXPECT_GT(c.hits, 1000u);
        // Single precision decides otherwise at outlines, and where a distance is just epsilon.
        EXPECT_LE(c.different, kWidth * kHeight / 500);
        EXPECT_LE(c.stepsDifferent, kWidth * kHeight / 50);
        EXPECT_LT(c.depthMean, 2e-3);
    }
};

class PaperTraceAccess : public PaperTrace, public testing::WithParamInterface<PageAccess> {};

TEST_P(PaperTraceAccess, EveryCameraShowsWhatTheCpuDoes) {
    RendererOptions options;
    options.access = GetParam();
    start(options);
    const PaperScene scene(ball(), 1.0 / 16), far(ball({483920.5, 5430128.25, 312}, 0.05), 1.0 / 320);
    for (const PaperScene* shown : {&scene, &far}) {
        open(*shown);
        for (const glm::dvec3 forward : {glm::dvec3(-0.3, -0.5, -1), glm::dvec3(1, 0, 0), glm::dvec3(1, 1, 1)}) {
            FrameRequest request = test::requestOf(shown->camera(forward), kWidth, kHeight);
            expectSame(*shown, request);
            request.camera = shown->camera(forward, 0.5);
            expectSame(*shown, request);
        }
    }
    FrameRequest parallel = test::requestOf(scene.camera({0.5, -0.3, 0.7}), kWidth, kHeight);
    parallel.camera.projection = Projection::Orthographic;
    open(scene);
    expectSame(scene, parallel);
}
INSTANTIATE_TEST_SUITE_P(Access, PaperTraceAccess, testing::Values(PageAccess::TexelBuffer, PageAccess::StorageBuffer),
                         [](const auto& named) {
                             return named.param == PageAccess::TexelBuffer ? "Texel" : "Storage";
                         });

TEST_F(PaperTrace, EveryRuleIsTheCpus) {
    start();
    PaperOptions plain, octahedral;
    octahedral.packing = PaperPacking::Octahedral;
    octahedral.mergeThreshold = -1;
    octahedral.growRounds = CornerOctreeOptions::kExactPoints;
    for (const PaperOptions& options : {plain, octahedral}) {
        IndexedMesh mesh = test::boxMesh(glm::dvec3(-1), glm::dvec3(1), 4);
        test::rotate(mesh, {0, 0, 0}, {1, 2, 3}, 0.7);
        const PaperScene scene(std::move(mesh), 1.0 / 8, options);
        open(scene);
        FrameRequest request = test::requestOf(scene.camera({-0.3, -0.5, -1}), kWidth, kHeight);
        expectSame(scene, request);
        if (options != plain) continue;
        for (const PaperMarch march :
             {PaperMarch{.epsilon = 0.1f, .scheme = PaperScheme::Trilinear},
              PaperMarch{.scheme = PaperScheme::MinPlane, .step = PaperStep::Distance},
              PaperMarch{.step = PaperStep::Onward}, PaperMarch{.back = false, .cached = false}}) {
            request.march = march;
            expectSame(scene, request);
        }
    }
}

/// A file in subvolumes of 16 cells, and the same mesh as one octree.
struct SubvolumeScene {
    SubvolumeScene() : folder("vcp_paper_trace_test"), one(test::torusMesh({0.3, 0.2, 0.1}, 2, 0.8, 90, 40), kCell) {
        const std::filesystem::path file = test::buildSubvolumes(folder, one.mesh, kCell);
        const std::shared_ptr<const ByteReader> reader = *openFile(file);
        dataset = std::make_shared<const Dataset>(*readDataset(*reader));
        source = std::make_shared<const FilePageSource>(reader, dataset);
        caster.emplace(*SubvolumeCaster::open(file, {}));
    }
    static constexpr double kCell = 0.05;

    TestFolder folder;
    PaperScene one;
    std::shared_ptr<const Dataset> dataset;
    std::shared_ptr<const PageSource> source;
    std::optional<SubvolumeCaster> caster;
};

TEST_F(PaperTrace, SubvolumesAreWhatTheCpuShows) {
    start();
    const SubvolumeScene scene;
    ASSERT_TRUE(renderer_->open(scene.dataset, scene.source));
    FrameRequest request = test::requestOf(scene.one.camera({-0.3, -0.5, -1}, 0.6), kWidth, kHeight);
    uint64_t few = 0;
    for (const float reach : {0.0f, 0.25f, 0.5f, 1e6f}) {
        request.march.reach = reach;
        expectSame(*scene.caster, request);
        const uint64_t resident = renderer_->settle(request)->pagesInCut;
        EXPECT_GE(resident, few) << "the farther, the more subvolumes are near";
        few = resident;
        EXPECT_TRUE(reach > 0 || resident == 1) << "that of the larger cells";
    }
    EXPECT_GT(few, 50u);
    request.camera = scene.one.camera({1, 0.2, 0.4}, 0.25);
    request.march = {};
    expectSame(*scene.caster, request);
}

TEST_F(PaperTrace, NearSubvolumesShowWhatTheOnePageDoes) {
    start();
    const SubvolumeScene scene;
    FrameRequest request = test::requestOf(scene.one.camera({-0.3, -0.5, -1}), kWidth, kHeight);
    request.march.reach = 1e6f;
    open(scene.one);
    draw(request);
    const auto whole = renderer_->readDepth();
    ASSERT_TRUE(renderer_->open(scene.dataset, scene.source));
    draw(request);
    const auto cut = renderer_->readDepth();
    ASSERT_TRUE(whole && cut);
    uint64_t hits = 0, different = 0;
    for (size_t i = 0; i < whole->size(); ++i) {
        const bool both = std::isfinite((*whole)[i]) && std::isfinite((*cut)[i]);
        hits += both ? 1 : 0;
        const bool isSame = both ? std::abs((*whole)[i] - (*cut)[i]) < 0.2 * SubvolumeScene::kCell
                                 : std::isinf((*whole)[i]) == std::isinf((*cut)[i]);
        different += isSame ? 0 : 1;
    }
    EXPECT_GT(hits, 3000u);
    EXPECT_LE(different, kWidth * kHeight / 200) << "outlines: the rays start elsewhere";
}

TEST_F(PaperTrace, OnlyItsOwnPassesAreMade) {
    start();
    const PaperScene scene(ball(), 1.0 / 8);
    open(scene);
    FrameRequest request = test::requestOf(scene.camera({0, 0, -1}), kWidth, kHeight);
    const FrameStats stats = draw(request);
    EXPECT_EQ(stats.pipelines, 3u) << "tiles, the march, shading";
    EXPECT_GT(stats.hitPixels, 1000u);
    EXPECT_EQ(draw(request).pipelines, 3u);
    // Rays of light and caps there are none; they change nothing.
    const Picture plain = *renderer_->readPicture();
    request.shading.shadows = true;
    request.shading.occlusionRays = 4;
    request.sectionCaps = Caps::Closed;
    EXPECT_EQ(draw(request).pipelines, 3u);
    EXPECT_EQ(*renderer_->readPicture(), plain);
    // The half behind a plane is gone.
    request.sections = {{{1, 0, 0}, 0.5 * (scene.bvh.low().x + scene.bvh.high().x)}};
    EXPECT_LT(draw(request).hitPixels, stats.hitPixels * 3 / 4);
}

TEST_F(PaperTrace, NormalsFaceTheViewerAndAreTheSpheres) {
    start();
    const glm::dvec3 centre(0.31, -0.17, 0.23);
    const PaperScene scene(ball(centre), 1.0 / 24);
    open(scene);
    const FrameRequest request = test::requestOf(scene.camera({-0.3, -0.5, -1}), kWidth, kHeight);
    draw(request);
    const auto depth = renderer_->readDepth();
    const auto normals = renderer_->readNormals();
    ASSERT_TRUE(depth && normals);
    uint64_t hits = 0, wrong = 0;
    for (uint32_t y = 0; y < kHeight; ++y)
        for (uint32_t x = 0; x < kWidth; ++x) {
            const size_t at = size_t{y} * kWidth + x;
            if (!std::isfinite((*depth)[at])) continue;
            ++hits;
            const CameraRay ray = cameraRay(request.camera, kWidth, kHeight, x + 0.5, y + 0.5);
            const glm::dvec3 outward = glm::normalize(ray.origin + double((*depth)[at]) * ray.direction - centre);
            wrong += glm::dot(outward, glm::dvec3((*normals)[at])) < 0.95 ? 1 : 0;
        }
    EXPECT_GT(hits, 1000u);
    EXPECT_LE(wrong, hits / 50) << "the outline, where a ray is within epsilon and never meets the sphere";
}

TEST_F(PaperTrace, WorkIsCounted) {
    start();
    const PaperScene scene(ball(), 1.0 / 8);
    open(scene);
    FrameRequest request = test::requestOf(scene.camera({0, 0, -1}), kWidth, kHeight);
    PaperCaster caster = *scene.caster;
    uint64_t cells = 0, fetches = 0;
    for (uint32_t y = 0; y < kHeight; ++y)
        for (uint32_t x = 0; x < kWidth; ++x) {
            const CameraRay ray = cameraRay(request.camera, kWidth, kHeight, x + 0.5, y + 0.5);
            RayWork work;
            (void)caster.cast(
                GridRays::along(caster.frame().gridFromWorld(ray.origin), ray.direction, caster.frame().cells()), work);
            cells += work.cells;
            fetches += work.fetches;
        }
    const auto sum = [&](ShadingMode mode) {
        request.shading.mode = mode;
        draw(request);
        const auto work = renderer_->readWork();
        EXPECT_TRUE(work);
        uint64_t total = 0;
        for (const uint32_t count : *work) total += count;
        return double(total);
    };
    EXPECT_NEAR(sum(ShadingMode::Cells), double(cells), 0.002 * double(cells));
    EXPECT_NEAR(sum(ShadingMode::Fetches), double(fetches), 0.002 * double(fetches));
}

}  // namespace
}  // namespace vcp
