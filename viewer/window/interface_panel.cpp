// The panel at the right: what can be chosen, section by section.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include <fmt/format.h>
#include <imgui.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "viewer/scene/option_values.h"
#include "viewer/scene/render_settings.h"
#include "viewer/window/icons.h"
#include "viewer/window/interface.h"

namespace vcp {

namespace {

constexpr ImGuiWindowFlags kPanel = ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                                    ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoTitleBar;
// Values are dragged, not typed: keys belong to the window.
constexpr ImGuiSliderFlags kNoTyping = ImGuiSliderFlags_NoInput | ImGuiSliderFlags_AlwaysClamp;
constexpr ImGuiColorEditFlags kColour =
    ImGuiColorEditFlags_NoInputs | ImGuiColorEditFlags_NoOptions | ImGuiColorEditFlags_Float;

constexpr int kMostPictures = 3600;
constexpr double kPicturesPerSecond = 30;

constexpr const char* kPictureSizeNames[] = {"As shown",    "1920 × 1080",  "3840 × 2160",
                                             "7680 × 4320", "16384 × 9216", "16384 × 16384"};
constexpr glm::ivec2 kPictureSizes[] = {{0, 0},       {1920, 1080},  {3840, 2160},
                                        {7680, 4320}, {16384, 9216}, {16384, 16384}};

/// Edits a colour: screens show colours encoded, the shading takes them linear.
bool colourEdit(const char* label, glm::vec3& linear) {
    float shown[3];
    for (int i = 0; i < 3; ++i) shown[i] = std::pow(linear[i], 1 / 2.2f);
    if (!ImGui::ColorEdit3(label, shown, kColour)) return false;
    for (int i = 0; i < 3; ++i) linear[i] = std::pow(std::clamp(shown[i], 0.0f, 1.0f), 2.2f);
    return true;
}

/// Returns the axis that a plane's normal is along; 3: none.
int axisOf(const SectionPlane& plane) {
    const glm::dvec3 normal = glm::abs(glm::normalize(plane.normal));
    for (int axis = 0; axis < 3; ++axis)
        if (normal[axis] > 1 - 1e-9) return axis;
    return 3;
}

}  // namespace

void Interface::layOutPanel() {
    ImGui::SetNextWindowPos({size_.x - panelWidth_, toolbarHeight_});
    ImGui::SetNextWindowSize({panelWidth_, size_.y - statusHeight_ - toolbarHeight_});
    ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0.0f);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(units(16), units(8)));
    ImGui::Begin("panel", nullptr, kPanel | ImGuiWindowFlags_NoBringToFrontOnFocus);
    ImGui::PopStyleVar(2);
    ImGui::GetWindowDrawList()->AddLine({size_.x - panelWidth_ + 0.5f, toolbarHeight_},
                                        {size_.x - panelWidth_ + 0.5f, size_.y - statusHeight_}, look_->palette.line,
                                        units(1));
    const bool begins = session_->comparison() && !wasCompared_;
    wasCompared_ = session_->comparison() != nullptr;
    const auto section = [&](const char* sign, const char* name, bool isOpenAtFirst, void (Interface::*layOutRest)()) {
        ImGui::PushID(name);
        // What has just been compared is to be seen.
        if (begins && layOutRest == &Interface::layOutCompare) {
            ImGui::GetStateStorage()->SetBool(ImGui::GetID(name), true);
            ImGui::SetScrollHereY(0);
        }
        if (sectionHead(*look_, sign, name, isOpenAtFirst)) {
            (this->*layOutRest)();
            ImGui::Dummy({0, units(4)});
        }
        const float y = ImGui::GetCursorScreenPos().y;
        ImGui::GetWindowDrawList()->AddLine({size_.x - panelWidth_, y}, {size_.x, y}, look_->palette.line, units(1));
        ImGui::Dummy({0, 0});
        ImGui::PopID();
    };
    section(icon::kView, "View", true, &Interface::layOutView);
    section(icon::kLight, "Light", true, &Interface::layOutLight);
    section(icon::kCut, "Cut", true, &Interface::layOutCut);
    section(icon::kMeasure, "Measure", true, &Interface::layOutMeasuring);
    section(icon::kAnnotate, "Annotate", false, &Interface::layOutPoints);
    section(icon::kCompare, "Compare", false, &Interface::layOutCompare);
    section(icon::kLayers, "Layers", false, &Interface::layOutLayers);
    section(icon::kPicture, "Save", false, &Interface::layOutSave);
    section(icon::kDetails, "Details", false, &Interface::layOutLimits);
    ImGui::End();
}

void Interface::actionButton(const char* label, ViewerAction action, const Tip& tip, float width) {
    if (textButton(*look_, nullptr, label, tip, width)) session_->act(action);
}

void Interface::layOutView() {
    const OrbitCamera& camera = session_->viewer().camera();
    const float gap = units(8), quarter = (ImGui::GetContentRegionAvail().x - 3 * gap) / 4;
    actionButton("Front", ViewerAction::ViewFront, {"From the front", "1"}, quarter);
    ImGui::SameLine(0, gap);
    actionButton("Right", ViewerAction::ViewRight, {"From the right", "3"}, quarter);
    ImGui::SameLine(0, gap);
    actionButton("Top", ViewerAction::ViewTop, {"From above", "7"}, quarter);
    ImGui::SameLine(0, gap);
    actionButton("Iso", ViewerAction::ViewIsometric, {"Isometric", "9"}, quarter);
    static constexpr const char* kProjections[] = {"Perspective", "Parallel"};
    int projection = camera.projection == Projection::Perspective ? 0 : 1;
    if (choiceRow(*look_, "projection", kProjections, projection,
                  {"Perspective, or parallel for measuring by eye", "P"}))
        session_->act(ViewerAction::ToggleProjection);
    static constexpr const char* kAxes[] = {"Y is up", "Z is up"};
    int up = camera.up == UpAxis::Y ? 0 : 1;
    if (choiceRow(*look_, "up", kAxes, up, {"The axis that points up", "U"})) session_->act(ViewerAction::ToggleUpAxis);
    if (const SurfaceMotion& motion = session_->viewer().motion(); motion.isThere())
        actionButton(motion.isPlaying() ? "Pause" : "Play", ViewerAction::TogglePlay,
                     {"What moves in the scene goes on, or stays", "Space"}, ImGui::GetContentRegionAvail().x);
    layOutBookmarks();
    caption(*look_, "Theme");
    static constexpr const char* kThemes[] = {"System", "Light", "Dark"};
    int theme = int(session_->user().theme);
    if (choiceRow(*look_, "theme", kThemes, theme, {"Light or dark, or as the desktop says", ""}))
        session_->setTheme(static_cast<ThemeChoice>(theme));
}

void Interface::layOutBookmarks() {
    caption(*look_, "Bookmarks");
    const auto* kept = session_->bookmarks();
    const float side = units(24), left = ImGui::GetCursorPosX(), right = left + ImGui::GetContentRegionAvail().x;
    bool isFirst = true;
    // A row is full where the next button would not fit beside the ones that edit.
    const auto nextButton = [&] {
        if (!isFirst) ImGui::SameLine(0, units(4));
        if (ImGui::GetCursorPosX() + side > right - 2 * side - units(16)) ImGui::NewLine();
        isFirst = false;
    };
    int free = 1;
    while (kept && kept->contains(free)) ++free;
    for (int number = 1; kept && number <= int(UserSettings::kMostBookmarks); ++number) {
        if (!kept->contains(number)) continue;
        nextButton();
        const std::string name = std::to_string(number), keys = "Shift+" + name;
        if (textButton(*look_, nullptr, name.c_str(), {"Go to this bookmark", keys.c_str()}, side))
            session_->goToBookmark(number);
    }
    if (free <= int(UserSettings::kMostBookmarks)) {
        nextButton();
        const std::string keys = fmt::format("Ctrl+{}", free);
        if (iconButton(*look_, icon::kAdd, "keep", {"Keep this view as a bookmark", keys.c_str()}, false, 24))
            session_->keepBookmark(free);
    }
    ImGui::SameLine(right - 2 * side);
    if (iconButton(*look_, icon::kCopy, "copy camera", {"Copy the camera as JSON", "Ctrl+C"}, false, 24)) copyCamera();
    ImGui::SameLine(0, 0);
    if (iconButton(*look_, icon::kPaste, "paste camera", {"Go to the copied camera", "Ctrl+V"}, false, 24))
        pasteCamera();
}

void Interface::layOutLight() {
    Viewer& viewer = session_->viewer();
    Shading shading = viewer.shading();
    int mode = int(shading.mode);
    static constexpr const char* kNames[] = {"Lit",
                                             "Clay",
                                             "Unlit colours",
                                             "Normals",
                                             "Work: steps of rays",
                                             "Work: cells",
                                             "Work: reads of memory",
                                             "Level of detail",
                                             "Error",
                                             "Wireframe"};
    static_assert(std::size(kNames) == kShadingNames.size());
    if (comboRow(*look_, "##shading", kNames, mode, {"What colours show", "M"}))
        shading.mode = static_cast<ShadingMode>(mode);
    if (viewer.hasChannels())
        switchRow(*look_, "Materials", shading.channels, {"Their normals, roughness, metalness and emission", ""});
    // On files that are drawn without shadows, the switch does nothing.
    ImGui::BeginDisabled(!viewer.whyWithout(ViewerAction::ToggleShadows).empty());
    switchRow(*look_, "Shadows", shading.shadows, {"Light is cast from one side", "S"});
    ImGui::EndDisabled();
    ImGui::BeginDisabled(!viewer.whyWithout(ViewerAction::ToggleOcclusion).empty());
    bool occlusion = shading.occlusionRays > 0;
    if (switchRow(*look_, "Ambient occlusion", occlusion, {"Corners and folds are darker", "O"}))
        shading.occlusionRays = occlusion ? kUsualOcclusionRays : 0;
    ImGui::EndDisabled();
    bool follows = shading.lightFollowsCamera;
    const bool isTurned =
        switchRow(*look_, "Light follows the camera", follows, {"Ctrl + left drag turns the light", "L"});
    if (shading != viewer.shading()) viewer.setShading(shading);
    layOutSurroundings();
    shading = viewer.shading();
    ImGui::AlignTextToFramePadding();
    text("Background");
    ImGui::SameLine(ImGui::GetCursorPosX() + ImGui::GetContentRegionAvail().x - units(56));
    colourEdit("##above", shading.backgroundTop);
    showTip(*look_, {"Above", ""});
    ImGui::SameLine();
    colourEdit("##below", shading.backgroundBottom);
    showTip(*look_, {"Below", ""});
    if (shading != viewer.shading()) viewer.setShading(shading);
    if (isTurned) session_->act(ViewerAction::ToggleLight);
}

void Interface::layOutSurroundings() {
    static constexpr const char* kNames[] = {"No surroundings", "Studio", "Overcast sky", "Clear sky"};
    static_assert(std::size(kNames) == kEnvironmentNames.size() + 1);
    std::vector<const char*> names(std::begin(kNames), std::end(kNames));
    const EnvironmentChoice own{session_->surroundings()};
    const std::string dropped = session_->surroundingsFile();
    const std::string file = std::filesystem::path(dropped).filename().string();
    if (!dropped.empty()) names.push_back(file.c_str());
    int chosen = own.source.empty() ? 0 : int(names.size()) - 1;
    if (!own.source.empty() && !own.isFile())
        chosen = int(std::ranges::find(kEnvironmentNames, own.source) - kEnvironmentNames.begin()) + 1;
    const Tip tip{"Light from all around; drop a picture of surroundings (.hdr, .exr) onto the window for its light",
                  ""};
    if (comboRow(*look_, "##surroundings", names, chosen, tip))
        session_->surround(chosen == 0                        ? ""
                           : chosen == int(std::size(kNames)) ? dropped
                                                              : kEnvironmentNames[size_t(chosen) - 1]);
    Shading shading = session_->viewer().shading();
    if (!shading.environment) return;
    // From -180 to 180.
    float turn = std::remainder(shading.environment->turn, 360.0f);
    ImGui::SetNextItemWidth(-1);
    if (ImGui::SliderFloat("##turn", &turn, -180, 180, "turned by %.0f\xc2\xb0", kNoTyping)) {
        shading.environment->turn = turn;
        session_->viewer().setShading(shading);
    }
    showTip(*look_, {"Turns the surroundings, as Ctrl + left drag does", ""});
}

void Interface::layOutCut() {
    Viewer& viewer = session_->viewer();
    bool isCut = !viewer.sections().empty();
    if (switchRow(*look_, "Cut open", isCut, {"Cut with a plane through the middle", "X"}))
        session_->act(ViewerAction::ToggleSection);
    if (!isCut) return;
    static constexpr const char* kCaps[] = {"Hollow", "Closed", "All"};
    int caps = int(viewer.sectionCaps());
    if (choiceRow(*look_, "caps", kCaps, caps, {"Fill nothing, closed parts, or all as if it were closed", ""}))
        viewer.setSectionCaps(Caps(caps));
    if (viewer.sections().size() != 1) return;
    const SectionPlane plane = viewer.sections().front();
    static constexpr const char* kAxes[] = {"X", "Y", "Z"};
    int axis = axisOf(plane);
    if (choiceRow(*look_, "axis", kAxes, axis, {"Cut across an axis, through the middle", ""})) {
        glm::dvec3 normal(0);
        normal[axis] = 1;
        viewer.setSections({{normal, glm::dot(normal, viewer.bounds().centre())}});
    }
    if (textButton(*look_, icon::kFlip, "Keep the other side")) viewer.setSections({{-plane.normal, -plane.offset}});
    ImGui::BeginDisabled(session_->saving().has_value());
    const float half = (ImGui::GetContentRegionAvail().x - units(8)) / 2;
    if (textButton(*look_, icon::kExport, "SVG", {"Write the cut's lines as a drawing, cut-1.svg", ""}, half))
        session_->saveCut(".svg");
    ImGui::SameLine();
    if (textButton(*look_, icon::kExport, "DXF", {"Write the cut's lines for CAD, cut-1.dxf", ""}, half))
        session_->saveCut(".dxf");
    ImGui::EndDisabled();
    ImGui::PushStyleColor(ImGuiCol_Text, look_->palette.dim);
    wrapped("Drag the arrow to move the plane, its ring to turn it; Shift + wheel moves it too.");
    ImGui::PopStyleColor();
}

void Interface::layOutMeasuring() {
    bool measures = session_->clicks() == ViewSession::Clicks::Measure;
    if (switchRow(*look_, "Click measures", measures, {"Click points on the surface", "D"}))
        session_->toggleClicks(ViewSession::Clicks::Measure);
    Measurement& measured = session_->measurement();
    if (measured.empty()) {
        if (!measures) return;
        ImGui::PushStyleColor(ImGuiCol_Text, look_->palette.dim);
        wrapped("Click points on the surface. Enter ends a line, Backspace takes a point back.");
        ImGui::PopStyleColor();
        return;
    }
    for (size_t number = 0; number < measured.lines().size(); ++number) layOutMeasuredLine(number);
    if (textButton(*look_, icon::kCopy, "Copy", {"Copy what is measured as text", ""})) copyMeasurement();
    ImGui::SameLine();
    if (textButton(*look_, icon::kExport, "Export", {"Write measurement-1.csv and .json", "Ctrl+E"}))
        session_->exportMeasurement();
    ImGui::SameLine();
    if (textButton(*look_, icon::kDelete, "Clear")) measured.clear();
}

void Interface::layOutPoints() {
    bool annotates = session_->clicks() == ViewSession::Clicks::Annotate;
    if (switchRow(*look_, "Click annotates", annotates, {"Click a point on the surface, then write", "N"}))
        session_->toggleClicks(ViewSession::Clicks::Annotate);
    const float right = ImGui::GetCursorPosX() + ImGui::GetContentRegionAvail().x;
    std::optional<size_t> removed;
    for (size_t i = 0; i < session_->points().size(); ++i) {
        const Annotation& point = session_->points()[i];
        ImGui::PushID(int(i));
        const float left = ImGui::GetCursorPosX(), room = right - left - units(56);
        if (ImGui::Selectable("##go", false, 0, {room, units(24)})) session_->goToPoint(i);
        // What does not fit stands in the tip.
        const std::string title = fitted(point.title, room);
        std::string tip = title == point.title ? point.text : point.title;
        if (title != point.title && !point.text.empty()) tip += "\n" + point.text;
        showTip(*look_, {tip.empty() ? "Go there" : tip.c_str(), ""});
        ImGui::SameLine(left);
        ImGui::AlignTextToFramePadding();
        text(title);
        ImGui::SameLine(right - units(48));
        if (iconButton(*look_, icon::kEdit, "edit", {"Change title and text", ""}, false, 24)) openPoint(i);
        ImGui::SameLine(0, 0);
        if (iconButton(*look_, icon::kDelete, "remove", {"Remove it", ""}, false, 24)) removed = i;
        ImGui::PopID();
    }
    if (removed) session_->removePoint(*removed);
    if (textButton(*look_, icon::kExport, "Save the scene",
                   {"scene-1.json: what is shown, camera, light, cut and annotations", ""}, -1))
        session_->saveScene();
}

void Interface::layOutMeasuredLine(size_t number) {
    const MeasuredLine& line = session_->measurement().lines()[number];
    if (session_->measurement().lines().size() > 1) caption(*look_, fmt::format("Line {}", number + 1).c_str());
    for (const MeasuredText& each : measuredTexts(line, session_->unit()))
        valueRow(*look_, typeset(each.what).c_str(), each.value);
}

/// A dataset's name and a switch, and below its colour and how much of it is there.
void Interface::layOutDataset(uint32_t dataset) {
    const ViewSession::Layer& layer = session_->layers()[dataset];
    Viewer& viewer = session_->viewer();
    ImGui::PushID(int(dataset));
    std::vector<uint32_t> hidden = viewer.hidden();
    bool isShown = !std::ranges::count(hidden, dataset);
    const std::string count = formatCount(layer.triangles);
    const std::string name = fitted(layer.name, ImGui::GetContentRegionAvail().x * 0.45f) + "  " + typeset(count);
    if (switchRow(*look_, name.c_str(), isShown, {"Show it, or hide it", ""})) {
        std::erase(hidden, dataset);
        if (!isShown) hidden.push_back(dataset);
        viewer.setHidden(std::move(hidden));
    }
    DatasetLook look = viewer.lookOf(dataset);
    glm::vec3 colour = look.colour.value_or(viewer.shading().clay);
    if (colourEdit("##colour", colour)) {
        look.colour = colour;
        viewer.setLook(look);
    }
    showTip(*look_, {"A colour in place of its own", ""});
    ImGui::SameLine();
    if (look.colour) {
        if (iconButton(*look_, icon::kDelete, "own", {"Its own colours again", ""}, false, 24)) {
            look.colour.reset();
            viewer.setLook(look);
        }
        ImGui::SameLine();
    }
    float percent = 100 * look.opacity;
    ImGui::SetNextItemWidth(-1);
    if (ImGui::SliderFloat("##opacity", &percent, 0, 100, "%.0f %% there", kNoTyping)) {
        look.opacity = percent / 100;
        viewer.setLook(look);
    }
    showTip(*look_, {"Less than 100: what is behind it shines through", ""});
    ImGui::PopID();
}

void Interface::layOutLayers() {
    for (size_t i = 0; i < session_->layers().size(); ++i)
        if (const ViewSession::Layer& layer = session_->layers()[i]; layer.triangles > 0)
            layOutDataset(uint32_t(i));
        else
            valueRow(*look_, fitted(layer.name, ImGui::GetContentRegionAvail().x * 0.6f).c_str(), "relief");
    ImGui::Dummy({0, 0});
    switchRow(*look_, "Boxes of the parts drawn", session_->showsPages,
              {"The parts that the picture is made of: blue is coarse, red is fine", "B"});
    bool feedback = session_->showsFeedback();
    if (switchRow(*look_, "Where detail is asked for", feedback, {"Where the picture still misses detail", "I"}))
        session_->showFeedback(feedback);
}

void Interface::layOutSave() {
    comboRow(*look_, "##size", kPictureSizeNames, pictureSize_, {"The size of what is saved", ""});
    switchRow(*look_, "No background", picture_.transparent, {"What is not hit is transparent", ""});
    switchRow(*look_, "Depth as well", picture_.depth, {"Distances along the rays, as .pfm", ""});
    bool annotates = annotatesPictures();
    if (switchRow(*look_, "Scale, measures, titles, legend", annotates,
                  {"Written over what is saved, as over the window; by itself where something is measured, annotated "
                   "or compared",
                   ""}))
        annotatesPictures_ = annotates;
    ImGui::BeginDisabled(session_->saving().has_value());
    if (textButton(*look_, icon::kPicture, "Save the picture", {"picture-1.png in the working folder", "Ctrl+S"}, -1))
        savePicture();
    caption(*look_, "Many pictures");
    ImGui::SetNextItemWidth(-1);
    ImGui::SliderInt("##pictures", &sequencePictures_, 2, kMostPictures, "%d pictures",
                     kNoTyping | ImGuiSliderFlags_Logarithmic);
    const float half = (ImGui::GetContentRegionAvail().x - units(8)) / 2;
    if (textButton(*look_, icon::kTurntable, "Turntable", {"Once around, in a folder of its own", "Ctrl+T"}, half))
        saveTurntable();
    ImGui::SameLine();
    if (textButton(*look_, icon::kPath, "Path", {"Smoothly through the bookmarks", "Ctrl+B"}, half)) savePath();
    ImGui::EndDisabled();
    ImGui::BeginDisabled(!hasEncoder_);
    switchRow(*look_, fmt::format("As a video of {:.1f} s", sequencePictures_ / kPicturesPerSecond).c_str(),
              picture_.video,
              {hasEncoder_ ? "turntable-1.mp4 in place of a folder of pictures, without depth"
                           : "Needs the program ffmpeg, which is not installed",
               ""});
    ImGui::EndDisabled();
}

void Interface::layOutColourError() {
    Viewer& viewer = session_->viewer();
    caption(*look_, "Difference of colours that may be seen");
    auto error = float(viewer.colourError());
    ImGui::SetNextItemWidth(-1);
    const std::string shown = typeset("%.1f");
    if (ImGui::SliderFloat("##colour", &error, 0.0f, 20.0f, shown.c_str(), kNoTyping))
        viewer.setColourError(double(error));
    showTip(*look_, {"Detail is read where colours differ by more than this; black and white differ by 100", ""});
}

void Interface::layOutLimits() {
    Viewer& viewer = session_->viewer();
    const ViewerStatus& status = viewer.status();
    caption(*look_, "Error that may be seen");
    auto error = float(viewer.errorPixels());
    ImGui::SetNextItemWidth(-1);
    const std::string shown = typeset("%.2f px");
    if (ImGui::SliderFloat("##error", &error, 0.1f, 16.0f, shown.c_str(), kNoTyping | ImGuiSliderFlags_Logarithmic))
        viewer.setErrorPixels(double(error));
    showTip(*look_, {"Detail is read until the picture errs by no more than this", ""});
    if (session_->viewer().hasColourErrors()) layOutColourError();
    caption(*look_, "Memory that detail may take");
    uint64_t budget = status.budgetBytes;
    const float right = ImGui::GetCursorPosX() + ImGui::GetContentRegionAvail().x;
    ImGui::AlignTextToFramePadding();
    text(typeset(fmt::format("{} of {}", formatBytes(status.update.residentBytes), formatBytes(budget))));
    ImGui::SameLine(right - units(56));
    if (iconButton(*look_, icon::kRemove, "half the budget", {"Half of it", ""}, false, 24)) budget /= 2;
    ImGui::SameLine();
    if (iconButton(*look_, icon::kAdd, "double the budget", {"Twice as much", ""}, false, 24)) budget *= 2;
    progressBar(*look_, double(status.update.residentBytes) / double(std::max<uint64_t>(status.budgetBytes, 1)));
    if (budget != status.budgetBytes)
        if (const auto set = viewer.setBudget(budget); !set) session_->say(set.error().line());
    ImGui::Dummy({0, 0});
    layOutDetails();
}

void Interface::layOutDetails() {
    const ViewerStatus& status = session_->viewer().status();
    const UpdateResult& update = status.update;
    const glm::ivec2 size = session_->viewer().size();
    valueRow(*look_, "State", stateText());
    if (std::isfinite(update.errorPixels)) valueRow(*look_, "Error now", formatPixels(update.errorPixels) + " px");
    if (update.colourPixels > 0) valueRow(*look_, "Colours off within", formatPixels(update.colourPixels) + " px");
    if (status.levels > 0) {
        valueRow(*look_, "Levels drawn",
                 fmt::format("{} to {} of 0 to {}", update.coarsestLevel, update.finestLevel, status.levels - 1));
        valueRow(*look_, "Triangles", formatCount(status.triangles));
        valueRow(*look_, "Parts drawn", fmt::format("{} of {} in memory", update.pagesInCut, update.pagesResident));
        valueRow(*look_, "Read", formatBytes(update.bytesRead));
    }
    if (status.frame.surfaceBytes > 0) valueRow(*look_, "Mesostructure", formatBytes(status.frame.surfaceBytes));
    if (const std::string text = remeshedText(status.frame); !text.empty()) valueRow(*look_, "Remeshed", text);
    const uint32_t most = std::max(session_->viewer().mostSamples(), status.samples);
    valueRow(*look_, "Samples", fmt::format("{} of {}", status.samples, most));
    valueRow(*look_, "A picture takes", fmt::format("{:.0f} ms", status.frame.msFrame));
    valueRow(*look_, "Size", fmt::format("{} x {}", size.x, size.y));
    valueRow(*look_, "Device", status.device + (status.software ? " (software)" : ""));
}

PictureChoice Interface::pictureChosen() const {
    PictureChoice choice = picture_;
    choice.annotated = annotatesPictures();
    choice.size = pictureSize_ == 0 ? session_->viewer().size() : kPictureSizes[pictureSize_];
    return choice;
}

bool Interface::annotatesPictures() const {
    return annotatesPictures_.value_or(!session_->measurement().empty() || !session_->points().empty() ||
                                       session_->comparison());
}

void Interface::savePicture() { session_->savePicture(pictureChosen()); }

void Interface::saveTurntable() { session_->saveTurntable(pictureChosen(), sequencePictures_); }

void Interface::savePath() { session_->savePath(pictureChosen(), sequencePictures_); }

}  // namespace vcp
