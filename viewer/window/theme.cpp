#include "viewer/window/theme.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>

#include "viewer/camera/text_file.h"

namespace vcp {

namespace {

namespace fs = std::filesystem;

constexpr size_t kLargestFile = 64 << 10;
constexpr float kLeastWidth = 320, kLeastHeight = 240, kLargestScale = 4;
constexpr float kDarkestLight = 128;  // of a window's ground, 0 to 255: below it a theme is dark

constexpr ImU32 rgb(uint32_t hex, uint32_t alpha = 255) {
    return IM_COL32(hex >> 16 & 255, hex >> 8 & 255, hex & 255, alpha);
}

constexpr Palette kDark{.ground = rgb(0x1a1c20),
                        .raised = rgb(0x24272d),
                        .control = rgb(0x30343b),
                        .hovered = rgb(0x3c424b),
                        .chosen = rgb(0x4d545f),
                        .line = rgb(0x32363d),
                        .ink = rgb(0xeceef1),
                        .dim = rgb(0x9aa2ad),
                        .accent = rgb(0x4da3ff),
                        .onAccent = rgb(0x06192e),
                        .problem = rgb(0xff6b5e),
                        .halo = rgb(0x000000, 150)};
constexpr Palette kLight{.ground = rgb(0xf6f7f9),
                         .raised = rgb(0xffffff),
                         .control = rgb(0xe6e9ee),
                         .hovered = rgb(0xd6dbe2),
                         .chosen = rgb(0xffffff),
                         .line = rgb(0xd9dde3),
                         .ink = rgb(0x1b1f26),
                         .dim = rgb(0x5d6673),
                         .accent = rgb(0x0b66d6),
                         .onAccent = rgb(0xffffff),
                         .problem = rgb(0xc62f21),
                         .halo = rgb(0xffffff, 190)};

ImVec4 colour(ImU32 packed) { return ImGui::ColorConvertU32ToFloat4(packed); }

std::string lowered(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    return text;
}

/// Returns the value of "key=value" in a section of an .ini file; empty where there is none. Keys in any case.
std::string valueOf(const std::string& ini, const std::string& section, const std::string& key) {
    bool isInside = false;
    for (size_t from = 0; from < ini.size();) {
        const size_t end = std::min(ini.find('\n', from), ini.size());
        std::string line = ini.substr(from, end - from);
        from = end + 1;
        std::erase_if(line, [](unsigned char c) { return std::isspace(c) != 0; });
        if (line.starts_with('[')) isInside = lowered(line) == "[" + section + "]";
        if (isInside && lowered(line).starts_with(key + "=")) return line.substr(key.size() + 1);
    }
    return {};
}

std::string textOf(const fs::path& file) {
    const auto text = readText(file, kLargestFile, "a file of settings");
    return text ? *text : std::string();
}

/// Returns whether a theme's name says that it is dark: "Adwaita:dark", "Yaru-dark", "BreezeDark".
bool namesDark(const std::string& theme) { return lowered(theme).find("dark") != std::string::npos; }

std::optional<bool> gtkIsDark(const fs::path& file) {
    const std::string ini = textOf(file);
    const std::string prefers = lowered(valueOf(ini, "settings", "gtk-application-prefer-dark-theme"));
    const std::string theme = valueOf(ini, "settings", "gtk-theme-name");
    if (prefers == "1" || prefers == "true" || namesDark(theme)) return true;
    if (!prefers.empty() || !theme.empty()) return false;
    return std::nullopt;
}

/// KDE notes the colours themselves: "BackgroundNormal=49,54,59".
std::optional<bool> kdeIsDark(const fs::path& file) {
    const std::string ini = textOf(file);
    const std::string ground = valueOf(ini, "colors:window", "backgroundnormal");
    float light = 0;
    const char* at = ground.c_str();
    for (int i = 0; i < 3; ++i) {
        char* end = nullptr;
        light += std::strtof(at, &end) / 3;
        if (end == at) {
            const std::string scheme = valueOf(ini, "general", "colorscheme");
            return scheme.empty() ? std::nullopt : std::optional(namesDark(scheme));
        }
        at = *end == ',' ? end + 1 : end;
    }
    return light < kDarkestLight;
}

}  // namespace

const Palette& paletteOf(bool isDark) { return isDark ? kDark : kLight; }

Background backgroundOf(bool isDark) {
    if (isDark) return {UserSettings().backgroundTop, UserSettings().backgroundBottom};
    return {{0.62f, 0.66f, 0.71f}, {0.86f, 0.88f, 0.90f}};
}

void applyPalette(const Palette& palette, float scale) {
    ImGuiStyle& style = ImGui::GetStyle() = ImGuiStyle();
    style.WindowPadding = {16, 16};
    style.WindowBorderSize = 0;
    style.PopupBorderSize = 1;
    style.FramePadding = {8, 4};
    style.ItemSpacing = {8, 8};
    style.ItemInnerSpacing = {8, 4};
    style.FrameRounding = 6;
    style.PopupRounding = style.WindowRounding = 8;
    style.GrabRounding = style.ScrollbarRounding = 4;
    style.ScrollbarSize = 8;
    style.GrabMinSize = 12;
    style.WindowMinSize = {1, 1};
    style.ScaleAllSizes(scale);
    ImVec4* colours = style.Colors;
    const ImVec4 none(0, 0, 0, 0);
    colours[ImGuiCol_Text] = colour(palette.ink);
    colours[ImGuiCol_TextDisabled] = colour(palette.dim);
    colours[ImGuiCol_WindowBg] = colour(palette.ground);
    colours[ImGuiCol_PopupBg] = colours[ImGuiCol_ChildBg] = colour(palette.raised);
    colours[ImGuiCol_ChildBg] = none;
    colours[ImGuiCol_Border] = colours[ImGuiCol_Separator] = colour(palette.line);
    colours[ImGuiCol_FrameBg] = colours[ImGuiCol_Button] = colours[ImGuiCol_Header] = colour(palette.control);
    colours[ImGuiCol_FrameBgHovered] = colours[ImGuiCol_ButtonHovered] = colours[ImGuiCol_HeaderHovered] =
        colours[ImGuiCol_FrameBgActive] = colours[ImGuiCol_ButtonActive] = colours[ImGuiCol_HeaderActive] =
            colour(palette.hovered);
    colours[ImGuiCol_CheckMark] = colours[ImGuiCol_SliderGrab] = colours[ImGuiCol_SliderGrabActive] =
        colour(palette.accent);
    colours[ImGuiCol_ScrollbarBg] = none;
    colours[ImGuiCol_ScrollbarGrab] = colour(palette.control);
    colours[ImGuiCol_ScrollbarGrabHovered] = colours[ImGuiCol_ScrollbarGrabActive] = colour(palette.hovered);
    colours[ImGuiCol_NavHighlight] = none;
}

float layoutScale(float display, int width, int height) {
    const float most = std::min(float(width) / kLeastWidth, float(height) / kLeastHeight);
    const float scale = std::clamp(std::min(display, most), 1.0f, kLargestScale);
    return std::floor(scale * 4 + 0.01f) / 4;
}

std::optional<bool> desktopIsDark(const std::function<std::string(const char*)>& variable, const fs::path& config) {
    if (const std::string theme = variable("GTK_THEME"); !theme.empty()) return namesDark(theme);
    const auto gtk = [&] {
        const auto four = gtkIsDark(config / "gtk-4.0" / "settings.ini");
        return four ? four : gtkIsDark(config / "gtk-3.0" / "settings.ini");
    };
    const bool isKde = lowered(variable("XDG_CURRENT_DESKTOP")).find("kde") != std::string::npos;
    const auto kde = [&] { return kdeIsDark(config / "kdeglobals"); };
    const auto first = isKde ? kde() : gtk();
    return first ? first : isKde ? gtk() : kde();
}

bool isDark(ThemeChoice choice) {
    if (choice != ThemeChoice::System) return choice == ThemeChoice::Dark;
    const auto variable = [](const char* name) {
        const char* value = std::getenv(name);
        return std::string(value ? value : "");
    };
    const std::string home = variable("HOME"), config = variable("XDG_CONFIG_HOME");
    return desktopIsDark(variable, config.empty() ? fs::path(home) / ".config" : fs::path(config)).value_or(true);
}

}  // namespace vcp
