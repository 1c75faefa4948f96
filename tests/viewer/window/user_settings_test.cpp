#include "viewer/window/user_settings.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <set>
#include <thread>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include "tests/support/test_folder.h"

namespace vcp {
namespace {

class UserSettingsTest : public testing::Test {
protected:
    void write(const std::string& text) const { std::ofstream(file_) << text; }
    /// The warning.
    static std::string save(const SettingsChanges& changes, const std::filesystem::path& path) {
        const auto saved = saveChanges(changes, path);
        EXPECT_TRUE(saved) << saved.error().line();
        return saved ? *saved : "";
    }
    static SettingsChanges opening(const std::string& name) {
        SettingsChanges changes;
        changes.opened = {name};
        return changes;
    }
    static std::set<std::string> filesIn(const std::filesystem::path& path) {
        std::set<std::string> names;
        for (const auto& each : std::filesystem::directory_iterator(path))
            names.insert(each.path().filename().string());
        return names;
    }
    [[nodiscard]] nlohmann::json json() const { return nlohmann::json::parse(contentOf(file_)); }

    TestFolder folder_{"vcp_user_settings_test"};
    std::filesystem::path file_ = folder_ / "view.json";
};

TEST_F(UserSettingsTest, ComeBackAsTheyWere) {
    SettingsChanges settings;
    settings.opened = {"http://example.org/a.vcp", "/tmp/b.ply"};
    settings.windowSize = {700, 500};
    settings.panel = settings.shadows = settings.occlusion = true;
    settings.theme = ThemeChoice::Light;
    settings.up = UpAxis::Z;
    settings.errorPixels = 2.5;
    settings.budgetBytes = 3ull << 30;
    settings.backgroundTop = {1, 0.5f, 0.25f};
    settings.backgroundBottom = {0, 0.5f, 1};
    OrbitCamera camera;
    camera.position = {1, 2, 3};
    camera.focusDistance = 4;
    settings.bookmarks["/tmp/b.ply"][3] = camera;
    settings.annotations["/tmp/b.ply"] = {{{1, 2, 0.1}, "Nose", "Broken"}};
    const auto path = folder_ / "new" / "folder" / "view.json";
    ASSERT_EQ(save(settings, path), "");
    const auto read = readUserSettings(path);
    ASSERT_TRUE(read) << read.error().line();
    EXPECT_EQ(read->recent, (std::vector<std::string>{"/tmp/b.ply", "http://example.org/a.vcp"}));
    EXPECT_EQ(read->windowSize, settings.windowSize);
    EXPECT_TRUE(read->panel);
    EXPECT_EQ(read->theme, ThemeChoice::Light);
    EXPECT_TRUE(read->hasBackground);
    EXPECT_EQ(read->up, UpAxis::Z);
    EXPECT_TRUE(read->shadows && read->occlusion);
    EXPECT_EQ(read->errorPixels, 2.5);
    EXPECT_EQ(read->budgetBytes, 3ull << 30);
    EXPECT_EQ(read->backgroundTop, settings.backgroundTop);
    EXPECT_EQ(read->backgroundBottom, settings.backgroundBottom);
    ASSERT_EQ(read->bookmarks.size(), 1u);
    EXPECT_EQ(read->annotations, settings.annotations);
    EXPECT_EQ(read->bookmarks.at("/tmp/b.ply").at(3).position, camera.position);
    EXPECT_EQ(filesIn(path.parent_path()), std::set<std::string>{"view.json"});
}

TEST_F(UserSettingsTest, AFileThatIsNotThereGivesTheDefaults) {
    const auto read = readUserSettings(folder_ / "none.json");
    ASSERT_TRUE(read);
    EXPECT_TRUE(read->recent.empty());
    EXPECT_EQ(read->windowSize, UserSettings{}.windowSize);
}

TEST_F(UserSettingsTest, WhatIsWrongIsLeftOut) {
    write(
        R"({"recent":[1,"a",null,"b"],"width":"wide","height":1e99,"panel":3,"theme":"pink","up":7,"error_pixels":-1,"budget_bytes":1e300,
              "background_top":[0,0],"background_bottom":[0,2,0],"shadows":true,
              "bookmarks":{"x":{"1":{"position":[0,0,0]},"2":5,"99":{}},"y":3},
              "annotations":{"x":[{"position":[0,0]}],"y":3,"z":[{"title":"a"}]}})");
    const auto read = readUserSettings(file_);
    ASSERT_TRUE(read) << read.error().line();
    const UserSettings defaults;
    EXPECT_EQ(read->recent, (std::vector<std::string>{"a", "b"}));
    EXPECT_EQ(read->windowSize, defaults.windowSize);
    EXPECT_EQ(read->errorPixels, defaults.errorPixels);
    EXPECT_EQ(read->budgetBytes, defaults.budgetBytes);
    EXPECT_EQ(read->backgroundTop, defaults.backgroundTop);
    EXPECT_EQ(read->backgroundBottom, defaults.backgroundBottom);
    EXPECT_FALSE(read->hasBackground);
    EXPECT_EQ(read->theme, defaults.theme);
    EXPECT_TRUE(read->shadows);
    EXPECT_TRUE(read->bookmarks.empty());
    EXPECT_TRUE(read->annotations.empty());
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
    settings.remember(rememberedName("https://user:secret@host/x.vcp?token=1"));
    EXPECT_EQ(settings.recent.front(), "https://host/x.vcp?token=1");
    EXPECT_EQ(rememberedName("https://user:secret@host/x.vcp"), "https://host/x.vcp");
    // Those of before go.
    const std::string camera = cameraToJson(OrbitCamera{});
    write(
        std::string(
            R"({"recent": ["https://user:secret@host/y.vcp"], "bookmarks": {"https://user:secret@host/y.vcp": {"1": )") +
        camera + "}}}");
    const auto read = readUserSettings(file_);
    ASSERT_TRUE(read) << read.error().line();
    EXPECT_EQ(read->recent, std::vector<std::string>{"https://host/y.vcp"});
    EXPECT_TRUE(read->bookmarks.contains("https://host/y.vcp"));
    EXPECT_EQ(read->bookmarks.size(), 1u);
}

TEST_F(UserSettingsTest, RecentFilesAreDistinctAndFew) {
    UserSettings settings;
    SettingsChanges changes;
    for (int i = 0; i < 40; ++i) {
        changes.opened.push_back("/tmp/" + std::to_string(i % 20));
        settings.remember(changes.opened.back());
    }
    changes.opened.push_back(rememberedName("/tmp/./15"));
    settings.remember(changes.opened.back());
    EXPECT_EQ(settings.recent.size(), UserSettings::kMostRecent);
    EXPECT_EQ(settings.recent.front(), "/tmp/15");
    EXPECT_EQ(std::count(settings.recent.begin(), settings.recent.end(), "/tmp/15"), 1);
    save(changes, file_);
    EXPECT_EQ(readUserSettings(file_)->recent, settings.recent) << "as the window shows them";
}

TEST_F(UserSettingsTest, WindowsThatWereOpenTogetherLoseNothing) {
    SettingsChanges before = opening("/before"), first = opening("/a"), second = opening("/c"), third = opening("/a");
    before.panel = true;
    save(before, file_);
    first.opened.push_back("/b");
    first.shadows = true;
    second.errorPixels = 3;
    third.up = UpAxis::Z;
    first.bookmarks["/a"][1].position = {1, 0, 0};
    second.bookmarks["/a"][2].position = {2, 0, 0};
    third.bookmarks["/a"][1].position = {3, 0, 0};
    for (const SettingsChanges* each : {&first, &second, &third}) save(*each, file_);
    const auto read = readUserSettings(file_);
    ASSERT_TRUE(read);
    EXPECT_EQ(read->recent, (std::vector<std::string>{"/a", "/c", "/b", "/before"}));
    EXPECT_TRUE(read->panel && read->shadows);
    EXPECT_EQ(read->errorPixels, 3);
    EXPECT_EQ(read->up, UpAxis::Z);
    EXPECT_EQ(read->bookmarks.at("/a").at(1).position.x, 3) << "the last one";
    EXPECT_EQ(read->bookmarks.at("/a").at(2).position.x, 2);
}

TEST_F(UserSettingsTest, WritersAtOnceLoseNothing) {
    constexpr int kWriters = 6, kSaves = 6;
    std::vector<std::thread> writers;
    for (int writer = 0; writer < kWriters; ++writer)
        writers.emplace_back([&, writer] {
            for (int i = 1; i <= kSaves; ++i) {
                SettingsChanges changes;
                changes.bookmarks["/file" + std::to_string(writer)][i].position = {double(i), 0, 0};
                save(changes, file_);
            }
        });
    for (std::thread& each : writers) each.join();
    const auto read = readUserSettings(file_);
    ASSERT_TRUE(read) << read.error().line();
    ASSERT_EQ(read->bookmarks.size(), size_t{kWriters});
    for (const auto& [file, views] : read->bookmarks) EXPECT_EQ(views.size(), size_t{kSaves}) << file;
    EXPECT_EQ(filesIn(folder_.path()), std::set<std::string>{"view.json"}) << "nothing else is left";
}

TEST_F(UserSettingsTest, WhatThisVersionDoesNotKnowSurvives) {
    write(
        R"({"later": {"deep": [1, 2]}, "up": 7, "recent": ["/a", {"name": "/later"}], "width": 333, "bookmarks": {"/a": {"1": {"position": "later"}, "name": "x"}}})");
    save(opening("/b"), file_);
    SettingsChanges bookmark;
    bookmark.bookmarks["/a"][2];
    save(bookmark, file_);
    EXPECT_EQ(json()["later"]["deep"], nlohmann::json::array({1, 2}));
    EXPECT_EQ(json()["up"], 7) << "what was not changed stays, whatever it is";
    EXPECT_EQ(json()["width"], 333);
    EXPECT_EQ(json()["recent"], nlohmann::json::parse(R"(["/b", "/a", {"name": "/later"}])"));
    EXPECT_EQ(json()["bookmarks"]["/a"]["name"], "x");
    EXPECT_EQ(json()["bookmarks"]["/a"]["1"]["position"], "later");
    EXPECT_TRUE(json()["bookmarks"]["/a"].contains("2"));
    EXPECT_FALSE(json().contains("shadows")) << "what was never changed is not there";
}

TEST_F(UserSettingsTest, WithoutChangesNothingIsWritten) {
    EXPECT_EQ(save({}, folder_ / "none" / "view.json"), "");
    EXPECT_FALSE(std::filesystem::exists(folder_ / "none"));
}

TEST_F(UserSettingsTest, ManyBookmarkedFilesPushTheOldestOut) {
    for (size_t i = 0; i < UserSettings::kMostBookmarkedFiles + 2; ++i) {
        SettingsChanges changes;
        changes.bookmarks["/" + std::to_string(i)][1].focusDistance = 2;
        changes.bookmarks["/0"][1].focusDistance = 2;  // used again and again
        save(changes, file_);
    }
    const auto read = readUserSettings(file_);
    EXPECT_EQ(read->bookmarks.size(), UserSettings::kMostBookmarkedFiles);
    EXPECT_TRUE(read->bookmarks.contains("/0") && read->bookmarks.contains("/51"));
    EXPECT_FALSE(read->bookmarks.contains("/1"));
}

TEST_F(UserSettingsTest, ADamagedFileIsKeptAside) {
    for (const char* text : {"{\"recent\": [\"/precious\"", "[]", ""}) {
        write(text);
        const std::string warning = save(opening("/a"), file_);
        EXPECT_NE(warning.find("view.json.damaged"), std::string::npos) << warning;
        EXPECT_EQ(readUserSettings(file_)->recent, std::vector<std::string>{"/a"});
    }
    EXPECT_EQ(contentOf(folder_ / "view.json.damaged"), "{\"recent\": [\"/precious\"");
    EXPECT_EQ(contentOf(folder_ / "view.json.damaged-2"), "[]");
    EXPECT_EQ(filesIn(folder_.path()).size(), 4u);
    write(std::string(2 << 20, ' '));
    EXPECT_NE(save(opening("/a"), file_), "");
    EXPECT_EQ(std::filesystem::file_size(folder_ / "view.json.damaged-4"), 2u << 20);
}

TEST_F(UserSettingsTest, ALinkStaysAndItsTargetIsWritten) {
    namespace fs = std::filesystem;
    fs::create_directory(folder_ / "dotfiles");
    std::ofstream(folder_ / "dotfiles" / "vcp.json") << R"({"recent": ["/a"]})";
    fs::permissions(folder_ / "dotfiles" / "vcp.json", fs::perms(0640));
    fs::create_symlink("dotfiles/vcp.json", folder_ / "middle");
    fs::create_symlink(folder_ / "middle", file_);
    save(opening("/b"), file_);
    EXPECT_TRUE(fs::is_symlink(file_) && fs::is_symlink(folder_ / "middle"));
    EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(folder_ / "dotfiles" / "vcp.json")));
    EXPECT_EQ(fs::status(folder_ / "dotfiles" / "vcp.json").permissions(), fs::perms(0640));
    EXPECT_EQ(readUserSettings(file_)->recent, (std::vector<std::string>{"/b", "/a"}));

    // To where nothing is yet.
    fs::remove(folder_ / "dotfiles" / "vcp.json");
    save(opening("/c"), file_);
    EXPECT_TRUE(fs::is_symlink(file_));
    EXPECT_EQ(readUserSettings(folder_ / "dotfiles" / "vcp.json")->recent, std::vector<std::string>{"/c"});

    // Nothing is written through a link that somebody put where a file of ours might be made.
    fs::create_symlink(folder_ / "victim", folder_ / "view.json.damaged");
    fs::remove(file_);
    write("{");
    save(opening("/d"), file_);
    EXPECT_FALSE(fs::exists(folder_ / "victim"));
    EXPECT_EQ(contentOf(folder_ / "view.json.damaged-2"), "{");
}

TEST_F(UserSettingsTest, WhatCannotBeWrittenIsSaid) {
    namespace fs = std::filesystem;
    fs::create_symlink("view.json", file_);
    auto saved = saveChanges(opening("/a"), file_);
    ASSERT_FALSE(saved) << "a link to itself";
    EXPECT_EQ(saved.error().file, file_.string());
    fs::remove(file_);
    fs::create_directory(file_);
    EXPECT_FALSE(saveChanges(opening("/a"), file_));
    fs::remove_all(file_);
    ASSERT_EQ(mkfifo(file_.c_str(), 0600), 0);
    EXPECT_FALSE(readUserSettings(file_)) << "and nobody waits for the pipe's writer";
    EXPECT_FALSE(saveChanges(opening("/a"), file_));
    EXPECT_TRUE(fs::is_fifo(file_));
    fs::remove(file_);
    write("{}");
    EXPECT_FALSE(saveChanges(opening("/a"), file_ / "view.json")) << "a file where the folder should be";
    if (geteuid() == 0) return;  // whom no folder refuses
    fs::permissions(folder_.path(), fs::perms(0500));
    saved = saveChanges(opening("/a"), file_);
    fs::permissions(folder_.path(), fs::perms(0700));
    ASSERT_FALSE(saved);
    EXPECT_EQ(contentOf(file_), "{}");
}

}  // namespace
}  // namespace vcp
