#include "viewer/window/interface.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <imgui.h>

#include "viewer/scene/option_values.h"
#include "viewer/window/icons.h"

namespace vcp {

namespace {

constexpr ImGuiWindowFlags kBar = ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                                  ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoTitleBar |
                                  ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoScrollWithMouse;
constexpr float kToolbarHeight = 40, kStatusHeight = 24, kPanelWidth = 288, kNarrowest = 32;
constexpr float kToastWidth = 400, kGap = 8;

}  // namespace

void Interface::layOut(glm::ivec2 framebuffer, const Look& look) {
    size_ = framebuffer;
    look_ = &look;
    ImGui::PushFont(look.body);
    toolbarHeight_ = units(kToolbarHeight);
    statusHeight_ = units(kStatusHeight);
    const bool isOpen = session_->viewer().isOpen();
    panelWidth_ = session_->user().panel ? std::min(units(kPanelWidth), size_.x - units(kNarrowest)) : 0;
    session_->viewer().setCovered({.right = panelWidth_, .top = toolbarHeight_, .bottom = statusHeight_});
    if (isOpen) {
        if (session_->showsPages) drawPages();
        drawAnnotations();
        drawSectionHandles();
        if (session_->showsFeedback()) drawFeedback();
        if (session_->user().panel) layOutPanel();
    } else if (MeshPreview* const preview = session_->preview()) {
        preview->draw(*ImGui::GetBackgroundDrawList(), session_->viewer().pictureOf(framebuffer), units(2));
    } else if (!session_->opening()) {
        layOutWelcome();
    }
    layOutToolbar();
    layOutStatus();
    if (session_->opening())
        layOutOpening();
    else if (const auto saving = session_->saving())
        layOutSaving(*saving);
    layOutToasts();
    if (page_ == Page::Help) layOutHelp();
    if (page_ == Page::Files) layOutFiles();
    if (const auto made = session_->takeNewPoint()) {
        openPoint(*made);
        markTyped();  // its name is a number
    }
    if (page_ == Page::Point) layOutPoint();
    ImGui::PopFont();
}

std::vector<Interface::Tool> Interface::tools() {
    ViewSession* const session = session_;
    const Viewer& viewer = session->viewer();
    const auto acts = [session](ViewerAction action) { return [session, action] { session->act(action); }; };
    const Shading& shading = viewer.shading();
    using Clicks = ViewSession::Clicks;
    return {
        {icon::kFit, "Fit", {"Fit all into the window", "F"}, false, false, acts(ViewerAction::Fit)},
        {icon::kHome, "Reset", {"Back to the view it opened with", "R"}, false, false, acts(ViewerAction::Reset)},
        {},
        {icon::kMeasure,
         "Measure",
         {"Measure: click points on the surface", "D"},
         session->clicks() == Clicks::Measure,
         true,
         [session] { session->toggleClicks(Clicks::Measure); }},
        {icon::kAnnotate,
         "Annotate",
         {"Annotate: click a point, then write", "N"},
         session->clicks() == Clicks::Annotate,
         true,
         [session] { session->toggleClicks(Clicks::Annotate); }},
        {icon::kCut,
         "Cut",
         {"Cut open with a plane through the middle", "X"},
         !viewer.sections().empty(),
         true,
         acts(ViewerAction::ToggleSection)},
        {icon::kCompare,
         "Compare",
         {"Compare: how far a surface lies from another", "K"},
         session->comparison() != nullptr,
         true,
         [this] { toggleComparison(); }},
        {},
        {icon::kShadows, "Shadows", {"Shadows", "S"}, shading.shadows, false, acts(ViewerAction::ToggleShadows)},
        {icon::kOcclusion,
         "Occlusion",
         {"Ambient occlusion: corners are darker", "O"},
         shading.occlusionRays > 0,
         false,
         acts(ViewerAction::ToggleOcclusion)},
        {icon::kShading,
         "Clay",
         {"Colours of the scan, or clay", "C"},
         shading.mode == ShadingMode::Clay,
         false,
         acts(ViewerAction::ToggleColour)},
        {},
        {icon::kFly,
         "Fly",
         {"Fly: W A S D, E up, Q down, drag to look", "G"},
         viewer.isFlying(),
         false,
         acts(ViewerAction::ToggleFly)},
        {icon::kPicture, "Save", {"Save the picture", "Ctrl+S"}, false, true, [this] { savePicture(); }},
    };
}

void Interface::layOutTool(const Tool& tool, bool withLabel) {
    if (!tool.icon) {
        const ImVec2 at = ImGui::GetCursorScreenPos();
        ImGui::Dummy({units(kGap), units(32)});
        const float x = std::round(at.x + 0.5f * units(kGap)) + 0.5f;
        ImGui::GetWindowDrawList()->AddLine({x, at.y + units(6)}, {x, at.y + units(26)}, look_->palette.line, units(1));
        return;
    }
    if (!withLabel) {
        if (iconButton(*look_, tool.icon, tool.label, tool.tip, tool.isOn)) tool.act();
        return;
    }
    const std::string shown = std::string(tool.icon) + "  " + tool.label;
    const Palette& palette = look_->palette;
    ImGui::PushStyleColor(ImGuiCol_Button, tool.isOn ? palette.accent : palette.ground);
    ImGui::PushStyleColor(ImGuiCol_ButtonHovered, tool.isOn ? palette.accent : palette.hovered);
    ImGui::PushStyleColor(ImGuiCol_ButtonActive, tool.isOn ? palette.accent : palette.hovered);
    ImGui::PushStyleColor(ImGuiCol_Text, tool.isOn ? palette.onAccent : palette.ink);
    if (ImGui::Button(shown.c_str(), {0, units(32)})) tool.act();
    ImGui::PopStyleColor(4);
    showTip(*look_, tool.tip);
}

void Interface::layOutToolbar() {
    ImGui::SetNextWindowPos({0, 0});
    ImGui::SetNextWindowSize({size_.x, toolbarHeight_});
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(units(4), units(4)));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0.0f);
    ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, ImVec2(units(4), 0));
    ImGui::Begin("toolbar", nullptr, kBar | ImGuiWindowFlags_NoBringToFrontOnFocus);
    ImGui::GetWindowDrawList()->AddLine({0, toolbarHeight_ - 0.5f}, {size_.x, toolbarHeight_ - 0.5f},
                                        look_->palette.line, units(1));
    if (iconButton(*look_, icon::kOpen, "open", {"Open a file, a recent one or the demo", "Ctrl+O"}))
        ImGui::OpenPopup("open menu");
    layOutOpenMenu();
    const bool isOpen = session_->viewer().isOpen();
    const std::vector<Tool> tools = isOpen ? this->tools() : std::vector<Tool>{};
    const float side = units(36), right = 2 * side, room = size_.x - units(8) - side - right;
    const auto widthOf = [&](const Tool& tool, bool withLabel) {
        if (!tool.icon) return units(kGap + 4);
        if (!withLabel || !tool.hasLabel) return side;
        return ImGui::CalcTextSize(tool.icon).x + ImGui::CalcTextSize("  ").x + ImGui::CalcTextSize(tool.label).x +
               units(20);
    };
    float wide = 0;
    for (const Tool& tool : tools) wide += widthOf(tool, true);
    const bool withLabels = wide <= room;
    // What has no room goes under the dots, which need some themselves.
    size_t shown = 0;
    for (float used = 0; shown < tools.size(); ++shown) {
        used += widthOf(tools[shown], withLabels);
        if (used + (shown + 1 < tools.size() ? side : 0) > room && !withLabels) break;
        ImGui::SameLine(0, units(4));
        layOutTool(tools[shown], withLabels && tools[shown].hasLabel);
    }
    if (shown < tools.size()) {
        ImGui::SameLine();
        if (iconButton(*look_, icon::kMore, "more", {"More", ""})) ImGui::OpenPopup("more menu");
        ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(units(8), units(8)));
        if (ImGui::BeginPopup("more menu")) {
            for (size_t i = shown; i < tools.size(); ++i)
                if (tools[i].icon && ImGui::MenuItem((std::string(tools[i].icon) + "  " + tools[i].label).c_str(),
                                                     tools[i].tip.keys, tools[i].isOn))
                    tools[i].act();
            ImGui::EndPopup();
        }
        ImGui::PopStyleVar();
    }
    ImGui::SameLine(size_.x - right);
    if (iconButton(*look_, icon::kHelp, "help", {"Keys and mouse", "F1"}, page_ == Page::Help)) toggleHelp();
    ImGui::SameLine();
    if (iconButton(*look_, icon::kPanel, "panel", {"The panel: view, light, cut, measure, layers", "Tab"},
                   isOpen && session_->user().panel))
        session_->togglePanel();
    ImGui::End();
    ImGui::PopStyleVar(3);
}

void Interface::layOutOpenMenu() {
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(units(8), units(8)));
    ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, ImVec2(units(8), units(8)));
    if (ImGui::BeginPopup("open menu")) {
        if (ImGui::MenuItem((std::string(icon::kOpen) + "  Open a file" + "\u2026").c_str(), "Ctrl+O")) openFileList();
        if (ImGui::MenuItem((std::string(icon::kDemo) + "  Open the demo").c_str())) openDemo();
        // The list is copied, since opening a file changes it.
        const std::vector<std::string> recent = session_->user().recent;
        if (!recent.empty()) {
            ImGui::Separator();
            text(look_->small, look_->palette.dim, "Recent");
        }
        const float most = std::min(units(360), size_.x - units(48));
        for (const std::string& file : recent) {
            if (ImGui::MenuItem((fittedEnd(file, most) + "##" + file).c_str())) host_.open({file});
            showTip(*look_, {file.c_str(), ""});
        }
        ImGui::EndPopup();
    }
    ImGui::PopStyleVar(2);
}

/// What the picture is, as a person would say it.
std::string Interface::stateText() const {
    const ViewerStatus& status = session_->viewer().status();
    const UpdateResult& update = status.update;
    const std::string error = formatPixels(refinedPixels(update)) + " px";
    // In steps of 5: each new text is a new picture of the window.
    if (status.measuredPart < 1)
        return fmt::format("Measuring heights, {:.0f} %; Esc ends it", 5 * std::floor(20 * status.measuredPart));
    if (status.drawnPart < 1) return fmt::format("Drawing, {:.0f} %", 5 * std::floor(20 * status.drawnPart));
    switch (status.detail) {
        case Detail::Loading:
            return update.pagesMissing > 0
                       ? fmt::format("Loading, {} to come", formatCount(update.pagesMissing, "part"))
                       : "Loading";
        case Detail::Settled:
            return update.drawable ? "Sharp" : "Ready";
        case Detail::Finest:
            return "All detail of the file is shown";
        case Detail::Budget:
            return fmt::format("Memory is full: sharp to {}", error);
    }
    return {};
}

/// By how much the picture is off at most, and in what.
static std::string offText(const UpdateResult& update) {
    const bool isOfColour = detailLimitOf(update) == DetailLimit::Colour;
    return fmt::format("{} by {} px at most", isOfColour ? "Colours off" : "Off", formatPixels(refinedPixels(update)));
}

void Interface::layOutStatus() {
    const Viewer& viewer = session_->viewer();
    const ViewerStatus& status = viewer.status();
    const Palette& palette = look_->palette;
    ImGui::SetNextWindowPos({0, size_.y - statusHeight_});
    ImGui::SetNextWindowSize({size_.x, statusHeight_});
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(units(8), units(5)));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0.0f);
    ImGui::Begin("status", nullptr, kBar | ImGuiWindowFlags_NoBringToFrontOnFocus);
    ImGui::PushFont(look_->small);
    ImGui::GetWindowDrawList()->AddLine({0, size_.y - statusHeight_ + 0.5f}, {size_.x, size_.y - statusHeight_ + 0.5f},
                                        palette.line, units(1));
    // What is most important comes first: a narrow window has no room for the rest.
    std::vector<std::pair<std::string, ImU32>> parts;
    if (viewer.isFlying()) parts.emplace_back(fmt::format("Flying, speed {:.2g}", viewer.flySpeed()), palette.accent);
    if (session_->isPicking())
        parts.emplace_back("Looking for the point\u2026", palette.accent);
    else if (session_->clicks() == ViewSession::Clicks::Measure)
        parts.emplace_back("Click a point to measure", palette.accent);
    else if (session_->clicks() == ViewSession::Clicks::Annotate)
        parts.emplace_back("Click a point to annotate", palette.accent);
    if (viewer.isOpen()) {
        parts.emplace_back(stateText(), status.detail == Detail::Budget ? palette.problem : palette.ink);
        if (status.detail == Detail::Settled && status.update.drawable && status.levels > 0)
            parts.emplace_back(offText(status.update), palette.dim);
        const uint32_t most = std::max(viewer.mostSamples(), status.samples);
        if (most > 1) parts.emplace_back(fmt::format("Samples {} of {}", status.samples, most), palette.dim);
        if (status.reduction > 1)
            parts.emplace_back(fmt::format("1/{} size while moving", status.reduction), palette.dim);
        if (!status.without.empty()) parts.emplace_back(status.without, palette.dim);
        if (status.levels > 0) parts.emplace_back(formatCount(status.triangles, "triangle"), palette.dim);
        parts.emplace_back(status.name, palette.dim);
    } else {
        parts.emplace_back(session_->opening() ? "Opening" : "Nothing is open", palette.dim);
    }
    const float detailsWide = viewer.isOpen() ? ImGui::CalcTextSize("Details").x + units(16) : 0;
    float room = size_.x - units(16) - detailsWide;
    for (size_t i = 0; i < parts.size(); ++i) {
        const std::string set = typeset(parts[i].first);
        const float wide = ImGui::CalcTextSize(set.c_str()).x;
        if (i > 0 && wide + units(24) > room) break;
        if (i > 0) {
            ImGui::SameLine(0, units(12));
            text(look_->small, palette.line, "|");
            ImGui::SameLine(0, units(12));
        }
        text(look_->small, parts[i].second, i > 0 ? set : fitted(set, room));
        room -= wide + units(i > 0 ? 30 : 0);
    }
    if (viewer.isOpen()) {
        const std::string label = "Details";
        ImGui::SetCursorPos({size_.x - units(8) - ImGui::CalcTextSize(label.c_str()).x, units(5)});
        const ImVec2 at = ImGui::GetCursorScreenPos();
        if (ImGui::InvisibleButton("details", {ImGui::CalcTextSize(label.c_str()).x, units(14)}))
            showsDetails_ = !showsDetails_;
        ImGui::GetWindowDrawList()->AddText(at, ImGui::IsItemHovered() || showsDetails_ ? palette.accent : palette.dim,
                                            label.c_str());
        showTip(*look_, {"What the picture is made of, and what it costs", ""});
    }
    ImGui::PopFont();
    ImGui::End();
    ImGui::PopStyleVar(2);
    if (!showsDetails_ || !viewer.isOpen()) return;
    const float height = std::min(units(400), size_.y - toolbarHeight_ - statusHeight_ - units(16));
    ImGui::SetNextWindowPos({size_.x - panelWidth_ - units(8), size_.y - statusHeight_ - units(8)}, ImGuiCond_Always,
                            {1, 1});
    ImGui::SetNextWindowSizeConstraints({std::min(units(280), size_.x - units(16)), 0},
                                        {std::min(units(280), size_.x - units(16)), height});
    ImGui::PushStyleColor(ImGuiCol_WindowBg, palette.raised);
    ImGui::Begin("details card", nullptr,
                 (kBar & ~(ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoScrollWithMouse)) |
                     ImGuiWindowFlags_AlwaysAutoResize);
    layOutDetails();
    ImGui::End();
    ImGui::PopStyleColor();
}

void Interface::layOutToasts() {
    const float width = std::min(units(kToastWidth), size_.x - panelWidth_ - units(16));
    if (width < units(32)) return;
    float top = toolbarHeight_ + units(16);
    const auto toast = [&](const char* name, const char* sign, ImU32 colour, const std::string& said) {
        ImGui::SetNextWindowPos({0.5f * (size_.x - panelWidth_), top}, ImGuiCond_Always, {0.5f, 0});
        ImGui::SetNextWindowSize({width, 0});
        ImGui::PushStyleColor(ImGuiCol_WindowBg, look_->palette.raised);
        ImGui::PushStyleColor(ImGuiCol_Border, colour);
        ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, units(1));
        ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(units(12), units(8)));
        ImGui::Begin(name, nullptr, kBar | ImGuiWindowFlags_NoFocusOnAppearing);
        ImGui::AlignTextToFramePadding();
        text(look_->body, colour, sign);
        ImGui::SameLine();
        const bool isProblem = sign == icon::kProblem;
        ImGui::PushTextWrapPos(width - units(isProblem ? 44 : 12));
        ImGui::AlignTextToFramePadding();
        text(typeset(said));
        ImGui::PopTextWrapPos();
        if (isProblem) {
            ImGui::SetCursorPos({width - units(36), units(8)});
            if (iconButton(*look_, icon::kClose, "dismiss", {"Dismiss", ""}, false, 24)) session_->dismissProblem();
        }
        top += ImGui::GetWindowSize().y + units(8);
        ImGui::End();
        ImGui::PopStyleVar(2);
        ImGui::PopStyleColor(2);
    };
    if (const std::string problem = session_->problem(); !problem.empty())
        toast("problem", icon::kProblem, look_->palette.problem, problem);
    std::string note = session_->note();
    if (note.empty()) return;
    note.front() = char(std::toupper(uint8_t(note.front())));
    toast("note", icon::kDetails, look_->palette.accent, note);
}

void Interface::toggleHelp() {
    page_ = page_ == Page::Help ? Page::None : Page::Help;
    typed_.clear();
}

void Interface::openFileList() {
    page_ = Page::Files;
    comparesFile_ = false;
    typed_.clear();
    files_.read(files_.folder().empty() ? std::filesystem::path(".") : files_.folder());
}

void Interface::type(uint32_t codepoint) {
    if (codepoint < 0x20 || codepoint == 0x7f || codepoint > 0xffff) return;
    char utf8[4];
    const int bytes = codepoint < 0x80 ? 1 : codepoint < 0x800 ? 2 : 3;
    utf8[0] = char(bytes == 1 ? codepoint : bytes == 2 ? 0xc0 | codepoint >> 6 : 0xe0 | codepoint >> 12);
    for (int i = 1; i < bytes; ++i) utf8[i] = char(0x80 | (codepoint >> (6 * (bytes - 1 - i)) & 0x3f));
    if (std::exchange(isTypedMarked_, false)) typed_.clear();
    typed_.append(utf8, size_t(bytes));
}

void Interface::pasteTyped() {
    std::string pasted = host_.pasteText();
    std::ranges::replace_if(
        pasted, [](char c) { return uint8_t(c) < 0x20 || c == 0x7f; }, ' ');
    if (pasted.empty()) return;
    if (std::exchange(isTypedMarked_, false)) typed_.clear();
    typed_ += pasted;
}

void Interface::eraseTyped() {
    if (std::exchange(isTypedMarked_, false)) return typed_.clear();
    while (!typed_.empty() && (uint8_t(typed_.back()) & 0xc0) == 0x80) typed_.pop_back();
    if (!typed_.empty()) typed_.pop_back();
}

void Interface::copyCamera() {
    host_.copyText(cameraToJson(session_->viewer().camera()));
    session_->note("Camera copied");
}

void Interface::pasteCamera() { session_->pasteCamera(host_.pasteText()); }

void Interface::copyMeasurement() {
    host_.copyText(measurementText(session_->measurement(), session_->unit()));
    session_->note("Measurement copied");
}

}  // namespace vcp
