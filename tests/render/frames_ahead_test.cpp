// Frames in flight: how often a still frame, a moving one and an update wait for the device, on the path of memory that
// the CPU does not see too; and that pictures, picks and what rays ask for are those of frames that are waited for.
#include <chrono>
#include <cmath>
#include <thread>

#include <gtest/gtest.h>

#include "tests/support/renderer_fixture.h"

namespace vcp {
namespace {

using test::requestOf;
using test::Scene;

/// Where the device's memory is, and where copies run.
struct Way {
    const char* name;
    bool separateMemory, separateCopies;
};
constexpr Way kWays[] = {{"mapped", false, false}, {"separate", true, false}, {"copy queue", true, true}};

RendererOptions optionsOf(const Way& way) {
    RendererOptions options;
    options.faults.separateMemory = way.separateMemory;
    options.faults.separateCopies = way.separateCopies;
    return options;
}

/// A camera that goes around the scene, with `n` of 24 steps done.
FrameRequest around(const Scene& scene, int n, uint32_t width = 96, uint32_t height = 64) {
    const double angle = 0.2618 * n;
    return requestOf(
        fitCamera(scene.boxMin, scene.boxMax, {std::cos(angle), -0.4, std::sin(angle)}, {0, 1, 0}, 0.6, 1.5), width,
        height);
}

class FramesAhead : public test::RendererFixture {
protected:
    /// Lets time pass until what was drawn is taken in, without a wait of the renderer's.
    void letEnd(const FrameRequest& request) {
        while (renderer_->isDrawing()) {
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
            update(request);
        }
    }
    /// Whether the device is as the way says; a graphics card always has memory and a queue for copies of its own.
    [[nodiscard]] bool hasSeparateMemory(const Way& way) const {
        return way.separateMemory || renderer_->device().type == "discrete";
    }
    [[nodiscard]] bool hasSeparateCopies(const Way& way) const {
        return way.separateCopies || renderer_->device().type == "discrete";
    }
    void drawAhead(const FrameRequest& request, const std::optional<PicturePixel>& cursor = {}) {
        const auto drawn = renderer_->renderAhead(request, cursor);
        ASSERT_TRUE(drawn) << drawn.error().line();
    }
    UpdateResult update(const FrameRequest& request) {
        const auto done = renderer_->update(request);
        EXPECT_TRUE(done) << done.error().line();
        return done ? *done : UpdateResult{};
    }
};

TEST_F(FramesAhead, AStillFrameWaitsForNothing) {
    const Scene scene = test::sphereScene();
    const FrameRequest request = around(scene, 1);
    for (const Way& way : kWays) {
        SCOPED_TRACE(way.name);
        start(optionsOf(way));
        show(scene);
        draw(request);
        const Picture expected = *renderer_->readPicture();
        for (int frame = 0; frame < 5; ++frame) {
            const UpdateResult still = update(request);
            EXPECT_EQ(still.submissions, 0u);
            EXPECT_EQ(still.hostWaits, 0u);
            drawAhead(request);
            EXPECT_TRUE(renderer_->isDrawing());
            letEnd(request);
            EXPECT_EQ(renderer_->lastDone()->number, uint64_t(frame) + 2) << "one was waited for";
            EXPECT_EQ(renderer_->lastDone()->stats.submissions, 1u);
            EXPECT_EQ(renderer_->lastDone()->stats.hostWaits, 0u);
            EXPECT_GT(renderer_->lastDone()->stats.hitPixels, 0u);
        }
        EXPECT_EQ(*renderer_->readPicture(), expected);
        for (const std::string& message : renderer_->validationMessages()) ADD_FAILURE() << message;
    }
}

TEST_F(FramesAhead, AMovingFrameWaitsForTheOneBeforeTheLastAtMost) {
    const Scene scene = test::sphereScene();
    for (const Way& way : kWays) {
        SCOPED_TRACE(way.name);
        start(optionsOf(way));
        show(scene);
        FrameRequest last;
        for (int step = 0; step < 24; ++step) draw(around(scene, step, 320, 240));  // all that the way needs is read
        bool wereTwoInFlight = false;
        const uint64_t before = renderer_->lastDone()->number;
        for (uint64_t step = 0; step < 24; ++step) {
            last = around(scene, int(step), 320, 240);
            const UpdateResult moved = update(last);
            EXPECT_EQ(moved.submissions, 0u);
            EXPECT_EQ(moved.hostWaits, 0u);
            drawAhead(last);
            const DoneFrame& done = *renderer_->lastDone();
            EXPECT_GE(done.number + 2, before + step + 1) << "no more than two are in flight";
            wereTwoInFlight = wereTwoInFlight || done.number + 2 == before + step + 1;
            if (done.number <= before) continue;
            EXPECT_EQ(done.stats.submissions, 1u);
            EXPECT_LE(done.stats.hostWaits, 1u);
        }
        EXPECT_TRUE(wereTwoInFlight) << "a frame that waits for the last one never sees two";
        const Picture ahead = *renderer_->readPicture();
        draw(last);
        EXPECT_EQ(*renderer_->readPicture(), ahead);
        for (const std::string& message : renderer_->validationMessages()) ADD_FAILURE() << message;
    }
}

// On a software device a frame of many rays is drawn step by step: until the last one the picture before is shown, and
// then there is the picture that is drawn at once.
TEST_F(FramesAhead, AFrameThatTakesLongIsDrawnStepByStep) {
    const Scene scene = test::sphereScene();
    start({});
    if (!renderer_->device().software) GTEST_SKIP() << "a GPU draws all at once";
    show(scene);
    FrameRequest request = around(scene, 1, 520, 440);
    request.shading.shadows = true;
    request.shading.occlusionRays = 8;
    const FrameRequest other = around(scene, 5);
    draw(request);
    const Picture expected = *renderer_->readPicture();
    const uint32_t hits = uint32_t(renderer_->lastDone()->stats.hitPixels);
    draw(other);
    const Picture before = *renderer_->readPicture();
    update(request);
    drawAhead(request);
    ASSERT_TRUE(renderer_->isUnfinished());
    int steps = 1;
    for (double part = 0; renderer_->isUnfinished(); ++steps) {
        EXPECT_GE(renderer_->finishedPart(), part);
        part = renderer_->finishedPart();
        EXPECT_EQ(*renderer_->readPicture(), before);
        while (renderer_->isBusy()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        const auto isLast = renderer_->continueFrame();
        ASSERT_TRUE(isLast) << isLast.error().line();
        EXPECT_EQ(*isLast, !renderer_->isUnfinished());
        update(request);
        if (renderer_->isUnfinished()) {
            EXPECT_EQ(renderer_->lastDone()->request.width, other.width) << "it is not taken in before it is finished";
        }
    }
    EXPECT_GE(steps, 5);
    EXPECT_EQ(renderer_->finishedPart(), 1);
    EXPECT_EQ(*renderer_->readPicture(), expected);
    update(request);
    EXPECT_EQ(renderer_->lastDone()->stats.hitPixels, hits);

    // What begins meanwhile ends it.
    drawAhead(request);
    ASSERT_TRUE(renderer_->isUnfinished());
    update(other);
    drawAhead(other);
    EXPECT_FALSE(renderer_->isUnfinished());
    EXPECT_EQ(*renderer_->readPicture(), before);
    drawAhead(request);
    ASSERT_TRUE(renderer_->isUnfinished());
    draw(other);
    EXPECT_FALSE(renderer_->isUnfinished());
    EXPECT_EQ(*renderer_->readPicture(), before);
    drawAhead(request);
    show(scene);
    EXPECT_FALSE(renderer_->isUnfinished()) << "another dataset";
    for (const std::string& message : renderer_->validationMessages()) ADD_FAILURE() << message;
}

// Where the memory is mapped, an update that writes pages waits for the frames that may read them. Elsewhere its copies
// wait on the device: one submission, and one more where the queue for copies must be told that frames have ended. It
// waits only for the staging buffer of the update before the last.
TEST_F(FramesAhead, AnUpdateThatPlacesPagesIsOneSubmission) {
    const Scene scene = test::sphereScene(4);
    for (const Way& way : kWays) {
        SCOPED_TRACE(way.name);
        std::vector<Picture> pictures[2];
        for (const bool ahead : {false, true}) {
            RendererOptions options = optionsOf(way);
            options.budgetBytes = uint64_t{1} << 20;  // pages are evicted and moved
            start(options);
            show(scene);
            uint64_t loads = 0;
            for (int view = 0; view < 6; ++view) {
                FrameRequest request = around(scene, 4 * view, 64, 48);
                request.errorPixels = 0.001;
                for (bool settled = false; !settled;) {
                    const UpdateResult updated = update(request);
                    const bool hasPlaced = updated.loads > std::exchange(loads, updated.loads);
                    EXPECT_LE(updated.submissions, !hasPlaced || !hasSeparateMemory(way) ? 0u
                                                   : hasSeparateCopies(way)              ? 2u
                                                                                         : 1u);
                    EXPECT_LE(updated.hostWaits, hasPlaced ? 1u : 0u);
                    settled = updated.settled;
                    if (ahead)
                        drawAhead(request);
                    else
                        ASSERT_TRUE(renderer_->render(request).ok());
                    if (!settled) renderer_->waitForPage(std::chrono::milliseconds(20));
                }
                pictures[ahead ? 1 : 0].push_back(*renderer_->readPicture());
            }
            EXPECT_GT(update(around(scene, 0)).evictions, 0u);
            for (const std::string& message : renderer_->validationMessages()) ADD_FAILURE() << message;
        }
        EXPECT_EQ(pictures[0], pictures[1]);
    }
}

TEST_F(FramesAhead, TheHitUnderTheCursorComesWithTheFrame) {
    const Scene scene = test::sphereScene();
    const glm::dvec2 window(192, 128);  // twice the picture
    for (const Way& way : kWays) {
        SCOPED_TRACE(way.name);
        start(optionsOf(way));
        show(scene);
        const FrameRequest request = around(scene, 3);
        draw(request);
        const auto expected = renderer_->pick(50, 30);
        ASSERT_TRUE(expected && *expected);
        drawAhead(request, PicturePixel{50, 30});
        letEnd(request);
        ASSERT_TRUE(renderer_->lastDone()->hit);
        EXPECT_EQ(renderer_->lastDone()->hit->position, (*expected)->position);
        EXPECT_EQ(renderer_->lastDone()->hit->normal, (*expected)->normal);
        // The next frame is in flight: at the cursor the one before tells, elsewhere the new one is waited for.
        const FrameRequest other = around(scene, 9);
        drawAhead(other, PicturePixel{50, 30});
        const uint64_t number = renderer_->lastDone()->number;
        const auto atCursor = renderer_->pickAt({100.5, 60.5}, window);
        ASSERT_TRUE(atCursor && *atCursor);
        if (renderer_->lastDone()->number == number) {
            EXPECT_EQ((*atCursor)->position, (*expected)->position);
        }
        const auto elsewhere = renderer_->pickAt({110, 70}, window);
        ASSERT_TRUE(elsewhere && *elsewhere);
        EXPECT_FALSE(renderer_->isDrawing());
        EXPECT_EQ((*elsewhere)->position, (*renderer_->pick(55, 35))->position);
        EXPECT_FALSE(*renderer_->pickAt({-1, 5}, window));
        drawAhead(request, PicturePixel{500, 30});
        EXPECT_TRUE(renderer_->readDepth());
        EXPECT_FALSE(renderer_->lastDone()->hit) << "the cursor is outside";
        for (const std::string& message : renderer_->validationMessages()) ADD_FAILURE() << message;
    }
}

TEST_F(FramesAhead, ALostDeviceIsMadeAnew) {
    const Scene scene = test::torusScene();
    FrameRequest request = around(scene, 2);
    request.beam = false;
    RendererOptions options;
    options.order = LoadOrder::Error;
    start(options);
    show(scene);
    draw(request);
    const Picture expected = *renderer_->readPicture();
    for (const Way& way : kWays)
        for (const uint64_t lostAt : {2u, 3u, 5u, 6u}) {
            SCOPED_TRACE(std::string(way.name) + " " + std::to_string(lostAt));
            RendererOptions faulty = optionsOf(way);
            faulty.order = LoadOrder::Error;
            faulty.faults.lostAtSubmission = lostAt;
            start(faulty);
            show(scene);
            UpdateResult updated;
            for (int frame = 0; frame < 200 && (updated.deviceLosses == 0 || !updated.settled); ++frame) {
                updated = update(request);
                drawAhead(request);
                if (!updated.settled) renderer_->waitForPage(std::chrono::milliseconds(10));
            }
            EXPECT_EQ(updated.deviceLosses, 1u);
            drawAhead(request);
            EXPECT_EQ(*renderer_->readPicture(), expected);
            for (const std::string& message : renderer_->validationMessages()) ADD_FAILURE() << message;
        }
}

// Datasets, budgets, views and the renderer may go at any time.
TEST_F(FramesAhead, WhatIsInFlightMayLoseAll) {
    const Scene sphere = test::sphereScene(), torus = test::torusScene();
    for (const Way& way : kWays) {
        SCOPED_TRACE(way.name);
        start(optionsOf(way));
        show(sphere);
        const FrameRequest request = around(sphere, 1);
        draw(request);
        const auto drawTwo = [&] {
            update(request);
            drawAhead(request);
            drawAhead(around(sphere, 2, 200, 150));
            EXPECT_TRUE(renderer_->isDrawing());
        };
        drawTwo();
        ASSERT_TRUE(renderer_->setBudgets(uint64_t{2} << 20, uint64_t{8} << 20));
        drawTwo();
        show(torus);
        EXPECT_FALSE(renderer_->lastDone()) << "it is not of what is open now";
        drawTwo();
        ASSERT_TRUE(renderer_->open({{torus.dataset, torus.source, {}}, {sphere.dataset, sphere.source, {}}}));
        drawTwo();
        renderer_->close();
        drawTwo();
        show(sphere);
        drawTwo();
        auto second = renderer_->addView();
        ASSERT_TRUE(second) << second.error().line();
        drawTwo();
        ASSERT_TRUE((*second)->update(request) && (*second)->renderAhead(request));
        renderer_ = std::move(*second);  // the first view goes with two frames in flight
        drawTwo();
        for (const std::string& message : renderer_->validationMessages()) ADD_FAILURE() << message;
    }
}

}  // namespace
}  // namespace vcp
