// What panels are made of: buttons with icons, switches, choices, rows of numbers, drawn with Dear ImGui in a Look.
//
// Every control takes the tooltip that says what it does, and the key that does the same. Labels are also identities:
// two controls of one window with the same label need ImGui::PushID.
#pragma once

#include <span>
#include <string>

#include <imgui.h>
#include <glm/vec2.hpp>

#include "viewer/window/theme.h"

namespace vcp {

/// What a control tells while the cursor is on it. Either may be empty.
struct Tip {
    const char* does = "";
    const char* keys = "";
};

inline ImVec2 vec(glm::vec2 v) { return {v.x, v.y}; }

/// Returns the text as it is set: thin spaces, which no line is broken at, between the digits of a number and before
/// its unit; a true plus-minus, minus and times sign, and powers of ten.
std::string typeset(const std::string& text);

/// Returns the text, or its beginning or end with dots, so that it is at most so wide.
std::string fitted(const std::string& text, float width);
std::string fittedEnd(const std::string& text, float width);

void text(const std::string& line);
void text(ImFont* font, ImU32 colour, const std::string& line);
/// Writes text over as many lines as it needs.
void wrapped(const std::string& line);
/// Shows the tooltip of the control before it.
void showTip(const Look& look, const Tip& tip);

/// A square button of so many units with an icon. `isOn`: it shows that something is switched on.
bool iconButton(const Look& look, const char* icon, const char* id, const Tip& tip, bool isOn = false,
                float units = 32);
/// A button with text and, where `icon` is not null, an icon. `width` in pixels; 0: as wide as the text needs.
bool textButton(const Look& look, const char* icon, const char* label, const Tip& tip = {}, float width = 0,
                bool isPrimary = false);
/// A row with a label and a switch at its right end; the whole row may be clicked.
bool switchRow(const Look& look, const char* label, bool& isOn, const Tip& tip);
/// A row of names of which one is chosen; returns whether another one was.
bool choiceRow(const Look& look, const char* id, std::span<const char* const> names, int& chosen, const Tip& tip = {});
/// A row that shows the chosen one of many names, and lets another one be chosen.
bool comboRow(const Look& look, const char* id, std::span<const char* const> names, int& chosen, const Tip& tip);
/// A row of a label, and a value at its right end, which goes into lines of its own where both have no room: parts of
/// it are parted by two spaces, and none is broken.
void valueRow(const Look& look, const char* label, const std::string& value);
/// A caption over controls.
void caption(const Look& look, const char* label);
/// A thin bar, filled from the left to `part` of 0 to 1.
void progressBar(const Look& look, double part);
/// The head of a section, which opens and closes it. Returns whether it is open.
bool sectionHead(const Look& look, const char* icon, const char* label, bool isOpenAtFirst);
/// A field that shows typed text behind an icon, with a caret, or marked; a hint where there is none.
void typedField(const Look& look, const char* icon, const std::string& typed, bool isMarked, const char* hint);

}  // namespace vcp
