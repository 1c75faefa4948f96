// What the window of vcp view does, without the window: saving pictures between its frames.
#include "viewer/window/view_session.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <set>
#include <thread>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "octree/dataset_reader.h"
#include "render/picture.h"
#include "tests/support/built_ball.h"
#include "tests/support/encoder_in_path.h"
#include "tests/support/viewed_ball.h"
#include "viewer/camera/orbit_camera.h"
#include "viewer/window/window.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

constexpr PictureChoice kSmall{.size = {64, 48}};
constexpr PictureChoice kTwoTiles{.size = {600, 32}};

class ViewSessionTest : public ViewedBall {};

/// Sessions that remember, as vcp view has them: each reads the settings when it begins, and saves what was changed.
class RememberingSessionTest : public BuiltBall {
protected:
    void SetUp() override {
        if (!listDevices()) GTEST_SKIP() << "no Vulkan device";
    }
    void TearDown() override { fs::remove(settings_); }

    struct Remembering {
        std::unique_ptr<ViewSession> session;
        double now = 0;

        void open(const fs::path& file) {
            session->open({file.string()});
            for (int i = 0; i < 10000 && session->opening(); ++i) turn();
            EXPECT_TRUE(session->viewer().isOpen()) << session->problem();
        }
        void turn() {
            const auto next = session->update(now += 0.02);
            ASSERT_TRUE(next) << next.error().line();
            if (session->opening()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        /// Smooth moves are over.
        void rest() {
            for (int i = 0; i < 50; ++i) turn();
        }
    };

    /// `given`: which settings are given, and what they say.
    Remembering begin(const GivenSettings& given = {}, RenderSettings render = {}) {
        const auto user = readUserSettings(settings_);
        EXPECT_TRUE(user);
        SessionOptions options;
        options.user = *user;
        options.render = std::move(render);
        applyRemembered(options.render, options.user, given);
        auto session = ViewSession::create(options, {});
        EXPECT_TRUE(session) << session.error().line();
        Remembering made{*std::move(session)};
        made.session->viewer().resize({96, 64});
        return made;
    }
    void end(Remembering& each) {
        const auto saved = saveChanges(each.session->changes(), settings_);
        EXPECT_TRUE(saved) << saved.error().line();
        each.session.reset();
    }
    [[nodiscard]] fs::path ball() const { return *folder_ / "ball.vcp"; }
    fs::path copyOfBall(const std::string& name) const {
        fs::copy_file(ball(), *folder_ / name, fs::copy_options::overwrite_existing);
        return *folder_ / name;
    }
    /// The ball seen from a side with z up, lit from above and cut.
    fs::path scene() const {
        const fs::path path = *folder_ / "scene.json";
        std::ofstream(path) << R"({"datasets": [{"file": "ball.vcp"}], "lights": [{"direction": [0, 1, 0]}],
            "camera": {"position": [5, 0, 0], "target": [0, 0, 0], "up": [0, 0, 1], "up_axis": "z"}, "sections": [{"normal": [1, 0, 0], "offset": 0.1}]})";
        return path;
    }

    const fs::path settings_ = *folder_ / "view.json";
};

TEST_F(RememberingSessionTest, ThreeWindowsRememberThreeFiles) {
    Remembering windows[3] = {begin(), begin(), begin()};
    const fs::path files[3] = {copyOfBall("a.vcp"), copyOfBall("b.vcp"), copyOfBall("c.vcp")};
    for (int i = 0; i < 3; ++i) windows[i].open(files[i]);
    windows[1].session->keepBookmark(2);
    for (const int i : {2, 0, 1}) end(windows[i]);
    const auto read = readUserSettings(settings_);
    ASSERT_TRUE(read);
    EXPECT_EQ(read->recent, (std::vector<std::string>{files[1], files[0], files[2]}));
    EXPECT_EQ(read->bookmarks.count(files[1]), 1u);
}

TEST_F(RememberingSessionTest, OptionsHoldForOneRun) {
    RenderSettings render;
    render.up = UpAxis::Z;
    render.shading.shadows = true;
    render.shading.occlusionRays = 16;
    render.errorPixels = 7;
    render.budgetBytes = 64 << 20;
    render.shading.lightFollowsCamera = false;
    render.sections = {*parsePlane("x<50%")};
    Remembering given = begin({.shadows = true, .occlusion = true, .errorPixels = true, .budget = true}, render);
    given.open(ball());
    EXPECT_EQ(given.session->viewer().camera().up, UpAxis::Z);
    EXPECT_TRUE(given.session->viewer().shading().shadows);
    given.rest();
    end(given);

    Remembering plain = begin();
    plain.open(ball());
    EXPECT_EQ(plain.session->viewer().camera().up, UpAxis::Y);
    EXPECT_FALSE(plain.session->viewer().shading().shadows);
    EXPECT_EQ(plain.session->viewer().shading().occlusionRays, 0u);
    EXPECT_EQ(plain.session->viewer().errorPixels(), 0.5);
    EXPECT_EQ(plain.session->viewer().status().budgetBytes, 512u << 20);
    const auto json = contentOf(settings_);
    for (const char* field :
         {"up", "shadows", "occlusion", "error_pixels", "budget_bytes", "background", "width", "panel"})
        EXPECT_EQ(json.find(field), std::string::npos) << field << " in " << json;
}

TEST_F(RememberingSessionTest, TheAxisChosenByHandIsForScansWhoseShapeDoesNotSay) {
    std::ofstream(*folder_ / "terrain.obj") << "v 0 0 0\nv 9 0 1\nv 9 9 0\nv 0 9 1\nf 1 2 3\nf 1 3 4\n";
    BuildOptions build;
    build.inputs = {*folder_ / "terrain.obj"};
    build.output = *folder_ / "terrain.vcp";
    ASSERT_TRUE(buildOctree(build));
    Remembering first = begin();
    first.open(build.output);
    EXPECT_EQ(first.session->viewer().camera().up, UpAxis::Z);
    first.session->act(ViewerAction::ToggleUpAxis);
    first.rest();
    EXPECT_EQ(first.session->viewer().camera().up, UpAxis::Y);
    first.open(ball());
    EXPECT_EQ(first.session->viewer().camera().up, UpAxis::Y);
    EXPECT_FALSE(first.session->changes().up) << "of terrain it says nothing about others";
    first.session->act(ViewerAction::ToggleUpAxis);
    end(first);

    Remembering second = begin();
    second.open(ball());
    EXPECT_EQ(second.session->viewer().camera().up, UpAxis::Z);
}

TEST_F(RememberingSessionTest, WhatHandsChangeIsRememberedAlsoAfterOptions) {
    RenderSettings render;
    render.up = UpAxis::Z;
    render.shading.shadows = true;
    render.errorPixels = 7;
    render.budgetBytes = 64 << 20;
    Remembering first = begin({.shadows = true, .errorPixels = true, .budget = true}, render);
    first.open(ball());
    first.session->act(ViewerAction::ToggleUpAxis);  // to y, which is the default: nothing of it shows below
    first.rest();
    first.session->act(ViewerAction::ToggleUpAxis);
    // Off and on again: what it was, and by hand.
    first.session->act(ViewerAction::ToggleShadows);
    first.turn();
    first.session->act(ViewerAction::ToggleShadows);
    first.turn();
    first.session->viewer().setErrorPixels(3);
    ASSERT_TRUE(first.session->viewer().setBudget(96 << 20));
    first.session->togglePanel();
    first.session->act(ViewerAction::ToggleOcclusion);
    Shading shading = first.session->viewer().shading();
    shading.backgroundTop = {1, 0, 0};
    first.session->viewer().setShading(shading);  // and the window closes in the same turn
    end(first);

    Remembering second = begin();
    second.open(ball());
    EXPECT_EQ(second.session->viewer().camera().up, UpAxis::Z);
    EXPECT_TRUE(second.session->viewer().shading().shadows);
    EXPECT_EQ(second.session->viewer().shading().occlusionRays, kUsualOcclusionRays);
    EXPECT_EQ(second.session->viewer().shading().backgroundTop, glm::vec3(1, 0, 0));
    EXPECT_EQ(second.session->viewer().errorPixels(), 3);
    EXPECT_EQ(second.session->viewer().status().budgetBytes, 96u << 20);
    EXPECT_TRUE(second.session->user().panel);
    EXPECT_EQ(second.session->changes().shadows, std::nullopt) << "what is remembered is not changed";
}

TEST_F(RememberingSessionTest, TheBackgroundGoesWithTheThemeUntilOneIsChosen) {
    Remembering first = begin();
    first.open(ball());
    first.session->setTheme(ThemeChoice::Light);
    const glm::vec3 light = first.session->viewer().shading().backgroundTop;
    first.session->setTheme(ThemeChoice::Dark);
    EXPECT_NE(first.session->viewer().shading().backgroundTop, light);
    first.session->setTheme(ThemeChoice::Light);
    first.turn();
    EXPECT_EQ(first.session->changes().backgroundTop, std::nullopt) << "nobody chose it";
    end(first);

    Remembering second = begin();
    second.open(ball());
    EXPECT_EQ(second.session->user().theme, ThemeChoice::Light);
    EXPECT_EQ(second.session->viewer().shading().backgroundTop, light);
    Shading shading = second.session->viewer().shading();
    shading.backgroundTop = {1, 0, 0};
    second.session->viewer().setShading(shading);
    second.session->setTheme(ThemeChoice::Dark);
    EXPECT_EQ(second.session->viewer().shading().backgroundTop, glm::vec3(1, 0, 0));
    end(second);
    Remembering third = begin();
    third.session->setTheme(ThemeChoice::Light);
    EXPECT_EQ(third.session->viewer().shading().backgroundTop, glm::vec3(1, 0, 0));
}

// Annotations belong to the file: what was changed by hand is there again, in place of what its scene file says.
TEST_F(RememberingSessionTest, AnnotationsAreThereAgain) {
    Remembering first = begin();
    first.open(ball());
    first.session->setClicks(ViewSession::Clicks::Annotate);
    first.session->clickAt({48, 32});
    std::optional<size_t> made;
    for (int i = 0; i < 1000 && !made; ++i) {
        first.turn();
        made = first.session->takeNewPoint();
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    ASSERT_EQ(made, 0u);
    EXPECT_EQ(first.session->clicks(), ViewSession::Clicks::Nothing) << "one click, one annotation";
    EXPECT_NEAR(glm::length(first.session->points()[0].position), 1, 0.01) << "on the ball";
    first.session->changePoint(0, "Here", "Is something");
    end(first);

    Remembering second = begin();
    second.open(ball());
    ASSERT_EQ(second.session->points().size(), 1u);
    EXPECT_EQ(second.session->points()[0].title, "Here");
    EXPECT_EQ(second.session->points()[0].text, "Is something");
    EXPECT_EQ(second.session->annotations().points, second.session->points());
    second.open(copyOfBall("other.vcp"));
    EXPECT_TRUE(second.session->points().empty());
    second.open(ball());
    second.session->removePoint(0);
    end(second);
    Remembering third = begin();
    third.open(ball());
    EXPECT_TRUE(third.session->points().empty());
}

TEST_F(RememberingSessionTest, ANoteGoesByItself) {
    Remembering window = begin();
    window.open(ball());
    window.session->keepBookmark(1);
    window.turn();
    EXPECT_NE(window.session->note(), "");
    const auto next = window.session->update(window.now + 7);
    ASSERT_TRUE(next);
    EXPECT_LE(next->waitSeconds, 1) << "the window comes back to take it away";
    EXPECT_NE(window.session->note(), "");
    ASSERT_TRUE(window.session->update(window.now + 9));
    EXPECT_EQ(window.session->note(), "");
    ASSERT_EQ(window.session->layers().size(), 1u);
    EXPECT_EQ(window.session->layers().front().name, "ball.vcp");
    EXPECT_GT(window.session->layers().front().triangles, 0u);
}

TEST_F(RememberingSessionTest, ScenesBookmarksAndPastedCamerasTurnNothingOver) {
    Remembering first = begin();
    first.open(scene());
    EXPECT_EQ(first.session->viewer().camera().up, UpAxis::Z);
    first.session->keepBookmark(1);
    first.rest();
    first.session->goToBookmark(1);
    first.rest();
    first.session->pasteCamera(cameraToJson(first.session->viewer().camera()));
    first.rest();
    EXPECT_EQ(first.session->changes().up, std::nullopt);
    first.open(ball());
    EXPECT_EQ(first.session->viewer().camera().up, UpAxis::Y) << "nor what is opened next";
    EXPECT_TRUE(first.session->viewer().sections().empty());
    end(first);
    Remembering second = begin();
    second.open(ball());
    EXPECT_EQ(second.session->viewer().camera().up, UpAxis::Y);
    EXPECT_TRUE(second.session->viewer().sections().empty());
    EXPECT_TRUE(second.session->viewer().shading().lightFollowsCamera);
}

/// A session whose builds stand still once they have read, until they are let go.
class PreviewSessionTest : public BuiltBall {
protected:
    void SetUp() override {
        if (!listDevices()) GTEST_SKIP() << "no Vulkan device";
        setenv("XDG_CACHE_HOME", (*folder_ / "cache").c_str(), 1);
        SessionOptions options;
        options.makeProgress = [this] {
            return [this](const BuildProgress& at) {
                while (at.stage == "sorting" && !isLetGo_) std::this_thread::sleep_for(std::chrono::milliseconds(1));
                return true;
            };
        };
        auto session = ViewSession::create(options, {});
        ASSERT_TRUE(session) << session.error().line();
        session_ = *std::move(session);
        session_->viewer().resize({96, 64});
        session_->open({(*folder_ / "ball.ply").string()});
        for (int i = 0; i < 10000 && session_->opening()->sample().snapshot().triangles.empty(); ++i) turn();
        // What was read last is taken in as well.
        for (int i = 0; i < 20; ++i) turn();
    }
    void TearDown() override {
        isLetGo_ = true;
        session_.reset();
        unsetenv("XDG_CACHE_HOME");
        fs::remove_all(*folder_ / "cache");
    }
    void turn() {
        const auto next = session_->update(now_ += 0.05);
        ASSERT_TRUE(next) << next.error().line();
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    void finish() {
        isLetGo_ = true;
        for (int i = 0; i < 10000 && session_->opening(); ++i) turn();
        ASSERT_TRUE(session_->viewer().isOpen()) << session_->problem();
    }

    std::atomic<bool> isLetGo_ = false;
    std::unique_ptr<ViewSession> session_;
    double now_ = 0;
};

TEST_F(PreviewSessionTest, WhatWasReadIsFramedAsItWillBe) {
    ASSERT_NE(session_->preview(), nullptr);
    const Camera framed = session_->viewer().camera().current();
    const Box bounds = session_->preview()->bounds();
    finish();
    EXPECT_EQ(session_->preview(), nullptr);
    const Box open = session_->viewer().bounds();
    EXPECT_LT(glm::distance(bounds.low, open.low) + glm::distance(bounds.high, open.high), 1e-6);
    EXPECT_LT(glm::distance(framed.eye, session_->viewer().camera().current().eye), 1e-5);
}

TEST_F(PreviewSessionTest, ACameraThatWasMovedStays) {
    ASSERT_NE(session_->preview(), nullptr);
    const glm::dvec3 before = session_->viewer().camera().position;
    session_->viewer().press(MouseButton::Left, {48, 32});
    session_->viewer().move({60, 32});
    session_->viewer().release(MouseButton::Left);
    session_->viewer().scroll({48, 32}, 1);
    const OrbitCamera moved = session_->viewer().camera();
    EXPECT_GT(glm::distance(before, moved.position), 0.1);
    finish();
    EXPECT_EQ(session_->viewer().camera().current(), moved.current());
}

TEST_F(PreviewSessionTest, WhatIsCancelledIsGone) {
    ASSERT_NE(session_->preview(), nullptr);
    session_->opening()->cancel();
    isLetGo_ = true;
    for (int i = 0; i < 10000 && session_->opening(); ++i) turn();
    EXPECT_EQ(session_->preview(), nullptr);
    EXPECT_FALSE(session_->viewer().isOpen());
}

TEST(Window, ASizeIsRememberedAsItIsMadeFrom) {
    EXPECT_EQ(unscaledSize({1280, 800}, {1280, 800}, {1, 1}), glm::ivec2(1280, 800));
    EXPECT_EQ(unscaledSize({2560, 1600}, {2560, 1600}, {2, 2}), glm::ivec2(1280, 800))
        << "made larger, and it would be again";
    EXPECT_EQ(unscaledSize({1280, 800}, {2560, 1600}, {2, 2}), glm::ivec2(1280, 800))
        << "in units that are scaled already";
}

TEST(WindowSize, FitsOnTheScreen) {
    EXPECT_EQ(fittingSize({1280, 800}, {3840, 2160}, {1, 1}), glm::ivec2(1280, 800));
    EXPECT_EQ(fittingSize({1280, 800}, {3840, 2160}, {3, 3}), glm::ivec2(1280, 720));
    EXPECT_EQ(fittingSize({1280, 800}, {1024, 600}, {1, 1}), glm::ivec2(1024, 600));
    EXPECT_EQ(fittingSize({1280, 800}, {0, 0}, {1, 1}), glm::ivec2(1280, 800)) << "the screen says nothing";
}

TEST_F(ViewSessionTest, ATurntableIsAFolderOfPictures) {
    session_->savePicture(kSmall);
    ASSERT_TRUE(isSaved());
    session_->saveTurntable(kSmall, 3);
    ASSERT_TRUE(session_->saving());
    EXPECT_EQ(session_->saving()->name, "turntable-1");
    EXPECT_EQ(session_->saving()->pictures, 3u);
    session_->saveTurntable(kSmall, 3);
    // The window goes on, and what it shows by now is not what is saved.
    orbit(1);
    session_->viewer().act(ViewerAction::NextShading);
    const uint64_t drawn = session_->viewer().framesDrawn();
    ASSERT_TRUE(isSaved());
    EXPECT_GT(session_->viewer().framesDrawn(), drawn);
    EXPECT_EQ(filesIn("turntable-1"),
              (std::set<std::string>{"picture-0001.png", "picture-0002.png", "picture-0003.png"}));
    EXPECT_EQ(picture("turntable-1/picture-0001.png"), picture("picture-1.png")) << "it begins with the view as it was";
    EXPECT_NE(picture("turntable-1/picture-0002.png"), picture("turntable-1/picture-0001.png"));
    EXPECT_NE(picture("turntable-1/picture-0003.png"), picture("turntable-1/picture-0002.png"));
    EXPECT_FALSE(fs::exists("turntable-2")) << "one at a time";
    session_->saveTurntable(kSmall, 2);
    ASSERT_TRUE(isSaved());
    EXPECT_EQ(filesIn("turntable-2").size(), 2u);
    EXPECT_NE(session_->note().find("turntable-2"), std::string::npos) << session_->note();
}

TEST_F(ViewSessionTest, ATurntableMayBeAVideo) {
    const test::EncoderInPath encoder(folder_->path());
    PictureChoice choice = kSmall;
    choice.video = true;
    choice.transparent = true;
    session_->saveTurntable(choice, 3);
    ASSERT_TRUE(isSaved());
    session_->saveTurntable(kSmall, 3);
    ASSERT_TRUE(isSaved());
    std::string wanted = "1234ftyp";
    for (const char* name : {"picture-0001.png", "picture-0002.png", "picture-0003.png"}) {
        const std::vector<uint8_t> rgba = picture(fs::path("turntable-1") / name).rgba;
        wanted.append(rgba.begin(), rgba.end());
    }
    EXPECT_EQ(contentOf("turntable-1.mp4"), wanted) << "opaque, since videos are";
    session_->saveTurntable(choice, 3);
    ASSERT_TRUE(turnUntil([&] { return session_->saving()->finished > 0; }));
    session_->cancelSaving();
    EXPECT_FALSE(fs::exists("turntable-2.mp4"));
    EXPECT_NE(session_->note().find("nothing is written"), std::string::npos) << session_->note();
}

TEST_F(ViewSessionTest, ACutIsDrawnAsItIsSeen) {
    session_->saveCut(".svg");
    EXPECT_FALSE(session_->saving()) << "nothing is cut";
    session_->viewer().setSections({{{0, 0, 2}, 0.5}});
    for (const std::string extension : {".svg", ".dxf"}) {
        session_->saveCut(extension);
        ASSERT_TRUE(session_->saving());
        EXPECT_EQ(session_->saving()->name, "cut-1" + extension);
        ASSERT_TRUE(isSaved()) << session_->problem();
        EXPECT_NE(session_->note().find("cut-1" + extension), std::string::npos) << session_->note();
    }
    // The plane z = 0.25, whatever the length of its normal.
    const auto reader = openFile(*folder_ / "ball.vcp");
    ASSERT_TRUE(reader);
    const auto dataset = readDataset(**reader);
    ASSERT_TRUE(dataset);
    const CutPlane plane{{0, 0, 1}, 0.25};
    const auto cut = SurfaceCut::create(*dataset, "ball", 99, {}, plane);
    ASSERT_TRUE(cut);
    SectionExportOptions options;
    options.output = "wanted.svg";
    options.plane = plane;
    const auto figures = exportSection(**reader, *cut, options);
    ASSERT_TRUE(figures) << figures.error().line();
    EXPECT_NE(session_->note().find(lengthText(figures->length, {})), std::string::npos) << session_->note();
    session_->viewer().setSections({{{0, 0, 1}, 100}});
    session_->saveCut(".svg");
    ASSERT_TRUE(turnUntil([&] { return !session_->saving(); }));
    EXPECT_NE(session_->problem().find("cuts nothing"), std::string::npos) << session_->problem();
    EXPECT_FALSE(fs::exists("cut-2.svg"));
}

TEST_F(ViewSessionTest, APathGoesThroughTheBookmarks) {
    session_->keepBookmark(4);
    session_->savePath(kSmall, 3);
    EXPECT_FALSE(session_->saving());
    EXPECT_NE(session_->note().find("bookmarks"), std::string::npos) << session_->note();
    orbit(0.8);
    session_->keepBookmark(2);
    session_->savePicture(kSmall);
    ASSERT_TRUE(isSaved());
    orbit(2);
    session_->savePath(kSmall, 3);
    ASSERT_TRUE(isSaved());
    EXPECT_EQ(filesIn("path-1").size(), 3u);
    EXPECT_EQ(picture("path-1/picture-0001.png"), picture("picture-1.png"))
        << "from the bookmark with the lower number";
    EXPECT_NE(picture("path-1/picture-0002.png"), picture("path-1/picture-0001.png"));
    EXPECT_NE(picture("path-1/picture-0003.png"), picture("path-1/picture-0002.png"));
}

TEST_F(ViewSessionTest, DepthAndTransparencyAreChosen) {
    session_->savePicture({.size = {64, 48}, .transparent = true, .depth = true});
    ASSERT_TRUE(isSaved());
    EXPECT_EQ(filesIn("."), (std::set<std::string>{"picture-1.png", "picture-1-depth.pfm"}));
    EXPECT_EQ(picture("picture-1.png").rgba[3], 0);
    EXPECT_EQ(contentOf("picture-1-depth.pfm").size(), std::string("Pf\n64 48\n-1.0\n").size() + 4 * 64 * 48);
    fs::remove("picture-1.png");
    session_->savePicture(kSmall);
    ASSERT_TRUE(isSaved());
    EXPECT_EQ(picture("picture-2.png").rgba[3], 255) << "what belongs to the depth that is left has another number";
    session_->saveTurntable({.size = {64, 48}, .depth = true}, 2);
    ASSERT_TRUE(isSaved());
    EXPECT_EQ(filesIn("turntable-1"),
              (std::set<std::string>{"depth-0001.pfm", "depth-0002.pfm", "picture-0001.png", "picture-0002.png"}));
}

// A scene that was saved shows what was shown: camera, cut, light and annotations.
TEST_F(ViewSessionTest, ASceneIsSavedAndOpenedAgain) {
    const OrbitCamera camera = session_->viewer().camera();
    session_->viewer().setSections({{{0, 0, 1}, 0.25}});
    session_->setClicks(ViewSession::Clicks::Annotate);
    session_->clickAt({48, 32});
    ASSERT_TRUE(turnUntil([&] { return !session_->points().empty() || !session_->note().empty(); }));
    ASSERT_EQ(session_->points().size(), 1u) << session_->note();
    session_->changePoint(0, "Pole", "");
    const Annotation kept = session_->points()[0];
    session_->saveScene();
    ASSERT_TRUE(session_->problem().empty()) << session_->problem();
    session_->saveScene();
    EXPECT_TRUE(fs::exists("scene-2.json")) << "the next free number";
    session_->viewer().act(ViewerAction::ViewTop);
    session_->open({"scene-1.json"});
    ASSERT_TRUE(turnUntil([&] { return !session_->opening(); }));
    ASSERT_TRUE(session_->problem().empty()) << session_->problem();
    EXPECT_EQ(session_->points(), std::vector<Annotation>{kept});
    EXPECT_EQ(session_->viewer().sections(), (std::vector<SectionPlane>{{{0, 0, 1}, 0.25}}));
    EXPECT_LT(glm::distance(session_->viewer().camera().position, camera.position), 1e-9);
}

TEST_F(ViewSessionTest, SurroundingsComeAndGo) {
    Shading lit = session_->viewer().shading();
    setLights(lit, {{false, {0, 1, 0}, 0.3f}, {true, {1, 0, 0}, 0.5f}});
    session_->viewer().setShading(lit);
    session_->surround("studio");
    Shading shading = session_->viewer().shading();
    ASSERT_TRUE(shading.environment) << session_->problem();
    EXPECT_FALSE(areLightsOn(shading));
    EXPECT_FALSE(session_->viewer().whyWithout(ViewerAction::ToggleShadows).empty());
    shading.environment->turn = 40, shading.environment->strength = 2;
    session_->viewer().setShading(shading);
    // Others are turned and as strong as these were.
    session_->surround("clear");
    EXPECT_EQ(session_->surroundings(), "clear");
    EXPECT_EQ(session_->viewer().shading().environment->turn, 40);
    EXPECT_EQ(session_->viewer().shading().environment->strength, 2);
    session_->saveScene();
    ASSERT_TRUE(session_->problem().empty()) << session_->problem();
    session_->surround("nowhere.hdr");
    EXPECT_NE(session_->problem().find("nowhere.hdr"), std::string::npos);
    EXPECT_EQ(session_->surroundings(), "clear");
    // Without them all is as it was.
    session_->surround("");
    EXPECT_EQ(session_->viewer().shading(), lit);
    session_->saveScene();
    const auto reopened = [&](const char* scene) {
        session_->open({scene});
        EXPECT_TRUE(turnUntil([&] { return !session_->opening(); }));
        EXPECT_TRUE(session_->problem().empty()) << session_->problem();
        return session_->viewer().shading();
    };
    shading = reopened("scene-1.json");
    ASSERT_TRUE(shading.environment);
    EXPECT_EQ(session_->surroundings(), "clear");
    EXPECT_EQ(shading.environment->turn, 40);
    EXPECT_FALSE(areLightsOn(shading));
    // A scene with surroundings that are switched off is saved without.
    session_->surround("");
    session_->saveScene();
    EXPECT_FALSE(reopened("scene-3.json").environment);
    shading = reopened("scene-2.json");
    EXPECT_FALSE(shading.environment);
    EXPECT_EQ(lightsOf(shading).size(), 2u);
    EXPECT_EQ(lightsOf(shading)[0].strength, 0.3f);
}

// In two tiles across and several rows of them, and in each picture of a turntable where the camera has it.
TEST_F(ViewSessionTest, WhatIsMeasuredIsWrittenOverWhatIsSaved) {
    constexpr PictureChoice kPlain{.size = {600, 1100}}, kAnnotated{.size = {600, 1100}, .annotated = true};
    session_->setTheme(ThemeChoice::Dark);
    Shading shading = session_->viewer().shading();
    shading.mode = ShadingMode::Level;
    session_->viewer().setShading(shading);
    const glm::dvec3 from(-0.5, 0.2, 0), to(0.4, -0.3, 0.6);
    session_->measurement().add({from, 0.001, 0});
    session_->measurement().add({to, 0.001, 0});
    EXPECT_EQ(session_->annotations().legends.size(), 1u);
    EXPECT_EQ(session_->annotations().lines.at(0).lengths, std::vector<std::string>{"1.192"});

    const auto colourAt = [&](const Picture& shown, glm::dvec2 pixel) {
        const size_t at = 4 * (size_t(pixel.y) * shown.width + size_t(pixel.x));
        return glm::ivec3(shown.rgba[at], shown.rgba[at + 1], shown.rgba[at + 2]);
    };
    const glm::ivec3 mark(77, 163, 255);
    const OrbitCamera& camera = session_->viewer().camera();
    session_->savePicture(kPlain);
    ASSERT_TRUE(isSaved());
    session_->savePicture(kAnnotated);
    ASSERT_TRUE(isSaved());
    const Picture plain = picture("picture-1.png"), annotated = picture("picture-2.png");
    for (const glm::dvec3& point : {from, to, 0.7 * from + 0.3 * to}) {
        const glm::dvec2 pixel = camera.pixelOf(point, kPlain.size).value();
        EXPECT_EQ(colourAt(annotated, pixel), mark);
        EXPECT_NE(colourAt(plain, pixel), mark);
    }
    // The scale bar at the lower left, the legend at the lower right; above, all is as it was.
    EXPECT_NE(colourAt(annotated, {20, 1074}), colourAt(plain, {20, 1074}));
    EXPECT_NE(colourAt(annotated, {560, 1050}), colourAt(plain, {560, 1050}));
    EXPECT_TRUE(std::equal(plain.rgba.begin(), plain.rgba.begin() + 4 * 600 * 200, annotated.rgba.begin()));

    session_->saveTurntable(kAnnotated, 4);
    ASSERT_TRUE(isSaved());
    EXPECT_EQ(picture("turntable-1/picture-0001.png"), annotated);
    OrbitCamera turned = camera;
    turned.orbit(session_->viewer().bounds().centre(), 1.5707963267948966, 0);
    EXPECT_EQ(colourAt(picture("turntable-1/picture-0002.png"), turned.pixelOf(from, kPlain.size).value()), mark);
}

TEST_F(ViewSessionTest, WhatIsCancelledLeavesWhatIsFinished) {
    session_->saveTurntable(kTwoTiles, 5);
    ASSERT_TRUE(turnUntil([&] { return !session_->saving() || fs::exists("turntable-1/picture-0003.png.partial"); }));
    ASSERT_TRUE(session_->saving());
    EXPECT_EQ(session_->saving()->finished, 2u);
    EXPECT_GT(session_->saving()->fraction, 0.4);
    EXPECT_LT(session_->saving()->fraction, 0.6);
    session_->cancelSaving();
    EXPECT_FALSE(session_->saving());
    EXPECT_EQ(filesIn("turntable-1"), (std::set<std::string>{"picture-0001.png", "picture-0002.png"}));
    EXPECT_NE(session_->note().find("2 of 5"), std::string::npos) << session_->note();

    session_->saveTurntable(kTwoTiles, 5);
    ASSERT_TRUE(turnUntil([&] { return fs::exists("turntable-2/picture-0001.png.partial"); }));
    session_->cancelSaving();
    EXPECT_FALSE(fs::exists("turntable-2")) << "an empty folder is of no use";

    session_->savePicture(kTwoTiles);
    ASSERT_TRUE(turnUntil([&] { return fs::exists("picture-1.png.partial"); }));
    session_.reset();
    EXPECT_EQ(filesIn("."), (std::set<std::string>{"turntable-1"}));
}

TEST_F(ViewSessionTest, WhatIsOpenedNextCancels) {
    session_->saveTurntable(kTwoTiles, 100);
    session_->open({(*folder_ / "ball.vcp").string()});
    ASSERT_TRUE(turnUntil([&] { return !session_->opening(); }));
    EXPECT_FALSE(session_->saving());
    turn();
    EXPECT_EQ(session_->problem(), "");
}

TEST_F(ViewSessionTest, OfSeveralFilesThoseThatCannotBeOpenedAreSaid) {
    const std::string ball = (*folder_ / "ball.vcp").string();
    std::ofstream("cut.vcp") << contentOf(ball).substr(0, 5000);
    session_->open({"missing.vcp", ball, "cut.vcp", ball});
    ASSERT_TRUE(turnUntil([&] { return !session_->opening(); }));
    EXPECT_EQ(session_->layers().size(), 2u);
    EXPECT_EQ(session_->viewer().status().name, "ball.vcp and 1 more");
    EXPECT_EQ(session_->problem(), "missing.vcp: cannot open: No such file or directory (and 1 more not shown)");
    EXPECT_EQ(session_->user().recent, std::vector<std::string>{ball});
    session_->saveScene();
    const auto scene = readScene("scene-1.json");
    ASSERT_TRUE(scene) << scene.error().line();
    EXPECT_EQ(scene->datasets.size(), 2u);

    session_->open({"missing.vcp", "cut.vcp"});
    ASSERT_TRUE(turnUntil([&] { return !session_->opening(); }));
    EXPECT_EQ(session_->problem(), "missing.vcp: cannot open: No such file or directory");
    EXPECT_EQ(session_->layers().size(), 2u) << "what is shown stays";
}

TEST_F(ViewSessionTest, WhatCannotBeOpenedLeavesWhatIsShown) {
    const std::string ball = contentOf(*folder_ / "ball.vcp");
    const auto isRefused = [&](const std::string& name, const std::string& content, const std::string& named = {}) {
        std::ofstream(name, std::ios::binary) << content;
        session_->open({name});
        ASSERT_TRUE(turnUntil([&] { return !session_->opening(); }));
        for (int i = 0; i < 3; ++i) turn();
        EXPECT_NE(session_->problem().find(named.empty() ? name : named), std::string::npos)
            << name << ": " << session_->problem();
        EXPECT_EQ(session_->viewer().status().name, "ball.vcp") << name;
        EXPECT_TRUE(session_->viewer().status().update.drawable) << name;
        session_->dismissProblem();
    };
    for (const size_t length : {size_t(0), size_t(1), size_t(100), size_t(4096), ball.size() / 2, ball.size() - 1})
        isRefused(fmt::format("cut-{}.vcp", length), ball.substr(0, length));
    isRefused("longer.vcp", ball + "0");
    isRefused("notes.txt", "what I have to do\n");
    isRefused("cut.ply", contentOf(*folder_ / "ball.ply").substr(0, 3000));
    isRefused("scene.json", R"({"datasets": [{"file": "missing.vcp"}]})", "missing.vcp");
    for (size_t at = 0; at < 512; at += 16) {
        std::string flipped = ball;
        flipped[at] = char(flipped[at] ^ 0x10);
        isRefused(fmt::format("flipped-{}.vcp", at), flipped);
    }
}

TEST_F(RememberingSessionTest, WhatHasNoRoomLeavesWhatIsShown) {
    writeBall(*folder_ / "finer.ply", 120, 240);
    BuildOptions build;
    build.inputs = {*folder_ / "finer.ply"};
    build.output = *folder_ / "one-page.vcp";
    build.cell = 1;
    ASSERT_TRUE(buildOctree(build));
    const auto opened = openDataset(ball().string(), {});
    ASSERT_TRUE(opened);
    RenderSettings render;
    render.ramBytes = opened->source->bytesToRead(0, true);
    Remembering each = begin({}, render);
    each.open(ball());
    const auto isDrawable = [&] {
        for (int i = 0; i < 3000 && !each.session->viewer().status().update.drawable; ++i) {
            each.turn();
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        return each.session->viewer().status().update.drawable;
    };
    ASSERT_TRUE(isDrawable()) << each.session->problem();
    each.session->open({ball().string(), build.output.string()});
    for (int i = 0; i < 10000 && each.session->opening(); ++i) each.turn();
    EXPECT_NE(each.session->problem().find("allow more"), std::string::npos) << each.session->problem();
    EXPECT_TRUE(isDrawable()) << "pages of the ball come again";
    EXPECT_EQ(each.session->viewer().status().name, "ball.vcp");
    EXPECT_EQ(each.session->layers().size(), 1u);
}

TEST_F(ViewSessionTest, AFolderThatIsGoneIsSaid) {
    fs::create_directory("gone");
    fs::current_path("gone");
    fs::remove(*folder_ / "work" / "gone");
    session_->saveTurntable(kSmall, 3);
    EXPECT_FALSE(session_->saving());
    EXPECT_NE(session_->problem().find("turntable-1"), std::string::npos) << session_->problem();
    session_->dismissProblem();
    session_->savePicture(kSmall);
    ASSERT_TRUE(turnUntil([&] { return !session_->saving(); }));
    EXPECT_NE(session_->problem().find("picture-1.png"), std::string::npos) << session_->problem();
    fs::current_path(*folder_ / "work");
}

}  // namespace
}  // namespace vcp
