// What covers the picture for a while: welcome page, file list, keys, progress of opening and saving.
#include <algorithm>
#include <filesystem>

#include <fmt/format.h>
#include <imgui.h>

#include "viewer/key_map.h"
#include "viewer/scene/inputs.h"
#include "viewer/scene/option_values.h"
#include "viewer/window/demo_mesh.h"
#include "viewer/window/icons.h"
#include "viewer/window/interface.h"

namespace vcp {

namespace {

namespace fs = std::filesystem;

constexpr ImGuiWindowFlags kCard = ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoTitleBar;
constexpr float kPointHeight = 184;
constexpr float kHelpWidth = 880, kHelpHeight = 800, kTwoColumns = 640, kKeysWidth = 152;
constexpr float kFilesWidth = 560, kFilesHeight = 520;
constexpr float kWelcomeWidth = 640, kRecentWidth = 136, kRecentHeight = 85;
constexpr size_t kMostRecentShown = 8;

}  // namespace

bool Interface::beginCard(const char* name, float width, float height) {
    const glm::vec2 margin(units(16)), room = size_ - 2.0f * margin;
    const float wide = std::min(units(width), room.x);
    ImGui::SetNextWindowPos(vec(0.5f * size_), ImGuiCond_Always, {0.5f, 0.5f});
    if (height > 0)
        ImGui::SetNextWindowSize({wide, std::min(units(height), room.y)});
    else
        ImGui::SetNextWindowSizeConstraints({wide, 0}, {wide, room.y});
    ImGui::PushStyleColor(ImGuiCol_WindowBg, look_->palette.raised);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(units(24), units(24)));
    return ImGui::Begin(name, nullptr, kCard | (height > 0 ? 0 : ImGuiWindowFlags_AlwaysAutoResize));
}

void Interface::endCard() {
    ImGui::End();
    ImGui::PopStyleVar();
    ImGui::PopStyleColor();
}

void Interface::layOutPage(const char* title, const char* hint, float width, float height,
                           void (Interface::*layOutRest)()) {
    ImGui::SetNextWindowPos({0, 0});
    ImGui::SetNextWindowSize(vec(size_));
    ImGui::SetNextWindowFocus();
    ImGui::PushStyleColor(ImGuiCol_WindowBg, IM_COL32(0, 0, 0, 120));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0.0f);
    ImGui::Begin("backdrop", nullptr, kCard | ImGuiWindowFlags_NoScrollbar);
    if (ImGui::IsWindowHovered() && ImGui::IsMouseClicked(0)) closePage();
    ImGui::End();
    ImGui::PopStyleVar();
    ImGui::PopStyleColor();
    ImGui::SetNextWindowFocus();
    beginCard(title, width, height);
    const float right = ImGui::GetCursorPosX() + ImGui::GetContentRegionAvail().x, top = ImGui::GetCursorPosY();
    ImGui::AlignTextToFramePadding();
    text(look_->strong, look_->palette.ink, title);
    ImGui::SetCursorPos({right - units(24), top});
    if (iconButton(*look_, icon::kClose, "close", {"Close", "Esc"}, false, 24)) closePage();
    typedField(*look_, page_ == Page::Point ? icon::kEdit : icon::kSearch, typed_, isTypedMarked_, hint);
    ImGui::BeginChild("rest", {0, 0});
    (this->*layOutRest)();
    ImGui::EndChild();
    endCard();
}

void Interface::layOutKeys() {
    const float width = ImGui::GetContentRegionAvail().x;
    const bool isWide = width >= units(kTwoColumns);
    const float column = isWide ? (width - units(32)) / 2 : width;
    const auto isShown = [&](const KeyHelp& each) { return holds(fmt::format("{} {}", each.keys, each.does), typed_); };
    const auto keys = keyMap();
    const auto isGroupShown = [&](KeyGroup group) {
        return std::ranges::any_of(keys, [&](const KeyHelp& each) { return each.group == group && isShown(each); });
    };
    const auto layOutGroup = [&](KeyGroup group) {
        const auto belongs = [&](const KeyHelp& each) { return each.group == group && isShown(each); };
        if (!isGroupShown(group)) return;
        text(look_->strong, look_->palette.accent, nameOf(group));
        const float left = ImGui::GetCursorPosX();
        const float keysWide = std::min(units(kKeysWidth), 0.4f * column);
        for (const KeyHelp& each : keys) {
            if (!belongs(each)) continue;
            ImGui::BeginGroup();
            ImGui::PushTextWrapPos(left + keysWide);
            text(look_->body, look_->palette.ink, each.keys);
            ImGui::PopTextWrapPos();
            ImGui::EndGroup();
            ImGui::SameLine();
            ImGui::SetCursorPosX(left + keysWide + units(16));
            ImGui::PushTextWrapPos(left + column);
            text(look_->body, look_->palette.dim, each.does);
            ImGui::PopTextWrapPos();
        }
        ImGui::Dummy({0, units(8)});
    };
    const auto layOutColumn = [&](std::span<const KeyGroup> groups) {
        ImGui::BeginGroup();
        for (const KeyGroup group : groups) layOutGroup(group);
        ImGui::EndGroup();
    };
    static constexpr KeyGroup kLeft[] = {KeyGroup::Mouse, KeyGroup::View, KeyGroup::Window};
    static constexpr KeyGroup kRight[] = {KeyGroup::Look, KeyGroup::Measure, KeyGroup::Save};
    const float from = ImGui::GetCursorPosX();
    layOutColumn(kLeft);
    if (isWide && std::ranges::any_of(kLeft, isGroupShown)) {
        ImGui::SameLine();
        ImGui::SetCursorPosX(from + column + units(32));
    }
    layOutColumn(kRight);
    if (std::none_of(keys.begin(), keys.end(), isShown)) text(look_->body, look_->palette.dim, "No key does that");
}

void Interface::layOutHelp() {
    layOutPage("Keys and mouse", "Type to search", kHelpWidth, kHelpHeight, &Interface::layOutKeys);
}

void Interface::layOutFolder() {
    const fs::path folder = files_.folder();
    if (iconButton(*look_, icon::kUp, "up", {"The folder above", ""}, false, 24)) files_.read(folder.parent_path());
    ImGui::SameLine();
    ImGui::AlignTextToFramePadding();
    text(look_->body, look_->palette.dim, fittedEnd(folder.string(), ImGui::GetContentRegionAvail().x));
    if (!files_.problem().empty()) text(look_->body, look_->palette.problem, files_.problem());
    ImGui::BeginChild("entries", {0, 0});
    const std::vector<FileList::Entry> entries = files_.holding(typed_);
    for (const FileList::Entry& entry : entries) {
        const float left = ImGui::GetCursorPosX(), right = left + ImGui::GetContentRegionAvail().x;
        if (ImGui::Selectable(("##" + entry.name).c_str(), false, 0, {0, units(24)})) enter(entry);
        ImGui::SameLine(left + units(4));
        ImGui::AlignTextToFramePadding();
        text(look_->body, entry.isFolder ? look_->palette.dim : look_->palette.accent,
             entry.isFolder ? icon::kFolder : icon::kFile);
        ImGui::SameLine(left + units(32));
        const std::string bytes = entry.bytes == 0 ? "" : typeset(formatBytes(entry.bytes));
        const float wide = ImGui::CalcTextSize(bytes.c_str()).x;
        text(fitted(entry.name, right - left - units(48) - wide));
        ImGui::SameLine(right - wide - units(4));
        text(look_->body, look_->palette.dim, bytes);
    }
    if (entries.empty() && files_.problem().empty())
        text(look_->body, look_->palette.dim, typed_.empty() ? "Nothing here can be opened" : "Nothing is called so");
    ImGui::EndChild();
}

void Interface::enter(const FileList::Entry& entry) {
    const fs::path path = files_.folder() / entry.name;
    typed_.clear();
    if (entry.isFolder) return files_.read(path);
    closePage();
    if (comparesFile_) return session_->compareWithFile(comparesDataset_, path.string());
    host_.open({path.string()});
}

void Interface::openPoint(size_t index) {
    page_ = Page::Point;
    point_ = index;
    writesText_ = false;
    typed_ = session_->points()[index].title;
}

void Interface::openPointAt(glm::dvec2 pixel) {
    if (!session_->viewer().isOpen()) return;
    if (const auto under = annotationAt(session_->points(), annotatedView(), pixel)) openPoint(*under);
}

void Interface::writePoint() {
    if (point_ >= session_->points().size()) return;
    Annotation point = session_->points()[point_];
    (writesText_ ? point.text : point.title) = typed_;
    if (point != session_->points()[point_]) session_->changePoint(point_, point.title, point.text);
}

void Interface::layOutPoint() {
    if (point_ >= session_->points().size()) return closePage();
    while (typed_.size() > (writesText_ ? kLongestText : kLongestTitle)) eraseTyped();
    writePoint();
    layOutPage("Annotation", writesText_ ? "Its text, for who points at it" : "Its title, over the picture",
               kFilesWidth, kPointHeight, &Interface::layOutPointRest);
}

void Interface::layOutPointRest() {
    static constexpr const char* kParts[] = {"Title", "Text"};
    int part = writesText_ ? 1 : 0;
    if (choiceRow(*look_, "part", kParts, part, {"What is written", "Enter"})) {
        writesText_ = part == 1;
        isTypedMarked_ = false;
        typed_ = writesText_ ? session_->points()[point_].text : session_->points()[point_].title;
    }
    const float half = (ImGui::GetContentRegionAvail().x - units(8)) / 2;
    if (textButton(*look_, icon::kDelete, "Remove", {"Remove the annotation", ""}, half)) {
        session_->removePoint(point_);
        return closePage();
    }
    ImGui::SameLine(0, units(8));
    if (textButton(*look_, nullptr, "Done", {"", "Esc"}, half)) closePage();
}

void Interface::enterTyped() {
    isTypedMarked_ = false;
    if (page_ == Page::Point && !writesText_) {
        writesText_ = true;
        typed_ = session_->points()[point_].text;
        return;
    }
    if (page_ == Page::Point) return closePage();
    if (page_ != Page::Files) return;
    const std::vector<FileList::Entry> entries = files_.holding(typed_);
    if (!entries.empty()) enter(entries.front());
}

void Interface::layOutFiles() {
    layOutPage(comparesFile_ ? "Compare with a file" : "Open a file", "Type to search this folder", kFilesWidth,
               kFilesHeight, &Interface::layOutFolder);
}

void Interface::openDemo() {
    const auto demo = demoMesh();
    if (!demo) return session_->say(demo.error().line());
    host_.open({demo->string()});
}

void Interface::layOutWelcome() {
    ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, ImVec2(units(8), units(8)));
    beginCard("welcome", kWelcomeWidth, 0);
    const float width = ImGui::GetContentRegionAvail().x;
    text(look_->title, look_->palette.ink, "vcp");
    ImGui::PushStyleColor(ImGuiCol_Text, look_->palette.dim);
    wrapped("Looks at scans of any size. Open a mesh or a .vcp file, or drop it here.");
    ImGui::PopStyleColor();
    ImGui::Dummy({0, units(4)});
    const bool isNarrow = width < units(320);
    if (textButton(*look_, icon::kOpen, "Open a file\u2026", {"", "Ctrl+O"}, isNarrow ? -1 : 0, true)) openFileList();
    if (!isNarrow) ImGui::SameLine();
    ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, ImVec2(units(16), units(8)));
    if (ImGui::Button((std::string(icon::kDemo) + "  Open the demo").c_str(), {isNarrow ? -1.0f : 0.0f, units(32)}))
        openDemo();
    ImGui::PopStyleVar();
    showTip(*look_, {"A knot of 442 thousand triangles, made here", ""});
    if (!session_->user().recent.empty()) {
        ImGui::Dummy({0, units(8)});
        text(look_->strong, look_->palette.ink, "Recent");
        const size_t columns = std::max<size_t>(1, size_t((width + units(8)) / units(kRecentWidth + 8)));
        layOutRecent((width - units(8) * float(columns - 1)) / float(columns), columns);
    }
    endCard();
    ImGui::PopStyleVar();
}

void Interface::layOutRecent(float width, size_t columns) {
    // The list is copied, since opening a file changes it.
    const std::vector<std::string> recent = session_->user().recent;
    const float height = width * kRecentHeight / kRecentWidth;
    const Palette& palette = look_->palette;
    for (size_t i = 0; i < std::min(recent.size(), kMostRecentShown); ++i) {
        if (i % columns != 0) ImGui::SameLine();
        ImGui::PushID(int(i));
        ImGui::BeginGroup();
        const ImVec2 from = ImGui::GetCursorScreenPos(), to(from.x + width, from.y + height);
        if (ImGui::InvisibleButton("recent", {width, height + units(24)})) host_.open({recent[i]});
        const bool isHovered = ImGui::IsItemHovered();
        showTip(*look_, {recent[i].c_str(), ""});
        ImDrawList& list = *ImGui::GetWindowDrawList();
        const auto thumbnail = host_.thumbnails.find(recent[i]);
        if (thumbnail != host_.thumbnails.end() && thumbnail->second < look_->pictures.size()) {
            const Look::Texture& texture = look_->pictures[thumbnail->second];
            list.AddImageRounded(ImGui::GetIO().Fonts->TexID, from, to, texture.from, texture.to, IM_COL32_WHITE,
                                 units(6));
        } else {
            list.AddRectFilled(from, to, palette.control, units(6));
            const ImVec2 size = ImGui::CalcTextSize(icon::kFile);
            list.AddText({0.5f * (from.x + to.x - size.x), 0.5f * (from.y + to.y - size.y)}, palette.dim, icon::kFile);
        }
        if (isHovered) list.AddRect(from, to, palette.accent, units(6), 0, units(2));
        const std::string name = fitted(shownName(recent[i]), width);
        list.AddText({from.x, to.y + units(4)}, isHovered ? palette.accent : palette.ink, name.c_str());
        ImGui::EndGroup();
        ImGui::PopID();
    }
}

bool Interface::beginNote(const char* name) {
    const float width = std::min(units(256), size_.x - panelWidth_ - units(32));
    if (width < units(32)) return false;
    ImGui::SetNextWindowPos({size_.x - panelWidth_ - units(16), size_.y - statusHeight_ - units(16)}, ImGuiCond_Always,
                            {1, 1});
    ImGui::SetNextWindowSizeConstraints({width, 0}, {width, size_.y});
    ImGui::PushStyleColor(ImGuiCol_WindowBg, look_->palette.raised);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(units(16), units(16)));
    ImGui::Begin(name, nullptr, kCard | ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_AlwaysAutoResize);
    return true;
}

void Interface::layOutOpening() {
    SceneOpening& opening = *session_->opening();
    const SceneOpening::Progress progress = opening.progress();
    // What is seen of the mesh is not covered.
    if (session_->preview() == nullptr)
        beginCard("opening", 360, 0);
    else if (!beginNote("opening a mesh"))
        return;
    const float width = ImGui::GetContentRegionAvail().x;
    text(look_->strong, look_->palette.ink, fitted(nameOf(opening.inputs()), width));
    const std::string stage = progress.stage.empty() ? "opening" : progress.stage;
    valueRow(*look_, fitted(stage, 0.5f * width).c_str(), fmt::format("{:.0f} %", 100 * progress.fraction));
    progressBar(*look_, progress.fraction);
    if (progress.triangles > 0) valueRow(*look_, "Triangles", formatCount(progress.triangles));
    if (const auto left = secondsLeft(progress.seconds, progress.fraction, progress.begun))
        valueRow(*look_, "Time left", formatTimeLeft(*left));
    if (textButton(*look_, icon::kClose, "Cancel", {"", "Esc"})) opening.cancel();
    endCard();
}

void Interface::layOutSaving(const ViewSession::SavingProgress& saving) {
    if (!beginNote("saving")) return;
    const float width = ImGui::GetContentRegionAvail().x;
    const std::string count =
        saving.pictures > 1 ? fmt::format("{} of {} pictures", saving.finished, saving.pictures) : std::string();
    const std::string what = saving.name.empty() ? "Comparing" : "Saving " + saving.name;
    valueRow(*look_, fitted(what, 0.5f * width).c_str(),
             count.empty() ? fmt::format("{:.0f} %", 100 * saving.fraction) : count);
    progressBar(*look_, saving.fraction);
    if (textButton(*look_, icon::kClose, "Cancel", {"", "Esc"})) session_->cancelSaving();
    endCard();
}

}  // namespace vcp
