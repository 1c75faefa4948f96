// What the window's panels are made of, without a window: theme, text, icons, file list, thumbnails, demo.
#include <chrono>
#include <fstream>
#include <regex>

#include <gtest/gtest.h>
#include <imgui.h>

#include "tests/support/test_folder.h"
#include "viewer/scene/inputs.h"
#include "viewer/window/controls.h"
#include "viewer/window/demo_mesh.h"
#include "viewer/window/desktop_theme.h"
#include "viewer/window/file_list.h"
#include "viewer/window/theme.h"
#include "viewer/window/thumbnails.h"

namespace vcp {
namespace {

namespace fs = std::filesystem;

class DesktopTheme : public testing::Test {
protected:
    void write(const std::string& name, const std::string& text) const {
        fs::create_directories((folder_ / name).parent_path());
        std::ofstream(folder_ / name) << text;
    }
    [[nodiscard]] std::optional<bool> isDark(const std::string& gtkTheme = "", const std::string& desktop = "") const {
        return desktopIsDark(
            [&](const char* name) {
                return name == std::string("GTK_THEME")             ? gtkTheme
                       : name == std::string("XDG_CURRENT_DESKTOP") ? desktop
                                                                    : std::string();
            },
            folder_ / ".", [this] { return portal_; });
    }
    std::optional<bool> portal_;

    TestFolder folder_{"vcp_desktop_theme_test"};
};

TEST_F(DesktopTheme, WithoutFilesNothingIsSaid) {
    EXPECT_EQ(isDark(), std::nullopt);
    write("gtk-4.0/settings.ini", "[Settings]\ngtk-font-name=Sans 10\n");
    write("kdeglobals", std::string("\0\xff[[\n=,", 7));
    EXPECT_EQ(isDark(), std::nullopt);
}

TEST_F(DesktopTheme, TheEnvironmentComesFirst) {
    write("gtk-4.0/settings.ini", "[Settings]\ngtk-application-prefer-dark-theme=0\n");
    EXPECT_EQ(isDark("Adwaita:dark"), true);
    EXPECT_EQ(isDark("Yaru-dark"), true);
    EXPECT_EQ(isDark("Adwaita"), false);
    portal_ = true;
    EXPECT_EQ(isDark("Adwaita"), false);
}

TEST_F(DesktopTheme, ThePortalComesBeforeFiles) {
    write("gtk-4.0/settings.ini", "[Settings]\ngtk-application-prefer-dark-theme=0\n");
    EXPECT_EQ(isDark(), false);
    portal_ = true;
    EXPECT_EQ(isDark(), true);
}

TEST(Portal, IsAskedByTheFirstProgramThatAnswers) {
    using Calls = std::vector<ProgramCall>;
    constexpr std::chrono::milliseconds kMost{20000};
    EXPECT_EQ(portalIsDark({{"echo", "v v u 1"}}, kMost), true);
    EXPECT_EQ(portalIsDark({{"echo", "v v u 2"}}, kMost), false);
    EXPECT_EQ(portalIsDark({{"echo", "(<<uint32 1>>,)"}}, kMost), true);
    EXPECT_EQ(portalIsDark({{"echo", "(<uint32 2>,)"}}, kMost), false);
    EXPECT_EQ(portalIsDark({{"echo", "v v u 0"}, {"echo", "v v u 1"}}, kMost), std::nullopt) << "no preference";
    EXPECT_EQ(portalIsDark({{"echo", "v v u 21"}}, kMost), std::nullopt);
    const Calls failing{{"no-such-program"}, {"false"}, {"echo", "no number"}, {"yes"}};
    EXPECT_EQ(portalIsDark(failing, kMost), std::nullopt);
    Calls last = failing;
    last.push_back({"echo", "v v u 1"});
    EXPECT_EQ(portalIsDark(last, kMost), true);
}

TEST(Portal, WhatHangsIsKilled) {
    EXPECT_EQ(portalIsDark({{"sleep", "1000"}, {"echo", "v v u 1"}}, std::chrono::milliseconds(50)), std::nullopt);
}

TEST_F(DesktopTheme, GtkSaysItByASwitchOrByItsThemesName) {
    write("gtk-3.0/settings.ini", "[Settings]\ngtk-theme-name = Adwaita-dark\n");
    EXPECT_EQ(isDark(), true);
    write("gtk-4.0/settings.ini", "[Other]\ngtk-application-prefer-dark-theme=1\n[Settings]\ngtk-theme-name=Adwaita\n");
    EXPECT_EQ(isDark(), false) << "GTK 4 before GTK 3, and only in its section";
    write("gtk-4.0/settings.ini", "[Settings]\nGTK-Application-Prefer-Dark-Theme=true\n");
    EXPECT_EQ(isDark(), true);
}

TEST_F(DesktopTheme, KdeSaysItByItsColours) {
    write("kdeglobals", "[Colors:View]\nBackgroundNormal=0,0,0\n[Colors:Window]\nBackgroundNormal=239,240,241\n");
    EXPECT_EQ(isDark(), false);
    write("gtk-3.0/settings.ini", "[Settings]\ngtk-application-prefer-dark-theme=1\n");
    EXPECT_EQ(isDark(), true) << "elsewhere GTK comes first";
    EXPECT_EQ(isDark("", "KDE"), false);
    write("kdeglobals", "[General]\nColorScheme=BreezeDark\n");
    EXPECT_EQ(isDark("", "KDE"), true);
}

TEST(Theme, AChoiceIsFollowed) {
    EXPECT_TRUE(isDark(ThemeChoice::Dark, false));
    EXPECT_FALSE(isDark(ThemeChoice::Light, true));
    EXPECT_TRUE(isDark(ThemeChoice::System, true));
    EXPECT_FALSE(isDark(ThemeChoice::System, false));
    EXPECT_TRUE(isDark(ThemeChoice::System, std::nullopt));
}

/// The ratio of luminances by which text is read (WCAG 2.1).
double contrast(ImU32 a, ImU32 b) {
    const auto light = [](ImU32 colour) {
        const ImVec4 c = ImGui::ColorConvertU32ToFloat4(colour);
        const auto linear = [](float x) { return x <= 0.04045f ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4); };
        return 0.2126 * linear(c.x) + 0.7152 * linear(c.y) + 0.0722 * linear(c.z) + 0.05;
    };
    return std::max(light(a), light(b)) / std::min(light(a), light(b));
}

TEST(Theme, TextIsReadOnEveryGround) {
    for (const bool dark : {false, true}) {
        const Palette& palette = paletteOf(dark);
        for (const ImU32 ground : {palette.ground, palette.raised, palette.control}) {
            EXPECT_GE(contrast(palette.ink, ground), 7) << dark;
            EXPECT_GE(contrast(palette.dim, ground), 4.4) << dark;
            EXPECT_GE(contrast(palette.accent, ground), 4) << dark;
        }
        EXPECT_GE(contrast(palette.onAccent, palette.accent), 4.5) << dark;
        EXPECT_GE(contrast(palette.problem, palette.raised), 4.5) << dark;
    }
}

TEST(Theme, AScaleLeavesRoomForTheLayout) {
    EXPECT_EQ(layoutScale(1, 1280, 800), 1);
    EXPECT_EQ(layoutScale(1.3f, 1280, 800), 1.25f) << "quarters";
    EXPECT_EQ(layoutScale(3, 3840, 2160), 3);
    EXPECT_EQ(layoutScale(3, 320, 240), 1) << "no fewer than 320 x 240 units";
    EXPECT_EQ(layoutScale(3, 640, 720), 2);
    EXPECT_EQ(layoutScale(0.5f, 100, 100), 1);
}

TEST(Typeset, NumbersKeepTheirUnitsAndDigitsTogether) {
    EXPECT_EQ(typeset("1 087 716 triangles"), "1\u202f087\u202f716 triangles");
    EXPECT_EQ(typeset("105.6 MB of 536.9 MB"), "105.6\u202fMB of 536.9\u202fMB");
    EXPECT_EQ(typeset("Sharp to 0.46 px: memory is full"), "Sharp to 0.46\u202fpx: memory is full");
    EXPECT_EQ(typeset("0.3693 +-0.0012"), "0.3693 ±0.0012");
    EXPECT_EQ(typeset("-0.14082  1.20359  -0.5"), "\u22120.14082  1.20359  \u22120.5");
    EXPECT_EQ(typeset("+-9.1e-06, 2e+12"), "±9.1\u202f×\u202f10\u207b\u2076, 2\u202f×\u202f10\u00b9\u00b2");
    EXPECT_EQ(typeset("1920 x 1080"), "1920\u202f×\u202f1080");
    EXPECT_EQ(typeset("picture-1.png in the folder"), "picture-1.png in the folder");
    EXPECT_EQ(typeset("3 parts, 4 per second"), "3 parts, 4 per second");
}

/// The fonts as the build embeds them have every icon of the list, the signs that typeset() makes, and Greek and
/// Cyrillic.
TEST(Fonts, HaveWhatIsDrawn) {
    const std::string folder = std::string(VCP_SOURCE_DIR) + "/viewer/annotation/fonts/";
    const auto fontOf = [&](ImFontAtlas& atlas, const char* file) {
        static constexpr ImWchar kAll[] = {0x20, 0xffff, 0};
        return atlas.AddFontFromFileTTF((folder + file).c_str(), 8, nullptr, kAll);
    };
    ImFontAtlas icons;
    const ImFont* const icon = fontOf(icons, "icons.ttf");
    ASSERT_TRUE(icon && icons.Build());
    const std::string list = contentOf(std::string(VCP_SOURCE_DIR) + "/viewer/window/icons.h");
    const std::regex code("U\\+(F[0-9A-F]{3})");
    size_t found = 0;
    for (auto at = std::sregex_iterator(list.begin(), list.end(), code); at != std::sregex_iterator(); ++at, ++found)
        EXPECT_NE(icon->FindGlyphNoFallback(ImWchar(std::stoul((*at)[1], nullptr, 16))), nullptr) << (*at)[1];
    EXPECT_GT(found, 20u);
    for (const char* file : {"inter_regular.otf", "inter_semibold.otf"}) {
        ImFontAtlas atlas;
        const ImFont* const font = fontOf(atlas, file);
        ASSERT_TRUE(font && atlas.Build());
        for (const int sign : {0x202f, 0x2070, 0x2079, 0x207b, 0x2212, 0xb1, 0xd7, 0x2026, 0xb0, 0xe4, 0x17f, 0x3a9,
                               0x3ce, 0x416, 0x451})
            EXPECT_NE(font->FindGlyphNoFallback(ImWchar(sign)), nullptr) << file << ' ' << std::hex << sign;
        for (ImWchar digit = '0'; digit <= '9'; ++digit)
            EXPECT_NEAR(font->GetCharAdvance(digit), font->GetCharAdvance('0'), 0.02) << "figures are tabular";
        EXPECT_LT(font->GetCharAdvance(0x202f), font->GetCharAdvance(' '));
    }
}

TEST(FileListTest, FoldersFirstThenWhatCanBeOpened) {
    const TestFolder folder{"vcp_file_list_test"};
    fs::create_directory(folder / "Zebra");
    fs::create_directory(folder / ".hidden");
    for (const char* name : {"b.vcp", "A.PLY", "notes.txt", ".secret.ply", "c.obj.gz", "scene.json"})
        std::ofstream(folder / name) << "12345";
    fs::create_directory(folder / "scan");
    std::ofstream(folder / "scan/manifest.vcps") << "12345";
    FileList list;
    list.read(folder / ".");
    std::vector<std::string> names;
    for (const FileList::Entry& entry : list.holding("")) names.push_back(entry.name);
    EXPECT_EQ(names, (std::vector<std::string>{"Zebra", "A.PLY", "b.vcp", "c.obj.gz", "scan", "scene.json"}));
    EXPECT_FALSE(list.holding("scan").front().isFolder) << "it is opened, not looked into";
    EXPECT_EQ(list.problem(), "");
    ASSERT_EQ(list.holding("a.p").size(), 1u);
    EXPECT_EQ(list.holding("a.p").front().bytes, 5u);
    list.read(folder / "gone");
    EXPECT_NE(list.problem(), "");
    EXPECT_TRUE(list.holding("").empty());
}

TEST(FileListTest, SeveralWordsAreFoundInAnyOrder) {
    EXPECT_TRUE(holds("Ctrl+S: save the picture", "picture save"));
    EXPECT_TRUE(holds("Ctrl+S: save the picture", "  PICT  ctrl+s "));
    EXPECT_FALSE(holds("Ctrl+S: save the picture", "picture copy"));
    EXPECT_TRUE(holds("Ctrl+S: save the picture", ""));
    EXPECT_TRUE(holds("", " "));
    EXPECT_FALSE(holds("", "a"));
}

TEST(FileListTest, WhatWasOpenedHasAName) {
    for (const auto& [opened, name] : {std::pair("/scans/a.vcp", "a.vcp"),
                                       {"/scans/b/", "b"},
                                       {"/scans/b", "b"},
                                       {"/scans/b/manifest.vcps", "b"},
                                       {"https://here/c.vcp", "c.vcp"},
                                       {"https://here/d/manifest.vcps", "d"},
                                       {"/", "/"}})
        EXPECT_EQ(shownName(opened), name);
}

TEST(ThumbnailTest, IsTheMiddleOfWhatPanelsLeave) {
    // Left half red, right half blue; the panel covers the blue one.
    Picture picture{400, 170, std::vector<uint8_t>(size_t{4} * 400 * 170)};
    for (size_t i = 0; i < size_t{400} * 170; ++i) {
        picture.rgba[4 * i] = i % 400 < 272 ? 250 : 0;
        picture.rgba[4 * i + 2] = i % 400 < 272 ? 0 : 250;
    }
    const Picture small = thumbnailOf(picture, {.right = 128});
    ASSERT_EQ(small.width, kThumbnailWidth);
    ASSERT_EQ(small.height, kThumbnailHeight);
    for (size_t i = 0; i < size_t{kThumbnailWidth} * kThumbnailHeight; ++i) {
        ASSERT_EQ(small.rgba[4 * i], 250) << i;
        ASSERT_EQ(small.rgba[4 * i + 3], 255) << i;
    }
    for (const auto& [width, height] : {std::pair(1u, 1u), std::pair(3u, 900u), std::pair(900u, 3u)}) {
        const Picture odd{width, height, std::vector<uint8_t>(size_t{4} * width * height, 77)};
        EXPECT_EQ(thumbnailOf(odd, {.right = 5000, .top = 20}).rgba[1], 77);
    }
}

TEST(ThumbnailTest, AreKeptByNameAndTheOldestGo) {
    const TestFolder folder{"vcp_thumbnail_test"};
    const Thumbnails thumbnails(folder / "thumbnails");
    const Picture picture{kThumbnailWidth, kThumbnailHeight,
                          std::vector<uint8_t>(size_t{4} * kThumbnailWidth * kThumbnailHeight, 200)};
    EXPECT_FALSE(thumbnails.read("/a.vcp"));
    for (size_t i = 0; i < Thumbnails::kMostFiles + 3; ++i)
        ASSERT_TRUE(thumbnails.keep("/scan-" + std::to_string(i) + ".vcp", picture));
    const auto last = thumbnails.read("/scan-66.vcp");
    ASSERT_TRUE(last) << last.error().line();
    EXPECT_EQ(*last, picture);
    size_t files = 0;
    for (const auto& each : fs::directory_iterator(folder / "thumbnails")) files += each.is_regular_file() ? 1 : 0;
    EXPECT_EQ(files, Thumbnails::kMostFiles);
    ASSERT_TRUE(thumbnails.keep("/odd.vcp", Picture{2, 2, std::vector<uint8_t>(16)}));
    EXPECT_FALSE(thumbnails.read("/odd.vcp")) << "of another size";
}

TEST(DemoMesh, IsAMeshThatReadersTake) {
    const TestFolder folder{"vcp_demo_mesh_test"};
    ASSERT_TRUE(writeDemoMesh(folder / "demo.ply"));
    ASSERT_TRUE(writeDemoMesh(folder / "again.ply"));
    EXPECT_EQ(contentOf(folder / "demo.ply"), contentOf(folder / "again.ply"));
    EXPECT_EQ(fs::file_size(folder / "demo.ply") - contentOf(folder / "demo.ply").find("end_header\n") - 11,
              kDemoTriangles / 2 * 15 + kDemoTriangles * 13);
}

}  // namespace
}  // namespace vcp
