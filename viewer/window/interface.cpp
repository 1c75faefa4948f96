#include "viewer/window/interface.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <imgui.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "viewer/key_map.h"
#include "viewer/scene/option_values.h"
#include "viewer/scene/render_settings.h"

namespace vcp {

namespace {

constexpr ImGuiWindowFlags kFixed = ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                                    ImGuiWindowFlags_NoSavedSettings;
constexpr ImGuiWindowFlags kBare = kFixed | ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoScrollbar;
// Values are dragged, not typed: keys belong to the window.
constexpr ImGuiSliderFlags kNoTyping = ImGuiSliderFlags_NoInput | ImGuiSliderFlags_AlwaysClamp;
constexpr ImGuiColorEditFlags kColour =
    ImGuiColorEditFlags_NoInputs | ImGuiColorEditFlags_NoOptions | ImGuiColorEditFlags_Float;

constexpr float kPanelWidth = 250, kMargin = 8;
constexpr float kScaleBarLargest = 160;
constexpr size_t kMostBoxes = 2000;
constexpr double kUrgentDoublings = 5;  // doublings of the tolerated error, until a ray that asks is red
constexpr ImU32 kInk = IM_COL32(255, 255, 255, 255), kShade = IM_COL32(0, 0, 0, 160),
                kMeasured = IM_COL32(255, 210, 60, 255);
constexpr ImU32 kHandle = IM_COL32(90, 190, 255, 255), kGripped = IM_COL32(255, 210, 60, 255);

constexpr int kMostPictures = 3600;
constexpr double kPicturesPerSecond = 30;

constexpr const char* kPictureSizeNames[] = {"as shown",    "1920 x 1080",  "3840 x 2160",
                                             "7680 x 4320", "16384 x 9216", "16384 x 16384"};
constexpr glm::ivec2 kPictureSizes[] = {{0, 0},       {1920, 1080},  {3840, 2160},
                                        {7680, 4320}, {16384, 9216}, {16384, 16384}};

ImVec2 vec(glm::vec2 v) { return {v.x, v.y}; }

void text(const std::string& line) { ImGui::TextUnformatted(line.data(), line.data() + line.size()); }

void wrapped(const std::string& line) {
    ImGui::PushTextWrapPos(0);
    text(line);
    ImGui::PopTextWrapPos();
}

/// Draws text on a dark ground: the picture behind may be as light as the text.
void textAt(ImDrawList& list, glm::vec2 at, const std::string& line) {
    const ImVec2 size = ImGui::CalcTextSize(line.data(), line.data() + line.size());
    list.AddRectFilled({at.x - 3, at.y - 1}, {at.x + size.x + 3, at.y + size.y + 1}, kShade, 3);
    list.AddText(vec(at), kInk, line.data(), line.data() + line.size());
}

/// Maps 0 to 1 from blue through green to red, as the false colours (shaders/shade.comp).
ImU32 heatColour(float x, int alpha) {
    const glm::vec3 c =
        255.0f * glm::clamp(glm::vec3(3 * x - 1.2f, 1.5f - std::abs(3 * x - 1.2f), 1.4f - 3 * x), 0.0f, 1.0f);
    return IM_COL32(int(c.x), int(c.y), int(c.z), alpha);
}

/// Draws the part of a line of the world that is before the eye.
void drawSegment(ImDrawList& list, const Viewer& viewer, glm::dvec3 from, glm::dvec3 to, ImU32 colour, float width) {
    const OrbitCamera& camera = viewer.camera();
    const double near = 1e-3 * camera.focusDistance;
    double a = camera.depthOf(from), b = camera.depthOf(to);
    if (a < near && b < near) return;
    if (a < near) from += (to - from) * ((near - a) / (b - a));
    if (b < near) to = from + (to - from) * ((a - near) / (a - b));
    const auto p = camera.pixelOf(from, viewer.size()), q = camera.pixelOf(to, viewer.size());
    if (p && q) list.AddLine(vec(glm::vec2(*p)), vec(glm::vec2(*q)), colour, width);
}

/// Edits a colour: screens show colours encoded, the shading takes them linear.
bool colourEdit(const char* label, glm::vec3& linear) {
    float shown[3];
    for (int i = 0; i < 3; ++i) shown[i] = std::pow(linear[i], 1 / 2.2f);
    if (!ImGui::ColorEdit3(label, shown, kColour)) return false;
    for (int i = 0; i < 3; ++i) linear[i] = std::pow(std::clamp(shown[i], 0.0f, 1.0f), 2.2f);
    return true;
}

/// Returns the largest of 1, 2, 5 times a power of ten that is at most `most`.
double roundLength(double most) {
    const double power = std::pow(10.0, std::floor(std::log10(most)));
    for (const double step : {5.0, 2.0})
        if (step * power <= most) return step * power;
    return power;
}

std::string shortened(const std::string& path, size_t most) {
    return path.size() <= most ? path : "..." + path.substr(path.size() - most);
}

}  // namespace

void Interface::layOut(glm::ivec2 framebuffer, float scale) {
    size_ = framebuffer;
    scale_ = scale;
    statusHeight_ = ImGui::GetFrameHeight();
    panelWidth_ = session_->user().panel ? std::min(kPanelWidth * scale_, 0.5f * size_.x) : 0;
    session_->viewer().setCovered({.right = panelWidth_, .bottom = statusHeight_});
    if (session_->viewer().isOpen()) {
        if (session_->showsPages) drawPages();
        drawScaleBar();
        drawMeasured();
        drawSectionHandles();
        if (session_->showsFeedback()) drawFeedback();
        if (session_->user().panel) layOutPanel();
    } else if (!session_->opening()) {
        layOutStart();
    }
    layOutStatus();
    layOutMessages();
    if (session_->opening())
        layOutOpening();
    else if (const auto saving = session_->saving())
        layOutSaving(*saving);
    if (showsHelp) layOutHelp();
}

void Interface::layOutStatus() {
    ImGui::SetNextWindowPos({0, size_.y - statusHeight_});
    ImGui::SetNextWindowSize({size_.x, statusHeight_});
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(kMargin * scale_, 3 * scale_));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 0.0f);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, ImVec2(1, 1));
    ImGui::SetNextWindowBgAlpha(1);
    ImGui::Begin("status", nullptr, kBare | ImGuiWindowFlags_NoBringToFrontOnFocus);
    const Viewer& viewer = session_->viewer();
    std::string line;
    if (viewer.isFlying()) line += fmt::format("flying, speed {:.2g} | ", viewer.flySpeed());
    if (session_->isMeasuring) line += session_->isPicking() ? "measuring ... | " : "measuring: click | ";
    const std::string hint = "F1 keys  Tab panel";
    const float room = size_.x - ImGui::CalcTextSize(hint.c_str()).x - 5 * kMargin * scale_;
    const auto most = size_t(std::max(0.0f, room / ImGui::CalcTextSize("0").x));
    text(line + statusLine(viewer.status(), most - std::min(most, line.size())));
    ImGui::End();
    ImGui::SetNextWindowPos({size_.x, size_.y - statusHeight_}, ImGuiCond_Always, {1, 0});
    ImGui::SetNextWindowBgAlpha(1);
    ImGui::Begin("hint", nullptr, kBare | ImGuiWindowFlags_AlwaysAutoResize);
    text(hint);
    ImGui::End();
    ImGui::PopStyleVar(3);
}

void Interface::layOutMessages() {
    const std::string problem = session_->problem();
    const std::string& said = problem.empty() ? session_->note() : problem;
    if (said.empty()) return;
    ImGui::SetNextWindowPos({kMargin * scale_, kMargin * scale_});
    ImGui::SetNextWindowSize(
        {size_.x - (2 * kMargin + (session_->user().panel && session_->viewer().isOpen() ? kPanelWidth + kMargin : 0)) *
                       scale_,
         0});
    ImGui::PushStyleColor(ImGuiCol_WindowBg,
                          problem.empty() ? ImVec4(0.1f, 0.2f, 0.3f, 0.9f) : ImVec4(0.45f, 0.08f, 0.05f, 0.95f));
    ImGui::Begin("message", nullptr, kBare);
    if (!problem.empty()) {
        if (ImGui::SmallButton("x")) session_->dismissProblem();
        ImGui::SameLine();
    }
    wrapped(said);
    ImGui::End();
    ImGui::PopStyleColor();
}

void Interface::layOutPanel() {
    ImGui::SetNextWindowPos({size_.x - panelWidth_, 0});
    ImGui::SetNextWindowSize({panelWidth_, size_.y - statusHeight_});
    ImGui::SetNextWindowBgAlpha(0.8f);
    ImGui::Begin("panel", nullptr, kFixed | ImGuiWindowFlags_NoTitleBar);
    ImGui::PushItemWidth(0.5f * panelWidth_);
    if (ImGui::CollapsingHeader("View", ImGuiTreeNodeFlags_DefaultOpen)) layOutViews();
    if (ImGui::CollapsingHeader("Look", ImGuiTreeNodeFlags_DefaultOpen)) layOutLooks();
    if (ImGui::CollapsingHeader("Measure", ImGuiTreeNodeFlags_DefaultOpen)) layOutMeasuring();
    if (ImGui::CollapsingHeader("Streaming", ImGuiTreeNodeFlags_DefaultOpen)) layOutLimits();
    if (ImGui::CollapsingHeader("Picture")) layOutPicture();
    if (ImGui::CollapsingHeader("Recent files")) layOutFiles();
    ImGui::PopItemWidth();
    ImGui::End();
}

void Interface::actionButton(const char* label, ViewerAction action) {
    if (ImGui::Button(label)) session_->act(action);
}

void Interface::layOutViews() {
    Viewer& viewer = session_->viewer();
    actionButton("Fit", ViewerAction::Fit);
    ImGui::SameLine();
    actionButton("Reset", ViewerAction::Reset);
    ImGui::SameLine();
    actionButton(viewer.camera().projection == Projection::Perspective ? "Orthographic" : "Perspective",
                 ViewerAction::ToggleProjection);
    actionButton("Front", ViewerAction::ViewFront);
    ImGui::SameLine();
    actionButton("Right", ViewerAction::ViewRight);
    ImGui::SameLine();
    actionButton("Top", ViewerAction::ViewTop);
    ImGui::SameLine();
    actionButton("Iso", ViewerAction::ViewIsometric);
    actionButton(viewer.camera().up == UpAxis::Y ? "Z up" : "Y up", ViewerAction::ToggleUpAxis);
    ImGui::SameLine();
    actionButton(viewer.isFlying() ? "Stop flying" : "Fly", ViewerAction::ToggleFly);
    ImGui::SameLine();
    if (ImGui::Button("Copy")) copyCamera();
    ImGui::SameLine();
    if (ImGui::Button("Paste")) pasteCamera();
    text("Bookmarks");
    const auto* kept = session_->bookmarks();
    for (int number = 1; kept && number <= int(UserSettings::kMostBookmarks); ++number) {
        if (!kept->contains(number)) continue;
        ImGui::SameLine();
        if (ImGui::SmallButton(std::to_string(number).c_str())) session_->goToBookmark(number);
    }
    int free = 1;
    while (kept && kept->contains(free)) ++free;
    if (free > int(UserSettings::kMostBookmarks)) return;
    ImGui::SameLine();
    if (ImGui::SmallButton("+")) session_->keepBookmark(free);
}

void Interface::layOutLooks() {
    Viewer& viewer = session_->viewer();
    Shading shading = viewer.shading();
    int mode = int(shading.mode);
    if (ImGui::Combo("shading", &mode, kShadingNames.data(), int(kShadingNames.size())))
        shading.mode = static_cast<ShadingMode>(mode);
    // On files that are drawn without shadows, the switch does nothing.
    ImGui::BeginDisabled(!viewer.whyWithout(ViewerAction::ToggleShadows).empty());
    ImGui::Checkbox("shadows", &shading.shadows);
    ImGui::SameLine();
    bool occlusion = shading.occlusionRays > 0;
    if (ImGui::Checkbox("occlusion", &occlusion)) shading.occlusionRays = occlusion ? kUsualOcclusionRays : 0;
    ImGui::EndDisabled();
    colourEdit("above", shading.backgroundTop);
    ImGui::SameLine();
    colourEdit("below", shading.backgroundBottom);
    ImGui::SameLine();
    ImGui::AlignTextToFramePadding();
    text("background");
    if (shading != viewer.shading()) viewer.setShading(shading);
    bool follows = shading.lightFollowsCamera;
    if (ImGui::Checkbox("light follows the camera", &follows)) session_->act(ViewerAction::ToggleLight);
    bool section = !viewer.sections().empty();
    if (ImGui::Checkbox("section", &section)) session_->act(ViewerAction::ToggleSection);
}

void Interface::layOutLimits() {
    Viewer& viewer = session_->viewer();
    const ViewerStatus& status = viewer.status();
    auto error = float(viewer.errorPixels());
    if (ImGui::SliderFloat("error, px", &error, 0.1f, 16.0f, "%.2f", kNoTyping | ImGuiSliderFlags_Logarithmic))
        viewer.setErrorPixels(double(error));
    const UpdateResult& update = status.update;
    const char* const limit = status.detail == Detail::Budget   ? ": the budget is too small for less"
                              : status.detail == Detail::Finest ? ": this is the finest level"
                                                                : "";
    wrapped(fmt::format("error now {} px{}", formatPixels(update.errorPixels), limit));
    const float part = float(update.residentBytes) / float(std::max<uint64_t>(status.budgetBytes, 1));
    const std::string filled =
        fmt::format("{} of {}", formatBytes(update.residentBytes), formatBytes(status.budgetBytes));
    ImGui::ProgressBar(part, ImVec2(-1, 0), filled.c_str());
    uint64_t budget = status.budgetBytes;
    if (ImGui::SmallButton("half the budget")) budget /= 2;
    ImGui::SameLine();
    if (ImGui::SmallButton("double")) budget *= 2;
    if (budget != status.budgetBytes)
        if (const auto set = viewer.setBudget(budget); !set) session_->say(set.error().line());
    wrapped(fmt::format("{} subvolumes drawn, {} in memory", update.pagesInCut, update.pagesResident));
    text(update.settled ? "settled" : fmt::format("loading, {} missing", update.pagesMissing));
    text(fmt::format("{} read", formatBytes(update.bytesRead)));
    ImGui::Checkbox("subvolumes", &session_->showsPages);
    bool feedback = session_->showsFeedback();
    if (ImGui::Checkbox("what rays ask for", &feedback)) session_->showFeedback(feedback);
}

void Interface::layOutMeasuring() {
    ImGui::Checkbox("click measures", &session_->isMeasuring);
    Measurement& measured = session_->measurement();
    if (measured.empty()) return;
    wrapped(measurementText(measured));
    if (ImGui::Button("Copy text")) copyMeasurement();
    ImGui::SameLine();
    if (ImGui::Button("CSV, JSON")) session_->exportMeasurement();
    ImGui::SameLine();
    if (ImGui::Button("Clear")) measured.clear();
}

void Interface::layOutPicture() {
    ImGui::Combo("size", &pictureSize_, kPictureSizeNames, int(std::size(kPictureSizeNames)));
    ImGui::Checkbox("transparent", &picture_.transparent);
    ImGui::SameLine();
    ImGui::Checkbox("depth (.pfm)", &picture_.depth);
    ImGui::BeginDisabled(session_->saving().has_value());
    if (ImGui::Button("Save picture")) savePicture();
    ImGui::SliderInt("pictures", &sequencePictures_, 2, kMostPictures, "%d", kNoTyping | ImGuiSliderFlags_Logarithmic);
    if (ImGui::Button("Turntable")) saveTurntable();
    ImGui::SameLine();
    if (ImGui::Button("Through bookmarks")) savePath();
    ImGui::EndDisabled();
    wrapped(fmt::format("{:.1f} seconds at {} a second", sequencePictures_ / kPicturesPerSecond, kPicturesPerSecond));
}

void Interface::layOutSaving(const ViewSession::SavingProgress& saving) {
    ImGui::SetNextWindowPos({0.5f * size_.x, size_.y - statusHeight_ - 2 * kMargin * scale_}, ImGuiCond_Always,
                            {0.5f, 1});
    ImGui::SetNextWindowSize({std::min(300 * scale_, size_.x), 0});
    ImGui::Begin("saving", nullptr, kBare);
    wrapped(saving.pictures > 1 ? fmt::format("{}: {} of {} pictures", saving.name, saving.finished, saving.pictures)
                                : saving.name);
    const std::string percent = fmt::format("{:.0f} %", 100 * saving.fraction);
    ImGui::ProgressBar(float(saving.fraction), ImVec2(-1, 0), percent.c_str());
    if (ImGui::Button("Cancel (Esc)")) session_->cancelSaving();
    ImGui::End();
}

void Interface::layOutFiles() {
    // The list is copied, since opening a file changes it.
    const std::vector<std::string> recent = session_->user().recent;
    for (const std::string& file : recent) {
        if (ImGui::Selectable(shortened(file, 34).c_str())) session_->open({file});
        if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", file.c_str());
    }
}

void Interface::layOutStart() {
    ImGui::SetNextWindowPos(vec(0.5f * size_), ImGuiCond_Always, {0.5f, 0.5f});
    ImGui::Begin("start", nullptr, kBare | ImGuiWindowFlags_AlwaysAutoResize);
    text("Drop a .vcp file or meshes here.");
    const std::vector<std::string> recent = session_->user().recent;
    if (!recent.empty()) {
        ImGui::Separator();
        text("Recent files");
    }
    for (const std::string& file : recent)
        if (ImGui::Button(shortened(file, 60).c_str(), ImVec2(-1, 0))) session_->open({file});
    ImGui::End();
}

void Interface::layOutOpening() {
    SceneOpening& opening = *session_->opening();
    const SceneOpening::Progress progress = opening.progress();
    ImGui::SetNextWindowPos(vec(0.5f * size_), ImGuiCond_Always, {0.5f, 0.5f});
    ImGui::SetNextWindowSize({std::min(360 * scale_, size_.x), 0});
    ImGui::Begin("opening", nullptr, kBare);
    wrapped(nameOf(opening.inputs()) + (progress.stage.empty() ? ": opening" : ": " + progress.stage));
    const std::string percent = fmt::format("{:.0f} %", 100 * progress.fraction);
    ImGui::ProgressBar(float(progress.fraction), ImVec2(-1, 0), percent.c_str());
    if (progress.triangles > 0) text(formatCount(progress.triangles) + " triangles");
    if (ImGui::Button("Cancel (Esc)")) opening.cancel();
    ImGui::End();
}

void Interface::layOutHelp() {
    ImGui::SetNextWindowPos(vec(0.5f * size_), ImGuiCond_Always, {0.5f, 0.5f});
    ImGui::SetNextWindowBgAlpha(0.97f);
    ImGui::SetNextWindowFocus();
    ImGui::Begin("keys", nullptr, kBare | ImGuiWindowFlags_AlwaysAutoResize);
    text(keyMapText());
    ImGui::End();
}

void Interface::drawScaleBar() const {
    const Viewer& viewer = session_->viewer();
    const double unitsPerPixel = viewer.camera().viewHeight() / std::max(1, viewer.size().y);
    const double length = roundLength(double(kScaleBarLargest * scale_) * unitsPerPixel);
    const auto pixels = float(length / unitsPerPixel);
    if (!std::isfinite(pixels)) return;
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const glm::vec2 from(2 * kMargin * scale_, size_.y - statusHeight_ - 2 * kMargin * scale_);
    for (const auto& [colour, width] : {std::pair(kShade, 4 * scale_), std::pair(kInk, 2 * scale_)}) {
        list.AddLine(vec(from), {from.x + pixels, from.y}, colour, width);
        for (const float x : {from.x, from.x + pixels})
            list.AddLine({x, from.y - 4 * scale_}, {x, from.y + 4 * scale_}, colour, width);
    }
    const bool everywhere = viewer.camera().projection == Projection::Orthographic;
    textAt(list, from + glm::vec2(0, -20 * scale_), formatLength(length) + (everywhere ? "" : " in the middle"));
}

void Interface::drawMeasured() const {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const Viewer& viewer = session_->viewer();
    const auto pixelOf = [&](const MeasuredPoint& p) { return viewer.camera().pixelOf(p.position, viewer.size()); };
    for (const MeasuredLine& line : session_->measurement().lines())
        for (size_t i = 0; i < line.size(); ++i) {
            const auto at = pixelOf(line[i]);
            if (!at) continue;
            const glm::vec2 here(*at);
            list.AddCircleFilled(vec(here), 5 * scale_, kShade);
            list.AddCircleFilled(vec(here), 3.5f * scale_, kMeasured);
            if (i + 1 == line.size()) continue;
            const auto next = pixelOf(line[i + 1]);
            if (!next) continue;
            const glm::vec2 there(*next);
            list.AddLine(vec(here), vec(there), kMeasured, 2 * scale_);
            textAt(list, 0.5f * (here + there) + glm::vec2(6 * scale_, 0), formatLength(segmentLength(line, i)));
        }
}

void Interface::drawSectionHandles() const {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const SectionGrab grab = session_->viewer().sectionGrab();
    for (const SectionHandle& handle : session_->viewer().sectionHandles()) {
        const auto colourOf = [&](SectionGrip part) {
            return grab == SectionGrab{part, handle.plane} ? kGripped : kHandle;
        };
        std::vector<ImVec2> ring;
        for (const glm::dvec2 at : handle.ring) ring.push_back(vec(glm::vec2(at)));
        list.AddPolyline(ring.data(), int(ring.size()), kShade, ImDrawFlags_Closed, 5 * scale_);
        list.AddPolyline(ring.data(), int(ring.size()), colourOf(SectionGrip::Turn), ImDrawFlags_Closed, 2.5f * scale_);
        const glm::vec2 foot(handle.foot), tip(handle.tip);
        const ImU32 colour = colourOf(SectionGrip::Move);
        list.AddCircleFilled(vec(foot), 8 * scale_, kShade);
        list.AddCircleFilled(vec(foot), 6.5f * scale_, colour);
        if (handle.isAlongView) continue;
        const glm::vec2 along = glm::normalize(tip - foot), across(-along.y, along.x);
        const glm::vec2 neck = tip - 12 * scale_ * along;
        list.AddLine(vec(foot), vec(neck), kShade, 5 * scale_);
        list.AddLine(vec(foot), vec(neck), colour, 3 * scale_);
        list.AddTriangleFilled(vec(tip), vec(neck + 6 * scale_ * across), vec(neck - 6 * scale_ * across), colour);
    }
}

void Interface::drawPages() const {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    Viewer& viewer = session_->viewer();
    const std::vector<PageBox> pages = viewer.renderer().residentPages();
    const float finest = float(std::max(1u, viewer.status().levels - 1));
    size_t drawn = 0;
    for (const PageBox& page : pages) {
        if (!page.isDrawn || ++drawn > kMostBoxes) continue;
        const ImU32 colour = heatColour(float(page.level) / finest, 150);
        for (int axis = 0; axis < 3; ++axis)
            for (int side = 0; side < 4; ++side) {
                const glm::dvec3 from = page.corner + page.edges[size_t(axis + 1) % 3] * double(side & 1) +
                                        page.edges[size_t(axis + 2) % 3] * double(side >> 1);
                drawSegment(list, viewer, from, from + page.edges[size_t(axis)], colour, scale_);
            }
    }
    const std::string said =
        fmt::format("{} of {} subvolumes in memory are drawn{}",
                    std::count_if(pages.begin(), pages.end(), [](const PageBox& p) { return p.isDrawn; }), pages.size(),
                    drawn > kMostBoxes ? fmt::format("; the first {} as boxes", kMostBoxes) : "");
    textAt(list, {2 * kMargin * scale_, size_.y - statusHeight_ - 52 * scale_}, said);
}

void Interface::drawFeedback() const {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    Viewer& viewer = session_->viewer();
    const auto& kept = viewer.renderer().feedbackPicture();
    const float cell = 8 * scale_;
    const glm::vec2 size(FeedbackPicture::kWidth * cell, FeedbackPicture::kHeight * cell);
    const glm::vec2 corner(2 * kMargin * scale_, 5 * kMargin * scale_);
    list.AddRectFilled(vec(corner - 4 * scale_), vec(corner + size + glm::vec2(4 * scale_, 22 * scale_)), kShade);
    size_t asking = 0;
    const double tolerated = viewer.errorPixels();
    for (uint32_t i = 0; kept && i < kept->errorPixels.size(); ++i) {
        const double error = kept->errorPixels[i];
        if (error < 0) continue;
        const bool asks = error > tolerated;
        asking += asks ? 1 : 0;
        const glm::vec2 at = corner + cell * glm::vec2(i % FeedbackPicture::kWidth, i / FeedbackPicture::kWidth);
        // Green where the page is fine enough, yellow to red where a finer one is asked for.
        const auto urgency = float(asks ? std::min(std::log2(error / tolerated) / kUrgentDoublings, 1.0) : 0);
        const ImU32 colour = asks ? IM_COL32(255, int(210 * (1 - urgency)), 40, 255) : IM_COL32(70, 150, 90, 255);
        list.AddRectFilled(vec(at), vec(at + cell - scale_), colour);
    }
    const std::string said =
        kept ? fmt::format("{} of {} rays asked", asking, kept->errorPixels.size()) : "nothing is missing";
    textAt(list, corner + glm::vec2(0, size.y + 3 * scale_), said);
}

void Interface::copyCamera() {
    host_.copyText(cameraToJson(session_->viewer().camera()));
    session_->note("camera copied");
}

void Interface::pasteCamera() { session_->pasteCamera(host_.pasteText()); }

void Interface::copyMeasurement() {
    host_.copyText(measurementText(session_->measurement()));
    session_->note("measurement copied");
}

PictureChoice Interface::pictureChosen() const {
    PictureChoice choice = picture_;
    choice.size = pictureSize_ == 0 ? session_->viewer().size() : kPictureSizes[pictureSize_];
    return choice;
}

void Interface::savePicture() { session_->savePicture(pictureChosen()); }

void Interface::saveTurntable() { session_->saveTurntable(pictureChosen(), sequencePictures_); }

void Interface::savePath() { session_->savePath(pictureChosen(), sequencePictures_); }

}  // namespace vcp
