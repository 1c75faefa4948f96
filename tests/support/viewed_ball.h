// The ball of built_ball.h in a session of the window, without the window, with a working folder and a cache of the
// test's own.
#pragma once

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "render/picture.h"
#include "tests/support/built_ball.h"
#include "viewer/window/view_session.h"

namespace vcp {

class ViewedBall : public BuiltBall {
protected:
    /// A working folder of the test's own, and the ball in a session.
    void SetUp() override {
        if (!listDevices()) GTEST_SKIP() << "no Vulkan device";
        setenv("XDG_CACHE_HOME", (*folder_ / "cache").c_str(), 1);
        before_ = std::filesystem::current_path();
        std::filesystem::create_directory(*folder_ / "work");
        std::filesystem::current_path(*folder_ / "work");
        SessionOptions options;
        options.render.budgetBytes = 64 << 20;
        auto session = ViewSession::create(options, {});
        ASSERT_TRUE(session) << session.error().line();
        session_ = *std::move(session);
        session_->viewer().resize({96, 64});
        session_->open({(*folder_ / "ball.vcp").string()});
        ASSERT_TRUE(
            turnUntil([&] { return session_->viewer().dataset() && session_->viewer().status().update.settled; }));
    }
    void TearDown() override {
        session_.reset();
        if (!before_.empty()) std::filesystem::current_path(before_);
        std::filesystem::remove_all(*folder_ / "work");
        std::filesystem::remove_all(*folder_ / "cache");
        unsetenv("XDG_CACHE_HOME");
    }

    /// One turn of the window's loop.
    void turn() {
        const auto next = session_->update(now_ += 0.02);
        ASSERT_TRUE(next) << next.error().line();
        if (next->draw) {
            ASSERT_TRUE(session_->viewer().draw());
        }
        if (next->waitSeconds > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    bool turnUntil(const std::function<bool()>& isDone) {
        for (int i = 0; i < 10000 && !HasFatalFailure(); ++i) {
            if (isDone()) return true;
            turn();
        }
        return false;
    }
    bool isSaved() {
        return turnUntil([&] { return !session_->saving(); }) && session_->problem().empty();
    }
    /// Goes elsewhere at once.
    void orbit(double yaw) {
        OrbitCamera camera = session_->viewer().camera();
        camera.orbit(session_->viewer().bounds().centre(), yaw, 0.2);
        session_->viewer().setCamera(camera);
    }

    static std::set<std::string> filesIn(const std::filesystem::path& path) {
        std::set<std::string> names;
        for (const std::filesystem::directory_entry& each : std::filesystem::directory_iterator(path))
            names.insert(each.path().filename().string());
        return names;
    }
    static Picture picture(const std::filesystem::path& path) { return readPng(path).value(); }

    std::filesystem::path before_;
    std::unique_ptr<ViewSession> session_;
    double now_ = 0;
};

}  // namespace vcp
