#include "viewer/user_settings.h"

#include <cstdlib>
#include <fstream>

#include <gtest/gtest.h>

#include "test_folder.h"

namespace vcp {
namespace {

class UserSettingsTest : public testing::Test {
protected:
    void write(const std::string& text) const { std::ofstream(file_) << text; }

    TestFolder folder_{"vcp_user_settings_test"};
    std::filesystem::path file_ = folder_ / "view.json";
};

TEST_F(UserSettingsTest, ComeBackAsTheyWere) {
    UserSettings settings;
    settings.remember("http://example.org/a.vcp");
    settings.remember("/tmp/b.ply");
    settings.windowSize = {700, 500};
    settings.panel = true;
    settings.up = UpAxis::Z;
    settings.shadows = settings.occlusion = true;
    settings.errorPixels = 2.5;
    settings.budgetBytes = 3ull << 30;
    settings.backgroundTop = {1, 0.5f, 0.25f};
    OrbitCamera camera;
    camera.position = {1, 2, 3};
    camera.focusDistance = 4;
    settings.bookmarks["/tmp/b.ply"][3] = camera;
    const auto path = folder_ / "new" / "folder" / "view.json";
    ASSERT_TRUE(writeUserSettings(settings, path));
    const auto read = readUserSettings(path);
    ASSERT_TRUE(read) << read.error().line();
    EXPECT_EQ(read->recent, (std::vector<std::string>{"/tmp/b.ply", "http://example.org/a.vcp"}));
    EXPECT_EQ(read->windowSize, settings.windowSize);
    EXPECT_TRUE(read->panel);
    EXPECT_EQ(read->up, UpAxis::Z);
    EXPECT_TRUE(read->shadows && read->occlusion);
    EXPECT_EQ(read->errorPixels, 2.5);
    EXPECT_EQ(read->budgetBytes, 3ull << 30);
    EXPECT_EQ(read->backgroundTop, settings.backgroundTop);
    ASSERT_EQ(read->bookmarks.size(), 1u);
    EXPECT_EQ(read->bookmarks.at("/tmp/b.ply").at(3).position, camera.position);
}

TEST_F(UserSettingsTest, AFileThatIsNotThereGivesTheDefaults) {
    const auto read = readUserSettings(folder_ / "none.json");
    ASSERT_TRUE(read);
    EXPECT_TRUE(read->recent.empty());
    EXPECT_EQ(read->windowSize, UserSettings{}.windowSize);
}

TEST_F(UserSettingsTest, WhatIsWrongIsLeftOut) {
    write(R"({"recent":[1,"a",null,"b"],"width":"wide","height":1e99,"panel":3,"up":7,"error_pixels":-1,"budget_bytes":1e300,
              "background_top":[0,0],"background_bottom":[0,2,0],"shadows":true,
              "bookmarks":{"x":{"1":{"position":[0,0,0]},"2":5,"99":{}},"y":3}})");
    const auto read = readUserSettings(file_);
    ASSERT_TRUE(read) << read.error().line();
    const UserSettings defaults;
    EXPECT_EQ(read->recent, (std::vector<std::string>{"a", "b"}));
    EXPECT_EQ(read->windowSize, defaults.windowSize);
    EXPECT_EQ(read->errorPixels, defaults.errorPixels);
    EXPECT_EQ(read->budgetBytes, defaults.budgetBytes);
    EXPECT_EQ(read->backgroundTop, defaults.backgroundTop);
    EXPECT_EQ(read->backgroundBottom, defaults.backgroundBottom);
    EXPECT_TRUE(read->shadows);
    EXPECT_TRUE(read->bookmarks.empty());
}

TEST_F(UserSettingsTest, NoJsonIsSaid) {
    for (const char* text : {"", "{", "[]", "\xff\xfe", "{\"width\":1e999}"}) {
        write(text);
        const auto read = readUserSettings(file_);
        ASSERT_FALSE(read) << text;
        EXPECT_EQ(read.error().file, file_.string());
    }
}

TEST_F(UserSettingsTest, PasswordsAreNotRemembered) {
    UserSettings settings;
    settings.remember("https://user:secret@host/x.vcp?token=1");
    EXPECT_EQ(settings.recent.front(), "https://host/x.vcp?token=1");
    EXPECT_EQ(rememberedName("https://user:secret@host/x.vcp"), "https://host/x.vcp");
    // Those of before go.
    const std::string camera = cameraToJson(OrbitCamera{});
    write(std::string(R"({"recent": ["https://user:secret@host/y.vcp"], "bookmarks": {"https://user:secret@host/y.vcp": {"1": )") + camera + "}}}");
    const auto read = readUserSettings(file_);
    ASSERT_TRUE(read) << read.error().line();
    EXPECT_EQ(read->recent, std::vector<std::string>{"https://host/y.vcp"});
    EXPECT_TRUE(read->bookmarks.contains("https://host/y.vcp"));
    EXPECT_EQ(read->bookmarks.size(), 1u);
}

TEST_F(UserSettingsTest, RecentFilesAreDistinctAndFew) {
    UserSettings settings;
    for (int i = 0; i < 40; ++i) settings.remember("/tmp/" + std::to_string(i % 20));
    EXPECT_EQ(settings.recent.size(), UserSettings::kMostRecent);
    EXPECT_EQ(settings.recent.front(), "/tmp/19");
    settings.remember("/tmp/./15");
    EXPECT_EQ(settings.recent.front(), "/tmp/15");
    EXPECT_EQ(std::count(settings.recent.begin(), settings.recent.end(), "/tmp/15"), 1);
}

}  // namespace
}  // namespace vcp
