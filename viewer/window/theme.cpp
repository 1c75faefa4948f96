#include "viewer/window/theme.h"

#include <algorithm>
#include <cmath>

namespace vcp {

namespace {

constexpr float kLeastWidth = 320, kLeastHeight = 240, kLargestScale = 4;

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

bool isDark(ThemeChoice choice, std::optional<bool> desktop) {
    return choice == ThemeChoice::System ? desktop.value_or(true) : choice == ThemeChoice::Dark;
}

}  // namespace vcp
