// The viewer driven as a window drives it, without one: real pages, real frames, a clock that tests set.
#include "viewer/viewer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "tests/support/built_ball.h"

namespace vcp {
namespace {

constexpr glm::ivec2 kSize(320, 240);

class ViewerTest : public BuiltBall {
protected:
    void SetUp() override {
        if (!listDevices()) GTEST_SKIP() << "no Vulkan device";
    }

    void openViewer(double movingFrameMs = 0, const std::filesystem::path& file = *folder_ / "ball.vcp",
                    double moveSeconds = 0, bool framesAhead = false, uint32_t samples = 1) {
        ViewerOptions options;
        options.renderer.budgetBytes = 64 << 20;
        options.movingFrameMs = movingFrameMs;
        options.moveSeconds = moveSeconds;
        options.framesAhead = framesAhead;
        options.samples = samples;
        auto viewer = Viewer::create(options);
        ASSERT_TRUE(viewer) << viewer.error().line();
        viewer_ = *std::move(viewer);
        auto reader = openFile(file);
        ASSERT_TRUE(reader) << reader.error().line();
        auto dataset = readDataset(**reader);
        ASSERT_TRUE(dataset) << dataset.error().line();
        const auto shared = std::make_shared<const Dataset>(*dataset);
        const FileHeader& h = shared->header;
        OrbitCamera camera;
        camera.look(
            View::Front,
            {{h.boundsMin[0], h.boundsMin[1], h.boundsMin[2]}, {h.boundsMax[0], h.boundsMax[1], h.boundsMax[2]}},
            kSize);
        ASSERT_TRUE(viewer_->open(shared, std::make_shared<FilePageSource>(*reader, shared), camera, "ball.ply"));
        viewer_->resize(kSize);
    }

    /// One turn of a host's loop; true when something was drawn.
    bool turn(double seconds) {
        now_ += seconds;
        const auto next = viewer_->update(now_);
        EXPECT_TRUE(next) << next.error().line();
        if (!next) return false;
        next_ = *next;
        if (next->draw) {
            const auto drawn = viewer_->draw();
            EXPECT_TRUE(drawn) << drawn.error().line();
        }
        return next->draw;
    }

    /// Turns until nothing is loading and nothing is to be drawn.
    void settle() {
        for (int i = 0; i < 3000; ++i) {
            const bool drew = turn(0.5);
            if (!drew && viewer_->status().update.settled) return;
            if (!viewer_->status().update.settled) std::this_thread::sleep_for(std::chrono::milliseconds(2));
        }
        FAIL() << "does not settle";
    }

    [[nodiscard]] glm::dvec2 pixelOf(glm::dvec3 point) const { return viewer_->camera().pixelOf(point, kSize).value(); }

    std::unique_ptr<Viewer> viewer_;
    NextStep next_;
    double now_ = 0;
};

// A window draws ahead: what it shows and says at rest is what a host sees that waits for each frame.
TEST_F(ViewerTest, FramesAheadComeToTheSame) {
    openViewer();
    settle();
    const Picture expected = *viewer_->renderer().readPicture();
    const uint64_t hits = viewer_->status().frame.hitPixels;
    const auto point = viewer_->pointAt(glm::dvec2(kSize) / 2.0);
    ASSERT_TRUE(point);
    openViewer(0, *folder_ / "ball.vcp", 0, true);
    viewer_->move(glm::dvec2(kSize) / 2.0);
    settle();
    for (int i = 0; i < 10000 && viewer_->renderer().isDrawing(); ++i) {
        EXPECT_FALSE(turn(0.1));
        EXPECT_TRUE(!viewer_->renderer().isDrawing() || next_.waitSeconds < 1) << "the frame is yet to be taken in";
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    EXPECT_FALSE(turn(0.1));
    EXPECT_TRUE(std::isinf(next_.waitSeconds)) << "at rest it waits for events alone";
    EXPECT_EQ(viewer_->status().frame.hitPixels, hits);
    EXPECT_EQ(viewer_->status().frame.hostWaits, 0u) << "a still frame waits for nothing";
    EXPECT_EQ(*viewer_->pointAt(glm::dvec2(kSize) / 2.0), *point) << "the hit under the cursor came with the frame";
    EXPECT_EQ(*viewer_->renderer().readPicture(), expected);
    const auto waited = viewer_->waitForFrame();
    ASSERT_TRUE(waited);
    EXPECT_FALSE(*waited) << "nothing is in flight";
}

TEST_F(ViewerTest, APictureThatStaysGetsItsSamplesAndThenNothingIsDrawn) {
    for (const bool framesAhead : {false, true}) {
        openViewer(0, *folder_ / "ball.vcp", 0, framesAhead, 6);
        // Until all is there, pictures have one sample.
        while (viewer_->framesDrawn() == 0 || !viewer_->status().update.settled) {
            turn(0.5);
            EXPECT_LE(viewer_->status().samples, 1u);
        }
        settle();
        EXPECT_EQ(viewer_->status().samples, 6u);
        const Picture refined = *viewer_->renderer().readPicture();
        for (int i = 0; i < 20; ++i) EXPECT_FALSE(turn(0.1));
        EXPECT_TRUE(std::isinf(next_.waitSeconds)) << "a viewer at rest waits for events alone";

        // A change begins with one sample, and ends with all.
        const uint64_t drawn = viewer_->framesDrawn();
        viewer_->act(ViewerAction::ToggleLight);
        EXPECT_TRUE(turn(0.1));
        EXPECT_EQ(viewer_->framesDrawn(), drawn + 1);
        EXPECT_EQ(viewer_->status().samples, 1u);
        EXPECT_EQ(next_.waitSeconds, 0) << "the next sample follows";
        settle();
        EXPECT_EQ(viewer_->framesDrawn(), drawn + 6);
        EXPECT_EQ(*viewer_->renderer().readPicture(), refined) << "the light is where it was";

        // False colours have one.
        Shading shading = viewer_->shading();
        shading.mode = ShadingMode::Level;
        viewer_->setShading(shading);
        settle();
        EXPECT_EQ(viewer_->framesDrawn(), drawn + 7);
    }
}

TEST_F(ViewerTest, InputInterruptsSamplesAtOnce) {
    for (const bool framesAhead : {false, true}) {
        openViewer(50, *folder_ / "ball.vcp", 0, framesAhead, kUsualSamples);
        settle();
        viewer_->act(ViewerAction::ToggleShadows);
        for (int i = 0; i < 10; ++i) EXPECT_TRUE(turn(0.1));
        const uint32_t samples = viewer_->status().samples;
        EXPECT_GT(samples, 2u);
        EXPECT_LT(samples, kUsualSamples);
        viewer_->press(MouseButton::Left, {160, 120});
        viewer_->move({170, 120});
        EXPECT_TRUE(turn(0.01));
        EXPECT_EQ(viewer_->status().samples, 1u) << "the new view is what is drawn next";
        // While the camera moves, and shortly after, there is one sample.
        viewer_->move({171, 120});
        EXPECT_TRUE(turn(0.01));
        EXPECT_FALSE(turn(0.01));
        EXPECT_EQ(viewer_->status().samples, 1u);
        EXPECT_GT(next_.waitSeconds, 0);
        EXPECT_LE(next_.waitSeconds, 0.15);
        EXPECT_TRUE(turn(0.2));
        settle();
        EXPECT_EQ(viewer_->status().samples, kUsualSamples);
    }
}

TEST_F(ViewerTest, DrawsOnlyWhenSomethingChanged) {
    openViewer();
    settle();
    const uint64_t drawn = viewer_->framesDrawn();
    EXPECT_GT(drawn, 0u);
    for (int i = 0; i < 20; ++i) EXPECT_FALSE(turn(0.1));
    EXPECT_TRUE(std::isinf(next_.waitSeconds)) << "a viewer at rest waits for events alone";
    viewer_->move({10, 10});
    EXPECT_FALSE(turn(0.1)) << "no button is held";
    viewer_->act(ViewerAction::Fit);
    viewer_->act(ViewerAction::Reset);
    EXPECT_FALSE(turn(0.1)) << "the camera is where it was";
    EXPECT_EQ(viewer_->framesDrawn(), drawn);

    viewer_->act(ViewerAction::ToggleLight);
    EXPECT_TRUE(turn(0.1));
    EXPECT_FALSE(turn(0.1));
    viewer_->press(MouseButton::Left, {160, 120});
    viewer_->move({170, 120});
    EXPECT_TRUE(turn(0.1));
    settle();
    EXPECT_FALSE(turn(0.1));
}

TEST_F(ViewerTest, FitAndTheViewsKeepClearOfWhatTheHostCovers) {
    openViewer();
    viewer_->setCovered({.right = 120, .bottom = 20});
    for (const ViewerAction action : {ViewerAction::Fit, ViewerAction::ViewTop}) {
        viewer_->act(action);
        const glm::dvec2 middle = pixelOf(viewer_->bounds().centre());
        EXPECT_NEAR(middle.x, 100, 1e-9);
        EXPECT_NEAR(middle.y, 110, 1e-9);
    }
}

TEST_F(ViewerTest, LooksAreSwitchedAndSwitchedBack) {
    openViewer();
    settle();
    const Picture plain = viewer_->renderer().readPicture().value();
    for (const ViewerAction action :
         {ViewerAction::ToggleShadows, ViewerAction::ToggleOcclusion, ViewerAction::ToggleSection}) {
        viewer_->act(action);
        EXPECT_TRUE(turn(0.5));
        const Picture with = viewer_->renderer().readPicture().value();
        viewer_->act(action);
        EXPECT_TRUE(turn(0.5));
        EXPECT_EQ(viewer_->renderer().readPicture().value(), plain);
        if (action == ViewerAction::ToggleSection) {
            EXPECT_NE(with, plain);
        }
    }
    const ShadingMode first = viewer_->shading().mode;
    do {
        viewer_->act(ViewerAction::NextShading);
        EXPECT_TRUE(turn(0.5));
    } while (viewer_->shading().mode != first);
    EXPECT_EQ(viewer_->renderer().readPicture().value(), plain);
}

TEST_F(ViewerTest, ShiftAndTheWheelMoveTheSection) {
    openViewer();
    viewer_->act(ViewerAction::ViewFront);
    viewer_->act(ViewerAction::ToggleSection);
    settle();
    const double before = glm::length(*viewer_->pointAt(glm::dvec2(kSize) / 2.0) - viewer_->camera().position);
    viewer_->scroll(glm::dvec2(kSize) / 2.0, 5, true);
    settle();
    const double after = glm::length(*viewer_->pointAt(glm::dvec2(kSize) / 2.0) - viewer_->camera().position);
    EXPECT_GT(after, before * 1.01);
}

// Occlusion is left out while the camera moves, and comes back at rest.
TEST_F(ViewerTest, OcclusionWaitsForRest) {
    openViewer();
    viewer_->act(ViewerAction::ToggleOcclusion);
    settle();
    viewer_->press(MouseButton::Left, {160, 120});
    viewer_->move({170, 120});
    EXPECT_TRUE(turn(0.01));
    EXPECT_FALSE(std::isinf(next_.waitSeconds));
    viewer_->release(MouseButton::Left);
    EXPECT_TRUE(turn(0.5)) << "once more, with occlusion";
    EXPECT_FALSE(turn(0.1));
}

TEST_F(ViewerTest, OcclusionStaysWhereItTakesLittle) {
    openViewer(1e9);
    viewer_->act(ViewerAction::ToggleOcclusion);
    settle();
    viewer_->press(MouseButton::Left, {160, 120});
    viewer_->move({170, 120});
    EXPECT_TRUE(turn(0.01));
    const Picture moving = viewer_->renderer().readPicture().value();
    viewer_->release(MouseButton::Left);
    EXPECT_FALSE(turn(0.5)) << "nothing is left to be drawn";
    viewer_->act(ViewerAction::ToggleOcclusion);
    EXPECT_TRUE(turn(0.1));
    EXPECT_NE(viewer_->renderer().readPicture().value(), moving) << "it had occlusion";
}

// The handle of a section plane: its tip stays under the cursor, its foot where it is while the ring turns.
TEST_F(ViewerTest, SectionIsMovedByItsArrow) {
    openViewer();
    viewer_->setSections({{{2, 0, 0}, 0.1}});
    settle();
    EXPECT_TRUE(viewer_->sectionHandles().empty()) << "nobody draws them yet";
    viewer_->showSectionHandles(1);
    ASSERT_EQ(viewer_->sectionHandles().size(), 1u);
    const SectionHandle handle = viewer_->sectionHandles().front();
    const OrbitCamera camera = viewer_->camera();
    viewer_->move({5, 5});
    EXPECT_EQ(viewer_->sectionGrab(), SectionGrab{});
    viewer_->move(handle.tip);
    EXPECT_EQ(viewer_->sectionGrab(), (SectionGrab{SectionGrip::Move, 0}));
    viewer_->press(MouseButton::Left, handle.tip);
    viewer_->move(handle.tip + glm::dvec2(25, 7));
    EXPECT_TRUE(turn(0.1));
    EXPECT_NEAR(viewer_->sectionHandles().front().tip.x, handle.tip.x + 25, 0.5);
    EXPECT_GT(viewer_->sections().front().offset, 0.1);
    EXPECT_EQ(viewer_->sections().front().normal, glm::dvec3(2, 0, 0));
    viewer_->move(handle.tip);
    EXPECT_DOUBLE_EQ(viewer_->sections().front().offset, 0.1);
    viewer_->move(handle.tip + glm::dvec2(-30, 0));
    EXPECT_TRUE(viewer_->cancelSectionDrag());
    EXPECT_EQ(viewer_->sections().front(), (SectionPlane{{2, 0, 0}, 0.1}));
    EXPECT_FALSE(viewer_->cancelSectionDrag());
    viewer_->move(handle.tip + glm::dvec2(-60, 0));
    viewer_->release(MouseButton::Left);
    EXPECT_EQ(viewer_->sections().front().offset, 0.1) << "what was cancelled is over";
    EXPECT_EQ(viewer_->camera().position, camera.position);
}

TEST_F(ViewerTest, SectionAlongTheViewIsMovedUpAndDown) {
    openViewer();
    viewer_->showSectionHandles(1);
    viewer_->act(ViewerAction::ToggleSection);
    settle();
    const SectionHandle handle = viewer_->sectionHandles().front();
    ASSERT_TRUE(handle.isAlongView);
    const glm::dvec3 before = viewer_->pointAt(handle.foot).value();
    viewer_->press(MouseButton::Left, handle.foot);
    viewer_->move(handle.foot - glm::dvec2(0, 30));
    viewer_->release(MouseButton::Left);
    settle();
    const double unitsPerPixel = viewer_->camera().viewHeight() / kSize.y;
    EXPECT_NEAR(glm::dot(viewer_->pointAt(handle.foot).value() - before, viewer_->camera().forwardVector()),
                30 * unitsPerPixel, 0.01);
}

TEST_F(ViewerTest, SectionIsTurnedByItsRingAboutItsFoot) {
    openViewer();
    viewer_->showSectionHandles(1);
    viewer_->setSections({{{0, 0, -1}, 0.2}});
    settle();
    const SectionHandle handle = viewer_->sectionHandles().front();
    const glm::dvec2 grip =
        *std::max_element(handle.ring.begin(), handle.ring.end(), [](auto a, auto b) { return a.x < b.x; });
    viewer_->press(MouseButton::Left, grip);
    EXPECT_EQ(viewer_->sectionGrab().grip, SectionGrip::Turn);
    viewer_->move(grip + glm::dvec2(24, 0));
    EXPECT_TRUE(turn(0.1));
    const SectionPlane turned = viewer_->sections().front();
    EXPECT_NEAR(glm::dot(turned.normal, handle.anchor), turned.offset, 1e-9);
    EXPECT_NEAR(std::acos(glm::dot(turned.normal, glm::dvec3(0, 0, -1))), 0.5, 1e-9)
        << "half the ring's radius is half a radian";
    EXPECT_NEAR(turned.normal.y, 0, 1e-6);
    viewer_->release(MouseButton::Left);
    EXPECT_LT(glm::distance(viewer_->sectionHandles().front().anchor, handle.anchor), 1e-9);
    // The way back ends where it began, and another drag turns about the same foot.
    const SectionHandle now = viewer_->sectionHandles().front();
    viewer_->press(MouseButton::Left, now.foot);
    EXPECT_EQ(viewer_->sectionGrab().grip, SectionGrip::Move);
    viewer_->release(MouseButton::Left);
    EXPECT_EQ(viewer_->sections().front(), turned);
}

TEST_F(ViewerTest, PictureShowsTheDatasetAndBackground) {
    openViewer();
    settle();
    const double pixels = kSize.x * kSize.y;
    EXPECT_GT(double(viewer_->status().frame.hitPixels), 0.2 * pixels);
    EXPECT_LT(double(viewer_->status().frame.hitPixels), 0.7 * pixels);
    const auto centre = viewer_->pointAt(glm::dvec2(kSize) / 2.0);
    ASSERT_TRUE(centre);
    EXPECT_NEAR(glm::length(*centre), 1, 0.06);
    EXPECT_FALSE(viewer_->pointAt({1, 1}));
    EXPECT_FALSE(viewer_->pointAt({-1, 5}));
    EXPECT_FALSE(viewer_->pointAt({5, 1e9}));
}

// The three moves, seen through the pictures: what was under the cursor is still there in the next picture.
TEST_F(ViewerTest, OrbitKeepsThePointUnderTheCursor) {
    openViewer();
    settle();
    const glm::dvec2 cursor(190.5, 100.5);
    const glm::dvec3 before = viewer_->pointAt(cursor).value();
    viewer_->press(MouseButton::Left, cursor);
    viewer_->move(cursor + glm::dvec2(9, 4));
    viewer_->release(MouseButton::Left);
    settle();
    EXPECT_LT(glm::distance(pixelOf(before), cursor), 0.75);
    EXPECT_LT(glm::distance(viewer_->pointAt(cursor).value(), before), 0.03);
}

TEST_F(ViewerTest, OrbitBesideTheSurfaceTurnsAboutTheMiddle) {
    openViewer();
    settle();
    const double distance = glm::length(viewer_->camera().position);
    viewer_->press(MouseButton::Left, {2, 2});
    viewer_->move({60, 30});
    viewer_->release(MouseButton::Left);
    EXPECT_NEAR(glm::length(viewer_->camera().position), distance, 0.05);
    EXPECT_LT(glm::distance(pixelOf({0, 0, 0}), glm::dvec2(kSize) / 2.0), 3);
}

TEST_F(ViewerTest, PanMovesThePointWithTheCursor) {
    for (const bool shifted : {false, true}) {
        openViewer();
        settle();
        const glm::dvec2 from(150.5, 110.5), to(121.5, 160.5);
        const glm::dvec3 point = viewer_->pointAt(from).value();
        viewer_->press(shifted ? MouseButton::Left : MouseButton::Right, from, {.shift = shifted});
        viewer_->move((from + to) / 2.0);
        viewer_->move(to);
        viewer_->release(shifted ? MouseButton::Left : MouseButton::Right);
        settle();
        EXPECT_LT(glm::distance(pixelOf(point), to), 0.75);
        EXPECT_LT(glm::distance(viewer_->pointAt(to).value(), point), 0.03);
    }
}

TEST_F(ViewerTest, WheelZoomsToTheCursorInBothProjections) {
    for (const bool orthographic : {false, true}) {
        openViewer();
        if (orthographic) viewer_->act(ViewerAction::ToggleProjection);
        settle();
        const glm::dvec2 cursor(200.5, 90.5);
        const glm::dvec3 point = viewer_->pointAt(cursor).value();
        const double height = viewer_->camera().viewHeight();
        for (int i = 0; i < 6; ++i) viewer_->scroll(cursor, 1);
        EXPECT_LT(viewer_->camera().viewHeight(), height);
        settle();
        EXPECT_LT(glm::distance(pixelOf(point), cursor), 1.5) << "orthographic " << orthographic;
        EXPECT_LT(glm::distance(viewer_->pointAt(cursor).value(), point), 0.03);
        for (int i = 0; i < 200; ++i) viewer_->scroll(cursor, -1);
        EXPECT_TRUE(std::isfinite(viewer_->camera().focusDistance));
        settle();
        viewer_->act(ViewerAction::Fit);
        settle();
        EXPECT_TRUE(viewer_->pointAt(glm::dvec2(kSize) / 2.0));
    }
}

TEST_F(ViewerTest, ResetGoesHome) {
    openViewer();
    settle();
    const OrbitCamera home = viewer_->camera();
    viewer_->scroll({100, 100}, 3);
    viewer_->act(ViewerAction::ViewIsometric);
    EXPECT_NE(viewer_->camera().position, home.position);
    viewer_->act(ViewerAction::Reset);
    EXPECT_EQ(viewer_->camera().position, home.position);
    EXPECT_EQ(viewer_->camera().orientation, home.orientation);
}

// Where a preset, a double click or a bookmark sends the camera, it goes smoothly, and stops for the next press.
TEST_F(ViewerTest, SmoothMovesArriveAndAreInterrupted) {
    openViewer(0, *folder_ / "ball.vcp", 1);
    settle();
    OrbitCamera there = viewer_->camera();
    there.look(View::Isometric, viewer_->bounds(), kSize);
    viewer_->act(ViewerAction::ViewIsometric);
    EXPECT_FALSE(turn(0.5)) << "it begins now, however long nothing happened";
    EXPECT_EQ(next_.waitSeconds, 0);
    EXPECT_TRUE(turn(0.5));
    const glm::dvec3 halfway = viewer_->camera().position;
    EXPECT_NE(halfway, there.position);
    EXPECT_TRUE(turn(0.6));
    EXPECT_EQ(viewer_->camera().position, there.position);
    EXPECT_EQ(viewer_->camera().orientation, there.orientation);
    settle();
    EXPECT_TRUE(std::isinf(next_.waitSeconds));

    viewer_->act(ViewerAction::ViewTop);
    turn(0.1);
    turn(0.5);
    const glm::dvec3 stopped = viewer_->camera().position;
    viewer_->press(MouseButton::Left, {160, 120});
    viewer_->release(MouseButton::Left);
    turn(0.5);
    EXPECT_EQ(viewer_->camera().position, stopped);
}

TEST_F(ViewerTest, DoubleClickCentresThePoint) {
    openViewer();
    settle();
    const glm::dvec2 cursor(200.5, 90.5);
    const glm::dvec3 point = viewer_->pointAt(cursor).value();
    const double distance = viewer_->camera().focusDistance;
    viewer_->centreOn(cursor);
    settle();
    EXPECT_LT(glm::distance(pixelOf(point), glm::dvec2(kSize) / 2.0), 0.01);
    EXPECT_DOUBLE_EQ(viewer_->camera().focusDistance, distance);
    const OrbitCamera before = viewer_->camera();
    viewer_->centreOn({1, 1});
    EXPECT_EQ(viewer_->camera().position, before.position) << "nothing is there";
}

TEST_F(ViewerTest, FlyingMovesWhileTheKeyIsHeldAndDragsTurnTheHead) {
    openViewer();
    settle();
    const OrbitCamera home = viewer_->camera();
    viewer_->act(ViewerAction::ToggleFly);
    EXPECT_TRUE(viewer_->isFlying());
    EXPECT_FALSE(turn(0.1)) << "no key is held";
    viewer_->fly({0, 0, 1});
    EXPECT_TRUE(turn(0.1));
    EXPECT_EQ(next_.waitSeconds, 0);
    const double step = glm::dot(viewer_->camera().position - home.position, home.forwardVector());
    EXPECT_NEAR(step, 0.1 * viewer_->bounds().diagonal() / 4, 1e-9);
    viewer_->scroll({10, 10}, 3);
    turn(0.1);
    EXPECT_GT(glm::dot(viewer_->camera().position - home.position, home.forwardVector()), 2.5 * step);
    const glm::dvec3 before = viewer_->camera().position;
    turn(60);
    EXPECT_LT(glm::distance(viewer_->camera().position, before), 2.5 * step) << "a hiccup is no leap";
    viewer_->fly({});
    const glm::dvec3 rest = viewer_->camera().position;
    viewer_->press(MouseButton::Left, {160, 120});
    viewer_->move({180, 110});
    viewer_->release(MouseButton::Left);
    EXPECT_LT(glm::distance(viewer_->camera().position, rest), 1e-12);
    EXPECT_NE(viewer_->camera().orientation, home.orientation);
    viewer_->act(ViewerAction::ToggleFly);
    EXPECT_FALSE(viewer_->isFlying());
}

// The light goes where the hand goes, whatever it is tied to.
TEST_F(ViewerTest, ControlDragTurnsTheLightAndNothingElse) {
    openViewer();
    for (const bool follows : {true, false}) {
        if (!follows) {
            viewer_->act(ViewerAction::ViewIsometric);
            viewer_->act(ViewerAction::ToggleLight);
        }
        settle();
        const auto inCamera = [&] {
            const glm::dvec3 light(viewer_->shading().lightDirection);
            return glm::normalize(follows ? light : glm::conjugate(viewer_->camera().orientation) * light);
        };
        const OrbitCamera camera = viewer_->camera();
        const glm::dvec3 before = inCamera();
        viewer_->press(MouseButton::Left, {160, 120}, {.control = true});
        viewer_->move({180, 120});
        EXPECT_GT(inCamera().x, before.x + 0.05);
        viewer_->move({180, 140});
        EXPECT_LT(inCamera().y, before.y - 0.05);
        viewer_->release(MouseButton::Left);
        EXPECT_EQ(viewer_->camera().position, camera.position);
        EXPECT_TRUE(turn(0.1));
    }
}

TEST_F(ViewerTest, TheUpAxisChangesAndTheEyeStays) {
    openViewer();
    viewer_->act(ViewerAction::ViewIsometric);
    settle();
    const OrbitCamera before = viewer_->camera();
    viewer_->act(ViewerAction::ToggleUpAxis);
    EXPECT_EQ(viewer_->camera().up, UpAxis::Z);
    EXPECT_EQ(viewer_->camera().position, before.position);
    EXPECT_LT(glm::distance(viewer_->camera().forwardVector(), before.forwardVector()), 1e-9);
    EXPECT_NEAR(viewer_->camera().rightVector().z, 0, 1e-9);
    settle();
    viewer_->act(ViewerAction::ToggleUpAxis);
    EXPECT_LT(glm::distance(viewer_->camera().upVector(), before.upVector()), 1e-9);
}

// Switching what the light is tied to changes nothing until the camera moves.
TEST_F(ViewerTest, LightStaysWhereItIsWhenItsTieChanges) {
    openViewer();
    viewer_->act(ViewerAction::ViewIsometric);
    settle();
    const Picture before = viewer_->renderer().readPicture().value();
    viewer_->act(ViewerAction::ToggleLight);
    settle();
    const Picture after = viewer_->renderer().readPicture().value();
    ASSERT_EQ(before.rgba.size(), after.rgba.size());
    int largest = 0;
    for (size_t i = 0; i < before.rgba.size(); ++i)
        largest = std::max(largest, std::abs(before.rgba[i] - after.rgba[i]));
    EXPECT_LE(largest, 2);
    viewer_->act(ViewerAction::ViewFront);
    settle();
    const Picture fixed = viewer_->renderer().readPicture().value();
    viewer_->act(ViewerAction::ViewIsometric);
    viewer_->act(ViewerAction::ToggleLight);
    viewer_->act(ViewerAction::ViewFront);
    settle();
    EXPECT_NE(viewer_->renderer().readPicture().value(), fixed);
}

TEST_F(ViewerTest, ResizeAndMinimize) {
    openViewer();
    settle();
    viewer_->resize({200, 300});
    EXPECT_TRUE(turn(0.1));
    settle();
    EXPECT_EQ(viewer_->renderer().readPicture()->width, 200u);
    EXPECT_EQ(viewer_->renderer().readPicture()->height, 300u);
    viewer_->resize({0, 0});
    EXPECT_FALSE(turn(0.1));
    EXPECT_TRUE(std::isinf(next_.waitSeconds));
    viewer_->press(MouseButton::Left, {0, 0});
    viewer_->move({10, 10});
    viewer_->release(MouseButton::Left);
    viewer_->scroll({0, 0}, 1);
    viewer_->act(ViewerAction::Fit);
    EXPECT_FALSE(turn(0.1));
    viewer_->resize({200, 300});
    settle();
    EXPECT_FALSE(turn(0.1));
    viewer_->resize({1, 1});
    settle();
    EXPECT_EQ(viewer_->renderer().readPicture()->rgba.size(), 4u);
}

TEST_F(ViewerTest, LowerResolutionWhileMovingThenFull) {
    openViewer(1e-6);
    settle();
    viewer_->act(ViewerAction::ToggleLight);  // a second full frame: the first is not believed
    settle();
    viewer_->press(MouseButton::Left, {160, 120});
    viewer_->move({165, 120});
    ASSERT_TRUE(turn(0.01));
    EXPECT_EQ(viewer_->status().reduction, 8);
    EXPECT_EQ(viewer_->renderer().readPicture()->width, 40u);
    EXPECT_LE(next_.waitSeconds, 0.5) << "comes back by itself for the full picture";
    EXPECT_TRUE(viewer_->pointAt({160, 120})) << "picking works in the smaller picture";
    ASSERT_TRUE(turn(0.5));
    EXPECT_EQ(viewer_->status().reduction, 1);
    EXPECT_EQ(viewer_->renderer().readPicture()->width, 320u);
    settle();
    EXPECT_TRUE(std::isinf(next_.waitSeconds));
}

TEST_F(ViewerTest, AViewThatHoldsStillIsNotMadeCoarser) {
    openViewer(1e-6);
    while (viewer_->framesDrawn() == 0) turn(0.5);  // the first frame says nothing of the next
    viewer_->press(MouseButton::Left, {160, 120});
    viewer_->move({165, 120});
    ASSERT_TRUE(turn(0.01));
    EXPECT_EQ(viewer_->status().reduction, 1);
    for (int i = 0; i < 10; ++i) turn(0.01);
    EXPECT_EQ(viewer_->status().reduction, 1);
    viewer_->move({170, 120});
    ASSERT_TRUE(turn(0.01));
    EXPECT_EQ(viewer_->status().reduction, 8) << "the next movement knows what the last frame took";
}

TEST_F(ViewerTest, BrokenPageIsSaidAndTheRestIsShown) {
    const auto file = *folder_ / "broken.vcp";
    std::filesystem::copy_file(*folder_ / "ball.vcp", file, std::filesystem::copy_options::overwrite_existing);
    {
        auto dataset = readDataset(**openFile(file)).value();
        ASSERT_GT(dataset.pages.size(), 1u) << "the ball has one page only";
        std::FILE* bytes = std::fopen(file.c_str(), "r+b");
        std::fseek(bytes, long(dataset.pages[1].offset + 20), SEEK_SET);
        const int old = std::fgetc(bytes);
        std::fseek(bytes, long(dataset.pages[1].offset + 20), SEEK_SET);
        std::fputc(old ^ 1, bytes);
        std::fclose(bytes);
    }
    openViewer(0, file);
    settle();
    EXPECT_NE(viewer_->status().problem.find("broken.vcp"), std::string::npos) << viewer_->status().problem;
    EXPECT_GT(viewer_->status().frame.hitPixels, 0u);
}

TEST_F(ViewerTest, StatusLineSaysWhatMatters) {
    openViewer();
    settle();
    const std::string line = statusLine(viewer_->status());
    EXPECT_NE(line.find("ball.ply"), std::string::npos) << line;
    EXPECT_NE(line.find(" triangles"), std::string::npos) << line;
    EXPECT_NE(line.find("settled"), std::string::npos) << line;
    EXPECT_NE(line.find(viewer_->status().device), std::string::npos) << line;
    EXPECT_EQ(line.find("(software)") != std::string::npos, viewer_->renderer().device().software) << line;
    EXPECT_EQ(line.find('\n'), std::string::npos);
}

TEST_F(ViewerTest, StatusSaysWhatLimitsTheDetail) {
    UpdateResult update;
    update.errorPixels = 3;
    EXPECT_EQ(detailOf(update, 0.5), Detail::Loading);
    update.settled = true;
    EXPECT_EQ(detailOf(update, 3), Detail::Settled);
    EXPECT_EQ(detailOf(update, 0.5), Detail::Finest);
    update.relaxed = true;
    EXPECT_EQ(detailOf(update, 0.5), Detail::Budget);

    openViewer();
    settle();
    EXPECT_EQ(viewer_->status().detail, Detail::Settled);
    viewer_->setErrorPixels(1e-6);
    settle();
    EXPECT_EQ(viewer_->status().detail, Detail::Finest);
    EXPECT_NE(statusLine(viewer_->status()).find("settled, finest level"), std::string::npos);
}

TEST_F(ViewerTest, StatusLineKeepsToItsRoom) {
    ViewerStatus status;
    status.name = "a_rather_long_name_of_a_scan_from_a_museum.ply";
    status.triangles = 100'000'000;
    status.levels = 9;
    status.update.drawable = true;
    status.update.finestLevel = 8;
    status.reduction = 2;
    status.device = "a graphics card with a long name (driver 1.2.3, 256 bits)";
    for (const size_t most : {40u, 80u, 107u, 200u}) EXPECT_LE(statusLine(status, most).size(), most);
    EXPECT_NE(statusLine(status, 60).find("loading"), std::string::npos) << statusLine(status, 60);
    EXPECT_NE(statusLine(status).find(status.name), std::string::npos);
    EXPECT_NE(statusLine(status).find(status.device), std::string::npos);
    EXPECT_EQ(formatPixels(0.456), "0.46");
    EXPECT_EQ(formatPixels(512), "512");
    status.without = "no shadows";
    EXPECT_NE(statusLine(status, 60).find("no shadows"), std::string::npos);
}

// Caps are the plane itself, to the last digits.
TEST_F(ViewerTest, CapsArePickedOnThePlane) {
    openViewer();
    viewer_->setSections({{{0, 0, -1}, -0.25}});
    viewer_->setSectionCaps(Caps::Closed);
    settle();
    const auto cap = viewer_->capAt(glm::dvec2(kSize) / 2.0);
    ASSERT_TRUE(cap);
    EXPECT_NEAR(cap->z, 0.25, 1e-12);
    EXPECT_LT(glm::distance(pixelOf(*cap), glm::dvec2(kSize) / 2.0), 1e-6);
    EXPECT_FALSE(viewer_->capAt({2, 2}));
    viewer_->setSections({});
    settle();
    EXPECT_FALSE(viewer_->capAt(glm::dvec2(kSize) / 2.0));
}

TEST_F(ViewerTest, TwoDatasetsAreOneScene) {
    openViewer();
    const auto dataset = viewer_->dataset();
    const uint64_t triangles = viewer_->status().triangles;
    auto reader = openFile(*folder_ / "ball.vcp").value();
    const auto source = [&] { return std::make_shared<FilePageSource>(reader, dataset); };
    const Similarity beside{glm::angleAxis(1.0, glm::dvec3(0, 0, 1)), 0.5, {3, 0, 0}};
    ASSERT_TRUE(
        viewer_->open({{dataset, source(), {}}, {dataset, source(), beside}}, {}, viewer_->camera(), "two balls"));
    EXPECT_EQ(viewer_->status().triangles, 2 * triangles);
    EXPECT_GT(viewer_->bounds().high.x, 3.4);
    viewer_->act(ViewerAction::Fit);
    settle();
    const auto second = viewer_->pointAt(pixelOf({3, 0, 0}));
    ASSERT_TRUE(second);
    EXPECT_NEAR(glm::distance(*second, glm::dvec3(3, 0, 0)), 0.5, 0.06);
    // What is in memory, and what rays met: kept when it is asked for.
    const auto pages = viewer_->renderer().residentPages();
    EXPECT_EQ(pages.size(), viewer_->status().update.pagesResident);
    const auto drawn = std::count_if(pages.begin(), pages.end(), [](const PageBox& page) { return page.isDrawn; });
    EXPECT_EQ(uint32_t(drawn), viewer_->status().update.pagesInCut);
    for (const PageBox& page : pages) EXPECT_NEAR(glm::length(page.edges[0]), glm::length(page.edges[2]), 1e-9);
    EXPECT_FALSE(viewer_->renderer().feedbackPicture());
    viewer_->renderer().keepFeedback(true);
    ASSERT_TRUE(
        viewer_->open({{dataset, source(), {}}, {dataset, source(), beside}}, {}, viewer_->camera(), "two balls"));
    settle();
    const auto& heard = viewer_->renderer().feedbackPicture();
    ASSERT_TRUE(heard) << "no frame missed pages";
    EXPECT_GT(
        std::count_if(heard->errorPixels.begin(), heard->errorPixels.end(), [](float error) { return error > 0; }), 10);
    EXPECT_LT(heard->errorPixels[0], 0) << "nothing is in the corner";
}

TEST_F(ViewerTest, SurfacesAreShownWithAndWithoutDatasets) {
    openViewer();
    MesoSurfaceDescription relief;
    relief.asset = "hemispheres", relief.tiles = 2, relief.place = {3, 0, 0}, relief.method.name = "pyramid";
    const auto surfaces = makeMesoScene({&relief, 1});
    ASSERT_TRUE(surfaces) << surfaces.error().line();
    const auto dataset = viewer_->dataset();
    const Box ball = viewer_->bounds();
    auto reader = openFile(*folder_ / "ball.vcp").value();
    for (const bool withBall : {false, true}) {
        std::vector<PlacedDataset> datasets;
        if (withBall) datasets.push_back({dataset, std::make_shared<FilePageSource>(reader, dataset), {}});
        const Box bounds = withBall ? surfaces->bounds.joined(ball) : surfaces->bounds;
        OrbitCamera camera;
        camera.look(View::Isometric, bounds, kSize);
        ASSERT_TRUE(viewer_->open(datasets, *surfaces, camera, "relief"));
        EXPECT_EQ(viewer_->bounds().low, bounds.low);
        settle();
        const auto hit = viewer_->hitAt(pixelOf({3, 0, 0}));
        ASSERT_TRUE(hit);
        EXPECT_TRUE(hit->onSurface);
        // The point under the cursor stays where it is while the camera turns about it.
        const glm::dvec2 cursor = pixelOf(hit->position);
        viewer_->press(MouseButton::Left, cursor);
        viewer_->move(cursor + glm::dvec2(40, 10));
        viewer_->release(MouseButton::Left);
        EXPECT_TRUE(turn(0.1));
        EXPECT_LT(glm::distance(pixelOf(hit->position), cursor), 2);
        settle();
        EXPECT_EQ(viewer_->status().update.pagesInCut > 0, withBall);
        EXPECT_NE(statusLine(viewer_->status()).find("mesostructure"), std::string::npos);
    }
    // What is opened next is shown without them.
    openViewer();
    settle();
    EXPECT_EQ(viewer_->status().frame.surfaceBytes, 0u);
    EXPECT_FALSE(viewer_->open(std::vector<PlacedDataset>{}, MesoScene{}, viewer_->camera(), "nothing"));
}

/// A host's loop goes round while heights are measured, and nothing is drawn until they are.
TEST_F(ViewerTest, HeightsAreMeasuredInPartsAndMeasuringCanBeCancelled) {
    MesoSurfaceDescription relief;
    relief.asset = "ridged", relief.base = "torus", relief.tiles = 4, relief.method.name = kRemeshMethod;
    OrbitCamera camera;
    for (const bool isCancelled : {false, true}) {
        const auto surfaces = makeMesoScene({&relief, 1});
        ASSERT_TRUE(surfaces) << surfaces.error().line();
        ViewerOptions options;
        options.measuringMs = 0;
        viewer_ = *Viewer::create(options);
        viewer_->resize(kSize);
        camera.look(View::Isometric, surfaces->bounds, kSize);
        ASSERT_TRUE(viewer_->open({}, *surfaces, camera, "relief"));
        EXPECT_FALSE(viewer_->cancelMeasuring());
        std::vector<double> parts;
        while (!turn(0.1)) {
            parts.push_back(viewer_->status().measuredPart);
            ASSERT_LT(parts.back(), 1);
            EXPECT_FALSE(viewer_->status().update.settled);
            EXPECT_EQ(next_.waitSeconds, 0);
            EXPECT_NE(statusLine(viewer_->status()).find("measuring heights, "), std::string::npos);
            if (isCancelled && parts.size() == 2) break;
        }
        EXPECT_TRUE(std::ranges::is_sorted(parts));
        if (!isCancelled) {
            EXPECT_GT(parts.size(), 2u);
            EXPECT_EQ(viewer_->status().measuredPart, 1);
            settle();
            EXPECT_GT(viewer_->status().frame.remeshedPixels, 0);
            continue;
        }
        ASSERT_EQ(parts.size(), 2u);
        EXPECT_TRUE(viewer_->cancelMeasuring());
        for (int i = 0; i < 3; ++i) EXPECT_FALSE(turn(1));
        EXPECT_EQ(viewer_->framesDrawn(), 0u);
        // Another view is measured, and drawn.
        viewer_->scroll(glm::dvec2(kSize) / 2.0, 1);
        for (int i = 0; i < 1000 && !turn(0.1); ++i) {
        }
        EXPECT_EQ(viewer_->framesDrawn(), 1u);
    }
}

TEST_F(ViewerTest, WhatMovesGoesOnUntilItIsToStay) {
    openViewer();
    EXPECT_EQ(viewer_->whyWithout(ViewerAction::TogglePlay), "nothing moves in this scene");
    MesoSurfaceDescription ball;
    ball.asset = "ball", ball.path.points = {{0, 0, 0}, {4, 0, 0}};
    const auto surfaces = makeMesoScene({&ball, 1});
    ASSERT_TRUE(surfaces) << surfaces.error().line();
    OrbitCamera camera;
    camera.look(View::Isometric, surfaces->bounds, kSize);
    ASSERT_TRUE(viewer_->open({}, *surfaces, camera, "ball"));
    EXPECT_EQ(viewer_->whyWithout(ViewerAction::TogglePlay), "");
    while (!turn(0)) {
    }
    const auto placeNow = [&] { return viewer_->motion().surfacesMoved().front().x; };
    // Each turn shows it a little farther, and another one follows at once.
    for (int i = 1; i <= 3; ++i) {
        EXPECT_TRUE(turn(1));
        EXPECT_EQ(next_.waitSeconds, 0);
        EXPECT_NEAR(placeNow(), 0.5 * i, 1e-12);
        EXPECT_FALSE(viewer_->isAtRest());
    }
    viewer_->act(ViewerAction::TogglePlay);
    settle();
    EXPECT_FALSE(turn(1)) << "it stays, and nothing is drawn";
    EXPECT_NEAR(placeNow(), 1.5, 1e-12);
    EXPECT_EQ(viewer_->pictureOf(kSize).surfacesMoved.front().x, placeNow());
    viewer_->act(ViewerAction::TogglePlay);
    EXPECT_TRUE(turn(1));
    EXPECT_NEAR(placeNow(), 2, 1e-12);
}

TEST_F(ViewerTest, CallsBeforeADatasetDoNothing) {
    auto viewer = Viewer::create({});
    ASSERT_TRUE(viewer) << viewer.error().line();
    (*viewer)->resize(kSize);
    (*viewer)->press(MouseButton::Left, {1, 1});
    (*viewer)->move({5, 5});
    (*viewer)->scroll({5, 5}, 1);
    (*viewer)->act(ViewerAction::Fit);
    const auto next = (*viewer)->update(0);
    ASSERT_TRUE(next);
    EXPECT_TRUE(next->draw) << "the background, once";
    ASSERT_TRUE((*viewer)->draw());
    EXPECT_FALSE((*viewer)->update(1)->draw);
}

}  // namespace
}  // namespace vcp
