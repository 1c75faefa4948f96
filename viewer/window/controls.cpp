#include "viewer/window/controls.h"

#include <algorithm>
#include <cctype>

#include "viewer/window/icons.h"

namespace vcp {

namespace {

constexpr const char *kThinSpace = "\u202f", *kDots = "\u2026";
constexpr float kTipWidth = 280;

bool isDigit(char c) { return std::isdigit(uint8_t(c)) != 0; }

/// Whether byte `i` begins a character of UTF-8.
bool beginsCharacter(const std::string& text, size_t i) { return (uint8_t(text[i]) & 0xc0) != 0x80; }

float widthOf(const std::string& text) { return ImGui::CalcTextSize(text.data(), text.data() + text.size()).x; }

ImVec4 colour(ImU32 packed) { return ImGui::ColorConvertU32ToFloat4(packed); }

void textIn(ImDrawList& list, ImFont* font, ImVec2 at, ImU32 ink, const std::string& line) {
    list.AddText(font, font->FontSize, at, ink, line.data(), line.data() + line.size());
}

/// Whether a word of a text that begins at `from` is a unit of the number before it.
bool isUnit(const std::string& text, size_t from) {
    static constexpr const char* kUnits[] = {"px", "ms", "s", "min", "B", "kB", "MB", "GB", "TB", "%"};
    const size_t end = std::min({text.find_first_of(" ,;:)\n", from), text.size()});
    const std::string word = text.substr(from, end - from);
    return std::any_of(std::begin(kUnits), std::end(kUnits), [&](const char* unit) { return word == unit; });
}

/// Sets an exponent, which begins at `i` as in "1e-06", and moves `i` to its last character.
std::string powerOfTen(const std::string& text, size_t& i) {
    static constexpr const char* kRaised[] = {"\u2070", "\u00b9", "\u00b2", "\u00b3", "\u2074",
                                              "\u2075", "\u2076", "\u2077", "\u2078", "\u2079"};
    std::string set = std::string(kThinSpace) + "×" + kThinSpace + "10";
    if (text[++i] == '-') set += "\u207b";
    for (bool isLeading = true; i + 1 < text.size() && isDigit(text[i + 1]);) {
        const int digit = text[++i] - '0';
        isLeading = isLeading && digit == 0;
        if (!isLeading) set += kRaised[digit];
    }
    return set;
}

}  // namespace

std::string typeset(const std::string& text) {
    std::string set;
    for (size_t i = 0; i < text.size(); ++i) {
        const char before = i > 0 ? text[i - 1] : ' ', after = i + 1 < text.size() ? text[i + 1] : ' ';
        if (text.compare(i, 2, "+-") == 0) {
            set += "±";
            ++i;
        } else if (text[i] == '-' && isDigit(after) && !std::isalnum(uint8_t(before)) && before != '-') {
            set += "\u2212";
        } else if (text.compare(i, 3, " x ") == 0 && isDigit(before) && i + 3 < text.size() && isDigit(text[i + 3])) {
            set += std::string(kThinSpace) + "×" + kThinSpace;
            i += 2;
        } else if (text[i] == 'e' && isDigit(before) && (after == '-' || after == '+')) {
            set += powerOfTen(text, i);
        } else if (text[i] == ' ' && isDigit(before) && (isDigit(after) || isUnit(text, i + 1))) {
            set += kThinSpace;
        } else {
            set += text[i];
        }
    }
    return set;
}

std::string fitted(const std::string& text, float width) {
    if (widthOf(text) <= width) return text;
    size_t end = text.size();
    while (end > 0 && (!beginsCharacter(text, end - 1) || widthOf(text.substr(0, end) + kDots) > width)) --end;
    while (end > 0 && !beginsCharacter(text, end)) --end;
    return text.substr(0, end) + kDots;
}

std::string fittedEnd(const std::string& text, float width) {
    if (widthOf(text) <= width) return text;
    size_t from = 0;
    while (from < text.size() && (!beginsCharacter(text, from) || widthOf(kDots + text.substr(from)) > width)) ++from;
    return kDots + text.substr(from);
}

void text(const std::string& line) { ImGui::TextUnformatted(line.data(), line.data() + line.size()); }

void text(ImFont* font, ImU32 ink, const std::string& line) {
    ImGui::PushFont(font);
    ImGui::PushStyleColor(ImGuiCol_Text, ink);
    text(line);
    ImGui::PopStyleColor();
    ImGui::PopFont();
}

void wrapped(const std::string& line) {
    ImGui::PushTextWrapPos(0);
    text(line);
    ImGui::PopTextWrapPos();
}

void showTip(const Look& look, const Tip& tip) {
    const bool hasText = *tip.does != '\0' || *tip.keys != '\0';
    if (!hasText || !ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled)) return;
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(look.units(8), look.units(6)));
    ImGui::BeginTooltip();
    ImGui::PushTextWrapPos(look.units(kTipWidth));
    text(tip.does);
    ImGui::PopTextWrapPos();
    if (*tip.keys != '\0') {
        if (*tip.does != '\0') ImGui::SameLine(0, look.units(16));
        text(look.body, look.palette.dim, tip.keys);
    }
    ImGui::EndTooltip();
    ImGui::PopStyleVar();
}

bool iconButton(const Look& look, const char* icon, const char* id, const Tip& tip, bool isOn, float units) {
    const float side = look.units(units);
    const ImVec2 from = ImGui::GetCursorScreenPos();
    const bool isPressed = ImGui::InvisibleButton(id, {side, side});
    const bool isHovered = ImGui::IsItemHovered();
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const ImVec2 to(from.x + side, from.y + side);
    if (isOn || isHovered)
        list.AddRectFilled(from, to, isOn ? look.palette.accent : look.palette.hovered, look.units(6));
    ImGui::PushFont(look.body);
    const ImVec2 size = ImGui::CalcTextSize(icon);
    ImGui::PopFont();
    const ImU32 ink = isOn ? look.palette.onAccent : isHovered ? look.palette.ink : look.palette.dim;
    textIn(list, look.body, {from.x + 0.5f * (side - size.x), from.y + 0.5f * (side - size.y)},
           ImGui::GetColorU32(colour(ink)), icon);
    showTip(look, tip);
    return isPressed;
}

bool textButton(const Look& look, const char* icon, const char* label, const Tip& tip, float width, bool isPrimary) {
    ImGui::PushFont(isPrimary ? look.strong : look.body);
    const std::string shown = icon ? std::string(icon) + "  " + label : label;
    ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, ImVec2(look.units(isPrimary ? 16 : 8), look.units(4)));
    if (isPrimary) {
        ImGui::PushStyleColor(ImGuiCol_Button, look.palette.accent);
        ImGui::PushStyleColor(ImGuiCol_ButtonHovered, look.palette.accent);
        ImGui::PushStyleColor(ImGuiCol_ButtonActive, look.palette.accent);
        ImGui::PushStyleColor(ImGuiCol_Text, look.palette.onAccent);
    }
    const bool isPressed = ImGui::Button(shown.c_str(), {width, look.units(isPrimary ? 32 : 24)});
    if (isPrimary) ImGui::PopStyleColor(4);
    ImGui::PopStyleVar();
    ImGui::PopFont();
    showTip(look, tip);
    return isPressed;
}

bool switchRow(const Look& look, const char* label, bool& isOn, const Tip& tip) {
    const ImVec2 from = ImGui::GetCursorScreenPos();
    const float width = ImGui::GetContentRegionAvail().x, height = look.units(24);
    const bool isPressed = ImGui::InvisibleButton(label, {std::max(width, 1.0f), height});
    if (isPressed) isOn = !isOn;
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const float track = look.units(32), thick = look.units(16), radius = 0.5f * thick;
    const ImVec2 at(from.x + width - track, from.y + 0.5f * (height - thick));
    const std::string shown = fitted(label, width - track - look.units(8));
    textIn(list, look.body, {from.x, from.y + 0.5f * (height - look.body->FontSize)}, ImGui::GetColorU32(ImGuiCol_Text),
           shown);
    const ImU32 ground = isOn                     ? look.palette.accent
                         : ImGui::IsItemHovered() ? look.palette.hovered
                                                  : look.palette.control;
    list.AddRectFilled(at, {at.x + track, at.y + thick}, ImGui::GetColorU32(colour(ground)), radius);
    const float middle = isOn ? at.x + track - radius : at.x + radius;
    list.AddCircleFilled({middle, at.y + radius}, radius - look.units(3),
                         ImGui::GetColorU32(colour(isOn ? look.palette.onAccent : look.palette.dim)));
    showTip(look, tip);
    return isPressed;
}

bool choiceRow(const Look& look, const char* id, std::span<const char* const> names, int& chosen, const Tip& tip) {
    const ImVec2 from = ImGui::GetCursorScreenPos();
    const float width = ImGui::GetContentRegionAvail().x, height = look.units(24), each = width / float(names.size());
    ImDrawList& list = *ImGui::GetWindowDrawList();
    list.AddRectFilled(from, {from.x + width, from.y + height}, look.palette.control, look.units(6));
    bool isOther = false;
    ImGui::PushID(id);
    for (int i = 0; i < int(names.size()); ++i) {
        const ImVec2 at(from.x + each * float(i), from.y);
        ImGui::SetCursorScreenPos(at);
        if (ImGui::InvisibleButton(names[size_t(i)], {each, height})) {
            isOther = chosen != i;
            chosen = i;
        }
        showTip(look, tip);
        const bool isChosen = i == chosen;
        if (isChosen || ImGui::IsItemHovered())
            list.AddRectFilled({at.x + look.units(2), at.y + look.units(2)},
                               {at.x + each - look.units(2), at.y + height - look.units(2)},
                               isChosen ? look.palette.chosen : look.palette.hovered, look.units(4));
        const std::string shown = fitted(names[size_t(i)], each);
        textIn(list, look.body, {at.x + 0.5f * (each - widthOf(shown)), at.y + 0.5f * (height - look.body->FontSize)},
               isChosen ? look.palette.ink : look.palette.dim, shown);
    }
    ImGui::PopID();
    return isOther;
}

bool comboRow(const Look& look, const char* id, std::span<const char* const> names, int& chosen, const Tip& tip) {
    bool isOther = false;
    const ImVec2 from = ImGui::GetCursorScreenPos();
    const float right = from.x + ImGui::GetContentRegionAvail().x;
    ImGui::SetNextItemWidth(-1);
    if (ImGui::BeginCombo(id, names[size_t(chosen)], ImGuiComboFlags_NoArrowButton | ImGuiComboFlags_HeightLargest)) {
        for (int i = 0; i < int(names.size()); ++i)
            if (ImGui::Selectable(names[size_t(i)], i == chosen)) {
                isOther = i != chosen;
                chosen = i;
            }
        ImGui::EndCombo();
    } else {
        showTip(look, tip);
    }
    textIn(*ImGui::GetWindowDrawList(), look.body, {right - look.units(24), from.y + look.units(4)}, look.palette.dim,
           icon::kChevronDown);
    return isOther;
}

void valueRow(const Look& look, const char* label, const std::string& value) {
    const std::string set = typeset(value);
    const float room = ImGui::GetContentRegionAvail().x, wide = widthOf(set), right = ImGui::GetCursorPosX() + room;
    text(look.body, look.palette.dim, label);
    if (widthOf(label) + look.units(16) + wide <= room) {
        ImGui::SameLine(right - wide);
        text(set);
        return;
    }
    // Numbers that have no room side by side stand one above the other: none is broken.
    for (size_t from = 0; from < set.size();) {
        const size_t end = wide <= room ? set.size() : std::min(set.find("  ", from), set.size());
        const std::string part = fitted(set.substr(from, end - from), room);
        ImGui::SetCursorPosX(right - widthOf(part));
        text(part);
        from = end + 2;
    }
}

void caption(const Look& look, const char* label) {
    ImGui::Dummy({0, 0});
    text(look.small, look.palette.dim, label);
}

void progressBar(const Look& look, double part) {
    const ImVec2 from = ImGui::GetCursorScreenPos();
    const float width = ImGui::GetContentRegionAvail().x, height = look.units(4);
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const float filled = width * float(std::clamp(part, 0.0, 1.0));
    list.AddRectFilled(from, {from.x + width, from.y + height}, look.palette.control, height);
    if (filled > 0)
        list.AddRectFilled(from, {from.x + std::max(filled, height), from.y + height}, look.palette.accent, height);
    ImGui::Dummy({width, height});
}

bool sectionHead(const Look& look, const char* icon, const char* label, bool isOpenAtFirst) {
    ImGuiStorage& storage = *ImGui::GetStateStorage();
    const ImGuiID id = ImGui::GetID(label);
    const bool wasOpen = storage.GetBool(id, isOpenAtFirst);
    const ImVec2 from = ImGui::GetCursorScreenPos();
    const float width = ImGui::GetContentRegionAvail().x, height = look.units(32);
    const bool isPressed = ImGui::InvisibleButton(label, {std::max(width, 1.0f), height});
    const bool isOpen = isPressed ? !wasOpen : wasOpen;
    storage.SetBool(id, isOpen);
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const float top = from.y + 0.5f * (height - look.strong->FontSize);
    const ImU32 ink = ImGui::IsItemHovered() ? look.palette.ink : look.palette.dim;
    textIn(list, look.body, {from.x, top}, isOpen ? look.palette.accent : ink, icon);
    textIn(list, look.strong, {from.x + look.units(24), top}, look.palette.ink, label);
    textIn(list, look.body, {from.x + width - look.units(16), top}, ink,
           isOpen ? icon::kChevronDown : icon::kChevronRight);
    return isOpen;
}

void typedField(const Look& look, const char* icon, const std::string& typed, bool isMarked, const char* hint) {
    const ImVec2 from = ImGui::GetCursorScreenPos();
    const float width = ImGui::GetContentRegionAvail().x, height = look.units(32);
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const ImVec2 to(from.x + width, from.y + height);
    list.AddRectFilled(from, to, look.palette.control, look.units(6));
    list.AddRect(from, to, look.palette.accent, look.units(6), 0, look.units(1));
    const float top = from.y + 0.5f * (height - look.body->FontSize), left = from.x + look.units(36);
    textIn(list, look.body, {from.x + look.units(10), top}, look.palette.dim, icon);
    const std::string shown = fittedEnd(typed, width - look.units(48));
    if (isMarked)
        list.AddRectFilled({left, top}, {left + widthOf(shown), top + look.body->FontSize}, look.palette.accent);
    const ImU32 ink = isMarked ? look.palette.onAccent : look.palette.ink;
    textIn(list, look.body, {left, top}, typed.empty() ? look.palette.dim : ink, typed.empty() ? hint : shown);
    const float caret = left + (typed.empty() ? -look.units(2) : widthOf(shown) + look.units(1));
    list.AddLine({caret, top}, {caret, top + look.body->FontSize}, look.palette.accent, look.units(1));
    ImGui::Dummy({width, height});
}

}  // namespace vcp
