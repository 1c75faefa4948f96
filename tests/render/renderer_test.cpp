// The whole renderer against the reference ray-caster, with validation layers on: every test ends with no
// message.
#include "render/view/renderer.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <map>
#include <mutex>
#include <numeric>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include "render/frame_setup.h"
#include "tests/support/reference_comparison.h"
#include "tests/support/test_files.h"
#include "tests/support/test_folder.h"

namespace vcp {
namespace {

using test::cameras;
using test::compare;
using test::Comparison;
using test::NamedCamera;
using test::requestOf;
using test::Scene;

class RendererTest : public test::RendererFixture {};

class RendererAgainstReference : public RendererTest, public testing::WithParamInterface<PageAccess> {};

TEST_P(RendererAgainstReference, EveryCamera) {
    RendererOptions options;
    options.access = GetParam();
    start(options);
    const Scene scenes[] = {test::sphereScene(), test::torusScene(), test::cubeScene(0), test::cubeScene(2),
                            test::sphereScene(2, {483920.5, 3792000.25, 1200}, 1.0 / 1024, 1),
                            // Leaves of several strips; of many triangles; entries of 32 bits.
                            test::wavesScene(9, 4), test::wavesScene(12, 0), test::wavesScene(130, 5)};
    for (const Scene& scene : scenes) {
        show(scene);
        uint64_t hits = 0;
        for (const NamedCamera& named : cameras(scene)) {
            SCOPED_TRACE(scene.name + ", " + named.name);
            const FrameRequest request = requestOf(named.camera);
            const FrameStats stats = draw(request);
            const Comparison c = compare(*renderer_, scene, request);
            hits += c.hit;
            EXPECT_EQ(stats.rays, uint64_t{request.width} * request.height);
            EXPECT_LE(c.missed + c.wrong, 2u) << "single precision may decide differently at an outline, no more";
            EXPECT_LE(stats.hitPixels, c.hit + c.wrong + 2);
            EXPECT_GE(stats.hitPixels + 2, c.hit + c.wrong);
            // Far away, single precision along the ray is what limits depth.
            const double reach =
                glm::length(named.camera.eye - (scene.boxMin + scene.boxMax) * 0.5) / scene.dataset->header.cell;
            EXPECT_LT(c.depthSum / double(std::max<uint64_t>(c.hit, 1)), 2e-4 + 1e-7 * reach);
            EXPECT_LT(c.depthMax, 0.3) << "grazing rays, a few steps of false position";
        }
        EXPECT_GT(hits, 10000u) << "the cameras must see something";
    }
}

INSTANTIATE_TEST_SUITE_P(Access, RendererAgainstReference,
                         testing::Values(PageAccess::TexelBuffer, PageAccess::StorageBuffer), [](const auto& named) {
                             return named.param == PageAccess::TexelBuffer ? "Texel" : "Storage";
                         });

TEST_F(RendererTest, BeamChangesNoPixel) {
    start();
    for (const Scene& scene : {test::torusScene(), test::cubeScene(2)}) {
        show(scene);
        for (const NamedCamera& named : cameras(scene)) {
            SCOPED_TRACE(scene.name + ", " + named.name);
            FrameRequest request = requestOf(named.camera, 203, 117);  // tiles cut at both edges
            const FrameStats with = draw(request);
            const auto depthWith = renderer_->readDepth();
            const auto pictureWith = renderer_->readPicture();
            request.beam = false;
            const FrameStats without = draw(request);
            EXPECT_EQ(*renderer_->readDepth(), *depthWith);
            EXPECT_EQ(*renderer_->readPicture(), *pictureWith);
            EXPECT_EQ(with.hitPixels, without.hitPixels);
            EXPECT_EQ(without.tracedRays, without.rays);
            EXPECT_LE(with.tracedRays, with.rays);
        }
    }
}

TEST_F(RendererTest, EmptyTilesAreNotTraced) {
    start();
    const Scene scene = test::sphereScene();
    show(scene);
    Camera camera = fitCamera(scene.boxMin, scene.boxMax, {-0.3, -0.5, -1}, {0, 1, 0}, 0.6, 4.0 / 3);
    const FrameStats stats = draw(requestOf(camera, 640, 480));
    EXPECT_GT(stats.hitPixels, 10000u);
    EXPECT_LT(stats.tracedRays, stats.hitPixels * 5 / 4);
    camera.forward = -camera.forward;
    const FrameStats away = draw(requestOf(camera, 640, 480));
    EXPECT_EQ(away.hitPixels, 0u);
    EXPECT_EQ(away.tracedRays, 0u);
}

TEST_F(RendererTest, SameInputSameBytes) {
    start();
    const Scene scene = test::torusScene();
    show(scene);
    const FrameRequest request = requestOf(cameras(scene)[0].camera, 320, 200);
    draw(request);
    const auto first = renderer_->readPicture();
    draw(requestOf(cameras(scene)[3].camera, 100, 100));
    draw(request);
    EXPECT_EQ(*renderer_->readPicture(), *first);
    start();
    show(scene);
    draw(request);
    EXPECT_EQ(*renderer_->readPicture(), *first) << "another renderer";
}

TEST_F(RendererTest, BothWaysToReadPagesGiveTheSamePicture) {
    const Scene scene = test::torusScene();
    std::vector<Picture> pictures;
    for (const PageAccess access : {PageAccess::TexelBuffer, PageAccess::StorageBuffer}) {
        RendererOptions options;
        options.access = access;
        start(options);
        EXPECT_EQ(renderer_->access(), access);
        show(scene);
        draw(requestOf(cameras(scene)[0].camera, 320, 200));
        pictures.push_back(*renderer_->readPicture());
    }
    EXPECT_EQ(pictures[0], pictures[1]);
}

TEST_F(RendererTest, WithoutColourNothingIsAllocatedForIt) {
    test::AnalyticOptions o;
    o.levels = 2;
    const auto made = test::analyticDataset(test::sphere(glm::dvec3(16), 12), o);
    Scene painted;
    test::paint(painted, made, 0xff2040e0);  // RGBA bytes e0 40 20 ff
    const FrameRequest request = requestOf(cameras(painted)[0].camera);

    start();
    show(painted);
    const FrameStats with = draw(request);
    EXPECT_GT(with.colourBytes, 0u);
    const auto middle = [&] {
        const Picture picture = *renderer_->readPicture();
        const uint8_t* p = &picture.rgba[4 * (size_t{60} * 160 + 80)];
        return glm::ivec3(p[0], p[1], p[2]);
    };
    const glm::ivec3 red = middle();
    EXPECT_NEAR(double(red.y) / red.x, double(0x40) / 0xe0, 0.03);
    EXPECT_NEAR(double(red.z) / red.x, double(0x20) / 0xe0, 0.03);

    RendererOptions off;
    off.colour = false;
    start(off);
    show(painted);
    const FrameStats without = draw(request);
    EXPECT_EQ(without.colourBytes, 0u);
    EXPECT_LT(without.poolBytes, with.poolBytes);
    EXPECT_GT(double(middle().y) / middle().x, 0.8) << "clay";

    start();
    show(test::sphereScene());
    EXPECT_EQ(draw(requestOf(cameras(test::sphereScene())[0].camera)).colourBytes, 0u) << "the dataset has none";
}

TEST_F(RendererTest, PipelinesAreMadeOnceAndOnlyWhenNeeded) {
    start();
    const Scene scene = test::sphereScene();
    show(scene);
    FrameRequest request = requestOf(cameras(scene)[0].camera);
    EXPECT_EQ(draw(request).pipelines, 3u);
    EXPECT_EQ(draw(request).pipelines, 3u);
    const auto workOf = [&](ShadingMode mode) {
        request.shading.mode = mode;
        const FrameStats stats = draw(request);
        EXPECT_EQ(stats.pipelines, 5u) << "rays that count, and their colours";
        const std::vector<uint32_t> work = renderer_->readWork().value();
        return std::pair(std::accumulate(work.begin(), work.end(), uint64_t{0}), stats);
    };
    const auto [steps, counted] = workOf(ShadingMode::Steps);
    EXPECT_GT(steps, counted.hitPixels);
    EXPECT_LT(steps, 60 * counted.tracedRays);
    EXPECT_GT(workOf(ShadingMode::Fetches).first, steps);
    EXPECT_EQ(workOf(ShadingMode::Steps).first, steps) << "exact";
}

TEST_F(RendererTest, OnlyFramesThatMissPagesAskRaysWhatToRead) {
    start();
    const Scene scene = test::sphereScene();
    show(scene);
    const FrameRequest request = requestOf(cameras(scene)[0].camera);
    for (int i = 0; i < 3; ++i) EXPECT_EQ(draw(request).feedbackPasses, 0u) << "all is there";
    EXPECT_EQ(draw(request).pipelines, 3u);
    // A closer view: pages are missing in its first frame.
    FrameRequest close = requestOf(cameras(scene)[7].camera);
    close.errorPixels = 0.01;
    const auto update = renderer_->update(close);
    ASSERT_TRUE(update);
    ASSERT_GT(update->pagesMissing, 0u);
    const auto asking = renderer_->render(close);
    ASSERT_TRUE(asking) << asking.error().line();
    EXPECT_EQ(asking->feedbackPasses, 1u);
    EXPECT_EQ(asking->pipelines, 4u);
    for (int i = 0; i < 3; ++i) EXPECT_EQ(draw(close).feedbackPasses, 1u);
}

/// Holds all reads but the first page's, and counts them.
class HoldingSource final : public PageSource {
public:
    explicit HoldingSource(std::shared_ptr<const PageSource> source) : source_(std::move(source)) {}
    Result<PageBytes> read(Request request, bool withColour) const override {
        if (request == Request(0)) return source_->read(request, withColour);
        std::unique_lock lock(mutex_);
        ++held;
        freed_.wait(lock, [&] { return isFree_; });
        return Error{.code = ErrorCode::Cancelled, .message = "closed"};
    }
    [[nodiscard]] uint64_t bytesToRead(Request request, bool withColour) const override {
        return source_->bytesToRead(request, withColour);
    }
    void interrupt() const override {
        const std::lock_guard lock(mutex_);
        isFree_ = true;
        freed_.notify_all();
    }
    mutable std::atomic<uint32_t> held = 0;

private:
    std::shared_ptr<const PageSource> source_;
    mutable std::mutex mutex_;
    mutable std::condition_variable freed_;
    mutable bool isFree_ = false;
};

TEST_F(RendererTest, AsManyThreadsReadAsTheSourceNeeds) {
    const Scene scene = test::sphereScene(3);
    FrameRequest request = requestOf(fitCamera(scene.boxMin, scene.boxMax, {0, 0, -1}, {0, 1, 0}, 0.6, 4.0 / 3));
    request.errorPixels = 0.001;
    // As it says, beside another too; as the options say, whatever it says; its share of that.
    for (const auto& [datasets, asked, threads] :
         {std::tuple(1u, 0u, 5u), std::tuple(2u, 0u, 5u), std::tuple(1u, 3u, 3u), std::tuple(2u, 4u, 2u)}) {
        RendererOptions options;
        options.loaderThreads = asked;
        start(options);
        const auto source = std::make_shared<HoldingSource>(scene.source);
        std::vector<PlacedDataset> all{{scene.dataset, source, {}, 5}};
        if (datasets > 1) all.push_back({scene.dataset, scene.source, {}, 2});
        ASSERT_TRUE(renderer_->open(all));
        for (int i = 0; i < 2000 && source->held < threads; ++i) {
            ASSERT_TRUE(renderer_->update(request));
            renderer_->waitForPage(std::chrono::milliseconds(5));
        }
        for (int i = 0; i < 10; ++i) renderer_->waitForPage(std::chrono::milliseconds(5));
        EXPECT_EQ(source->held, threads);
        renderer_->close();
    }
}

/// Pages of a sphere around `centre` in the order they were read; one page an update, each update drawn.
std::vector<uint64_t> readInOrder(LoadOrder order, PageAccess access, const Scene& scene, const FrameRequest& request,
                                  std::vector<std::string>& messages) {
    RendererOptions options;
    options.order = order;
    options.access = access;
    options.validation = true;
    options.loaderThreads = 1;
    options.uploadBytes = 1;
    auto renderer = Renderer::create(options);
    EXPECT_TRUE(renderer);
    auto source = std::make_shared<test::TurnstileSource>(scene.source);
    EXPECT_TRUE((*renderer)->open(scene.dataset, source));
    for (int i = 0; i < 1000; ++i) {
        const auto update = (*renderer)->update(request);
        EXPECT_TRUE(update && (*renderer)->render(request));
        if (!update || update->settled) break;
        source->letOnePass();
        (*renderer)->waitForPage(std::chrono::milliseconds(1000));
    }
    messages = (*renderer)->validationMessages();
    return source->read();
}

TEST(RendererFeedback, WhatRaysMeetIsReadFirst) {
    const Scene scene = test::sphereScene(3);
    FrameRequest request = requestOf(fitCamera(scene.boxMin, scene.boxMax, {0, 0, -1}, {0, 1, 0}, 0.6, 4.0 / 3));
    request.errorPixels = 0.001;  // all pages
    for (const PageAccess access : {PageAccess::TexelBuffer, PageAccess::StorageBuffer}) {
        std::vector<std::string> messages;
        const auto read = readInOrder(LoadOrder::Feedback, access, scene, request, messages);
        for (const std::string& message : messages) ADD_FAILURE() << message;
        ASSERT_EQ(read.size(), scene.dataset->pages.size());
        // The finest pages that are read are those in front, which the rays see.
        std::vector<double> front;
        for (const uint64_t page : read)
            if (scene.dataset->pages[page].level == 2)
                front.push_back(
                    scene.dataset->originOf(scene.dataset->pages[page]).z >= (scene.boxMin.z + scene.boxMax.z) / 2 ? 1
                                                                                                                   : 0);
        const size_t half = front.size() / 2;
        const double early = std::accumulate(front.begin(), front.begin() + std::ptrdiff_t(half), 0.0);
        const double late = std::accumulate(front.begin() + std::ptrdiff_t(half), front.end(), 0.0);
        EXPECT_GT(early, 0.9 * double(half));
        EXPECT_LT(late, 0.2 * double(half));
    }
}

TEST_F(RendererTest, BudgetIsKeptAndEveryViewSettles) {
    RendererOptions options;
    options.budgetBytes = 1 << 20;
    start(options);
    const Scene scene = test::sphereScene(4);
    uint64_t all = 0;
    for (const PageEntry& page : scene.dataset->pages) all += page.pageBytes;
    ASSERT_GT(all, options.budgetBytes * 2) << "the test needs a dataset larger than the budget";
    show(scene);
    for (int round = 0; round < 3; ++round)
        for (const NamedCamera& named : cameras(scene)) {
            FrameRequest request = requestOf(named.camera, 64, 48);
            request.errorPixels = 0.001;
            for (int i = 0; i < 5; ++i) {
                const auto update = renderer_->update(request);
                ASSERT_TRUE(update) << update.error().line();
                EXPECT_LE(update->residentBytes, options.budgetBytes);
            }
            const auto settled = renderer_->settle(request);
            ASSERT_TRUE(settled) << settled.error().line();
            EXPECT_TRUE(settled->settled);
            EXPECT_TRUE(settled->drawable);
            EXPECT_LE(settled->residentBytes, options.budgetBytes);
            const auto stats = renderer_->render(request);
            ASSERT_TRUE(stats) << stats.error().line();
            EXPECT_LE(stats->poolBytes, options.budgetBytes);
            const auto again = renderer_->update(request);
            EXPECT_TRUE(again->settled);
            EXPECT_FALSE(again->changed) << "a settled view stays as it is";
        }
}

TEST_F(RendererTest, BudgetsChangeWhileRunning) {
    const Scene scene = test::sphereScene(4);
    FrameRequest request = requestOf(cameras(scene)[0].camera);
    request.errorPixels = 0.001;
    const uint64_t large = 64 << 20, small = 1 << 20, ram = 4 << 20;
    std::map<uint64_t, Picture> expected;
    for (const uint64_t budget : {large, small}) {
        RendererOptions options;
        options.budgetBytes = budget;
        start(options);
        show(scene);
        draw(request);
        expected[budget] = *renderer_->readPicture();
    }
    ASSERT_NE(expected[large], expected[small]);
    RendererOptions options;
    options.budgetBytes = large;
    start(options);
    show(scene);
    draw(request);
    for (const uint64_t budget : {small, large, small, large}) {
        ASSERT_TRUE(renderer_->setBudgets(budget, ram));
        // What was kept is there at once, and no more than the budget.
        const auto kept = renderer_->render(request);
        ASSERT_TRUE(kept) << kept.error().line();
        EXPECT_GT(kept->hitPixels, 2500u);
        EXPECT_LE(kept->poolBytes, budget);
        const auto update = renderer_->update(request);
        ASSERT_TRUE(update) << update.error().line();
        EXPECT_TRUE(update->changed) << "to be drawn again";
        EXPECT_LE(update->residentBytes, budget);
        EXPECT_LE(update->heldBytesMax, ram);
        draw(request);
        EXPECT_EQ(*renderer_->readPicture(), expected[budget]);
        EXPECT_EQ(renderer_->update(request)->reloads, 0u);
    }
    EXPECT_EQ(renderer_->setBudgets(100, ram).error().code, ErrorCode::Usage);
}

TEST_F(RendererTest, WithoutMemoryThePoolIsHalvedAndItGoesOnCoarser) {
    const Scene scene = test::sphereScene(4);
    FrameRequest request = requestOf(cameras(scene)[0].camera);
    request.errorPixels = 0.001;
    for (const bool separate : {false, true}) {
        SCOPED_TRACE(separate);
        RendererOptions options;
        options.faults.memoryBytes = 5 << 20;
        options.faults.separateMemory = options.faults.separateCopies = separate;
        start(options);
        show(scene);
        const uint64_t pool = draw(request).poolBytes;
        EXPECT_LT(pool, options.faults.memoryBytes);
        EXPECT_GT(pool, 0u);
        // A larger picture takes memory that the pool has.
        FrameRequest larger = request;
        larger.width = 400, larger.height = 300;
        const FrameStats stats = draw(larger);
        EXPECT_LT(stats.poolBytes, pool);
        EXPECT_GT(stats.hitPixels, 10000u);
        const auto settled = renderer_->settle(larger);
        ASSERT_TRUE(settled);
        EXPECT_LE(settled->residentBytes, stats.poolBytes);
        const auto picture = renderer_->render(larger) ? *renderer_->readPicture() : Picture{};
        // A pool of that size from the beginning shows the same.
        RendererOptions plain;
        plain.budgetBytes = stats.poolBytes;
        start(plain);
        show(scene);
        draw(larger);
        EXPECT_EQ(*renderer_->readPicture(), picture);
        // One that no pool would leave room for is an error, and the next picture is fine.
        start(options);
        show(scene);
        FrameRequest huge = request;
        huge.width = 2000, huge.height = 1500;
        EXPECT_EQ(renderer_->render(huge).error().code, ErrorCode::Device);
        EXPECT_GT(draw(request).hitPixels, 2500u);
    }
}

/// Draws while pages come, then as it has settled.
Picture drawAllTheWay(Renderer& renderer, const FrameRequest& request) {
    for (;;) {
        const auto update = renderer.update(request);
        EXPECT_TRUE(update) << update.error().line();
        EXPECT_TRUE(renderer.render(request)) << "at least the background";
        if (!update || update->settled) break;
        renderer.waitForPage(std::chrono::milliseconds(100));
    }
    // A device may be lost while the picture is read, too.
    const auto picture = renderer.readPicture();
    return picture ? *picture : Picture{};
}

TEST_F(RendererTest, ALostDeviceIsMadeAnew) {
    const Scene scene = test::torusScene();
    FrameRequest request = requestOf(cameras(scene)[0].camera, 64, 48);
    request.beam = false;
    // Options with the fewest pipelines, which take most of the time here.
    RendererOptions options;
    options.order = LoadOrder::Error;
    start(options);
    show(scene);
    const Picture expected = drawAllTheWay(*renderer_, request);
    // With separate memory, updates submit work too; their copies on their own wait for nothing.
    struct Loss {
        bool separateMemory, separateCopies;
        int at;
    };
    for (const auto& [separateMemory, separateCopies, lostAt] :
         {Loss{false, false, 2}, {true, false, 2}, {true, false, 5}, {true, true, 3}, {true, true, 4}}) {
        SCOPED_TRACE(lostAt);
        options.faults.separateMemory = separateMemory;
        options.faults.separateCopies = separateCopies;
        options.faults.lostAtSubmission = uint64_t(lostAt);
        start(options);
        show(scene);
        uint32_t losses = 0, told = 0;
        renderer_->onDeviceLoss([&] { ++told; });
        for (int i = 0; i < 20 && losses == 0; ++i) {
            drawAllTheWay(*renderer_, request);
            losses = renderer_->update(request)->deviceLosses;
        }
        EXPECT_EQ(losses, 1u);
        EXPECT_EQ(told, 1u);
        EXPECT_EQ(drawAllTheWay(*renderer_, request), expected);
        EXPECT_EQ(renderer_->update(request)->deviceLosses, 1u);
        for (const std::string& message : renderer_->validationMessages()) ADD_FAILURE() << message;
    }
}

// What a frame counted, its table and its feedback travel with its own commands.
TEST_F(RendererTest, AFrameIsOneSubmissionWhereTheMemoryIsSeparate) {
    const Scene scene = test::sphereScene(4);
    RendererOptions options;
    options.budgetBytes = uint64_t{1} << 20;
    options.faults.separateMemory = true;
    start(options);
    show(scene);
    for (int view = 0; view < 8; ++view) {
        FrameRequest request = requestOf(cameras(scene)[size_t(view % 4)].camera, 64, 48);
        request.errorPixels = view < 4 ? 0.001 : 0.5;
        for (int frame = 0; frame < 3; ++frame) {
            ASSERT_TRUE(renderer_->update(request).ok());
            const auto stats = renderer_->render(request);
            ASSERT_TRUE(stats.ok()) << stats.error().line();
            EXPECT_EQ(stats->submissions, 1u) << view << " " << frame;
            EXPECT_LE(stats->hostWaits, 1u) << view << " " << frame << ": none where it has ended at once";
        }
        drawAllTheWay(*renderer_, request);
    }
    for (const std::string& message : renderer_->validationMessages()) ADD_FAILURE() << message;
}

TEST_F(RendererTest, PagesGoThroughStagingWhereTheMemoryIsSeparate) {
    const Scene scene = test::sphereScene(4);
    for (const uint64_t budget : {uint64_t{1} << 20, uint64_t{64} << 20}) {
        std::vector<Picture> pictures[3];
        for (const int way : {0, 1, 2}) {
            RendererOptions options;
            options.budgetBytes = budget;
            options.faults.separateMemory = way > 0;
            options.faults.separateCopies = way > 1;
            start(options);
            show(scene);
            for (int view = 0; view < 4; ++view) {
                FrameRequest request = requestOf(cameras(scene)[size_t(view)].camera, 64, 48);
                request.errorPixels = 0.001;
                pictures[way].push_back(drawAllTheWay(*renderer_, request));
            }
            for (const std::string& message : renderer_->validationMessages()) ADD_FAILURE() << message;
        }
        EXPECT_EQ(pictures[0], pictures[1]);
        EXPECT_EQ(pictures[0], pictures[2]);
    }
}

Picture alonePicture(const Scene& scene, const FrameRequest& request, uint64_t budget) {
    RendererOptions options;
    options.budgetBytes = budget;
    auto renderer = Renderer::create(options);
    EXPECT_TRUE(renderer && (*renderer)->open(scene.dataset, scene.source));
    EXPECT_TRUE((*renderer)->settle(request) && (*renderer)->render(request));
    return *(*renderer)->readPicture();
}

/// Pictures of views of one renderer, updated and drawn in turn until all have settled.
std::vector<Picture> drawTogether(std::span<const std::unique_ptr<Renderer>> views,
                                  std::span<const FrameRequest> requests, bool& relaxed) {
    for (bool settled = false; !settled;) {
        settled = true;
        for (size_t i = 0; i < views.size(); ++i) {
            const auto update = views[i]->update(requests[i]);
            EXPECT_TRUE(update) << update.error().line();
            EXPECT_TRUE(views[i]->render(requests[i]));
            if (!update) return {};
            settled = settled && update->settled;
            relaxed = relaxed || update->relaxed;
            EXPECT_EQ(update->reloads, 0u);
        }
        if (!settled) views[0]->waitForPage(std::chrono::milliseconds(100));
    }
    std::vector<Picture> pictures;
    for (size_t i = 0; i < views.size(); ++i) {
        EXPECT_TRUE(views[i]->render(requests[i]));
        pictures.push_back(*views[i]->readPicture());
    }
    return pictures;
}

TEST_F(RendererTest, TenViewsShareOnePoolAndOneBudget) {
    const Scene scene = test::sphereScene(4);
    std::vector<FrameRequest> requests;
    for (const NamedCamera& named : cameras(scene)) {
        if (requests.size() == 10) break;
        requests.push_back(requestOf(named.camera, 48, 36));
        requests.back().errorPixels = 0.02;
        requests.back().beam = false;
    }
    start();
    show(scene);
    std::vector<Picture> expected;
    for (const FrameRequest& request : requests) {
        draw(request);
        expected.push_back(*renderer_->readPicture());
    }
    for (const uint64_t budget : {uint64_t{64} << 20, uint64_t{1} << 20}) {
        RendererOptions options;
        options.budgetBytes = budget;
        const bool isLarge = budget > 1 << 20;
        options.faults.lostAtSubmission = isLarge ? 25 : 0;  // all views come back
        start(options);
        show(scene);
        std::vector<std::unique_ptr<Renderer>> views;
        views.push_back(std::move(renderer_));
        while (views.size() < requests.size()) {
            auto view = views[0]->addView();
            ASSERT_TRUE(view) << view.error().line();
            views.push_back(std::move(*view));
        }
        bool relaxed = false;
        drawTogether(views, requests, relaxed);
        const auto pictures = drawTogether(views, requests, relaxed);
        EXPECT_NE(relaxed, isLarge);
        EXPECT_NE(pictures == expected, relaxed);
        uint32_t pipelines = 0;
        for (size_t i = 0; i < views.size(); ++i) pipelines += views[i]->render(requests[i])->pipelines;
        EXPECT_LE(pipelines, 4u) << "pipelines are shared: beam, trace, shade, feedback";
        const auto update = views[3]->update(requests[3]);
        ASSERT_TRUE(update);
        EXPECT_LE(update->residentBytes, budget);
        EXPECT_EQ(update->deviceLosses, isLarge ? 1u : 0u);
        // Those that stay have the whole budget, also where the first is gone.
        views.erase(views.begin(), views.end() - 1);
        renderer_ = std::move(views[0]);
        draw(requests.back());
        EXPECT_EQ(*renderer_->readPicture(), isLarge ? expected.back() : alonePicture(scene, requests.back(), budget));
    }
}

TEST_F(RendererTest, ADirectoryInPartsGivesTheSamePicture) {
    const TestFolder folder("vcp_directory_parts_test");
    test::writeSphereFile(folder / "scan.vcp", 5);
    const std::shared_ptr<const ByteReader> reader = *openFile(folder / "scan.vcp");
    std::vector<Picture> pictures[2];
    start();
    for (const bool inParts : {false, true}) {
        const auto dataset = std::make_shared<const Dataset>(
            *(inParts ? readDatasetStart(*reader, kDirectoryOffset + kBlockBytes) : readDataset(*reader)));
        const bool isWhole = dataset->pages.blocksKnown() == dataset->pages.blocks();
        EXPECT_NE(isWhole, inParts);
        ASSERT_TRUE(renderer_->open(dataset, std::make_shared<FilePageSource>(reader, dataset)));
        for (const double errorPixels : {1.0, 0.02}) {
            const glm::dvec3 low = dataset->originOf(dataset->pages[0]),
                             high = low + dataset->edgeOf(dataset->pages[0]);
            FrameRequest request = requestOf(fitCamera(low, high, {-0.3, -0.5, -1}, {0, 1, 0}, 0.6, 4.0 / 3), 64, 48);
            request.errorPixels = errorPixels;
            EXPECT_GT(draw(request).hitPixels, 100u);
            pictures[inParts ? 1 : 0].push_back(*renderer_->readPicture());
        }
    }
    EXPECT_EQ(pictures[0], pictures[1]);
    EXPECT_NE(pictures[0][0], pictures[0][1]);
}

TEST_F(RendererTest, ABrokenPageIsReportedOnceAndDrawnFromItsParent) {
    start();
    const Scene scene = test::sphereScene();
    scene.source->broken = {5, 20};
    show(scene);
    FrameRequest request = requestOf(cameras(scene)[0].camera);
    request.errorPixels = 0;
    const auto update = renderer_->settle(request);
    ASSERT_TRUE(update);
    EXPECT_TRUE(update->settled);
    ASSERT_GE(update->problems.size(), 1u);
    EXPECT_EQ(update->problems[0].message, "broken");
    // A page that was on its way when its parent was given up may be reported later: once, too.
    std::set<std::string> reported;
    for (const Error& problem : update->problems)
        EXPECT_TRUE(reported.insert(problem.element).second) << problem.line();
    for (int i = 0; i < 5; ++i) {
        const auto later = renderer_->update(request);
        ASSERT_TRUE(later);
        for (const Error& problem : later->problems)
            EXPECT_TRUE(reported.insert(problem.element).second) << problem.line();
    }
    const auto stats = renderer_->render(request);
    ASSERT_TRUE(stats);
    EXPECT_GT(stats->hitPixels, 2500u);
}

TEST_F(RendererTest, ABrokenRootSettlesOnTheBackground) {
    start();
    const Scene scene = test::sphereScene();
    scene.source->broken = {0};
    show(scene);
    const FrameRequest request = requestOf(cameras(scene)[0].camera);
    const auto update = renderer_->settle(request);
    ASSERT_TRUE(update);
    EXPECT_EQ(update->problems.size(), 1u);
    EXPECT_FALSE(update->drawable);
    EXPECT_EQ(renderer_->render(request)->hitPixels, 0u);
}

TEST_F(RendererTest, NothingToShowIsBackground) {
    start();
    EXPECT_FALSE(renderer_->readPicture()) << "nothing was drawn yet";
    EXPECT_FALSE(renderer_->readDepth());
    const FrameRequest request = requestOf(Camera{}, 33, 17);
    const FrameStats stats = draw(request);
    EXPECT_EQ(stats.hitPixels, 0u);
    EXPECT_EQ(stats.tracedRays, 0u);
    const auto picture = renderer_->readPicture();
    ASSERT_TRUE(picture);
    EXPECT_EQ(picture->rgba.size(), 33u * 17 * 4);
    for (size_t i = 3; i < picture->rgba.size(); i += 4) EXPECT_EQ(picture->rgba[i], 255);

    // A page without any surface, and a dataset without pages.
    test::AnalyticOptions o;
    show(test::sceneOf("empty", test::analyticDataset(test::sphere(glm::dvec3(900), 1), o)));
    Camera camera;
    camera.eye = {8, 8, 40};
    EXPECT_EQ(draw(requestOf(camera)).hitPixels, 0u);
    auto none = std::make_shared<Dataset>();
    none->header.levels = 1;
    none->header.log2Cells = 4;
    none->header.cell = 1;
    ASSERT_TRUE(renderer_->open(none, std::make_shared<test::MemorySource>(std::vector<PageBytes>{})));
    EXPECT_EQ(draw(requestOf(camera)).hitPixels, 0u);
    renderer_->close();
    EXPECT_EQ(draw(requestOf(camera)).hitPixels, 0u);
}

TEST_F(RendererTest, PickIsTheDepthOfThePixel) {
    start();
    const Scene scene = test::sphereScene();
    show(scene);
    const FrameRequest request = requestOf(cameras(scene)[0].camera);
    draw(request);
    const auto depth = renderer_->readDepth();
    int hits = 0;
    for (uint32_t y = 3; y < request.height; y += 11)
        for (uint32_t x = 1; x < request.width; x += 13) {
            const auto hit = renderer_->pick(x, y);
            ASSERT_TRUE(hit);
            const float expected = (*depth)[size_t{y} * request.width + x];
            ASSERT_EQ(hit->has_value(), std::isfinite(expected));
            if (!hit->has_value()) continue;
            ++hits;
            EXPECT_NEAR((*hit)->depth, expected, 1e-4);
            const glm::dvec3 centre = scene.boxMin + glm::dvec3(0.503, 0.497, 0.501) * 64.0;
            EXPECT_NEAR(glm::distance((*hit)->position, centre), 0.41 * 64, 0.02);
            EXPECT_GT(glm::dot(glm::dvec3((*hit)->normal), glm::normalize((*hit)->position - centre)), 0.99);
        }
    EXPECT_GT(hits, 20);
    EXPECT_FALSE(renderer_->pick(request.width, 0)->has_value());
}

TEST_F(RendererTest, WrongUseIsOneClearError) {
    RendererOptions small;
    small.budgetBytes = 100;
    EXPECT_EQ(Renderer::create(small).error().code, ErrorCode::Usage);
    RendererOptions elsewhere;
    elsewhere.device = "no such device";
    EXPECT_EQ(Renderer::create(elsewhere).error().code, ErrorCode::Device);
    start();
    FrameRequest request;
    request.width = 0;
    EXPECT_EQ(renderer_->render(request).error().code, ErrorCode::Usage);
    EXPECT_EQ(renderer_->update(request).error().code, ErrorCode::Usage);
    EXPECT_EQ(renderer_->present(10, 10).error().code, ErrorCode::Usage);
}

}  // namespace
}  // namespace vcp
