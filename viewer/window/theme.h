// How the window looks: colours and sizes of the light and the dark theme.
//
// All sizes of the layout are in units of 8: a unit is a pixel at scale 1.
#pragma once

#include <optional>
#include <vector>

#include <imgui.h>
#include <glm/vec3.hpp>

#include "viewer/window/user_settings.h"

namespace vcp {

/// Colours by what they are for, as Dear ImGui packs them. There is one accent.
struct Palette {
    ImU32 ground;    ///< of bars and the panel
    ImU32 raised;    ///< of cards, popups and plates over the picture
    ImU32 control;   ///< of buttons and tracks
    ImU32 hovered;   ///< of those under the cursor
    ImU32 chosen;    ///< of the one of several names that is chosen
    ImU32 line;      ///< between parts
    ImU32 ink;       ///< of text
    ImU32 dim;       ///< of text that says less
    ImU32 accent;    ///< of what is on, chosen or measured
    ImU32 onAccent;  ///< of text and icons on the accent
    ImU32 problem;
    ImU32 halo;  ///< around lines over the picture
};

/// What panels are laid out with.
struct Look {
    float scale = 1;
    Palette palette{};
    ImFont *body = nullptr, *strong = nullptr, *small = nullptr, *title = nullptr;
    /// A picture of InterfacePainter::setPictures in the fonts' texture.
    struct Texture {
        ImVec2 from, to;
    };
    std::vector<Texture> pictures;

    [[nodiscard]] float units(float n) const { return n * scale; }
};

const Palette& paletteOf(bool isDark);
/// Sets Dear ImGui's colours and sizes.
void applyPalette(const Palette& palette, float scale);

/// Returns the picture's background where none was chosen: above and below, linear.
struct Background {
    glm::vec3 top, bottom;
};
Background backgroundOf(bool isDark);

/// Returns the scale of the layout: the display's, but never so large that a window has less than 320 x 240 units.
/// Quarters, from 1 to 4.
float layoutScale(float display, int width, int height);

/// Returns whether windows are dark: as chosen, else as the desktop asks (desktop_theme.h), else dark.
bool isDark(ThemeChoice choice, std::optional<bool> desktop);

}  // namespace vcp
