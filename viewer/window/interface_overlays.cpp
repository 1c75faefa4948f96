// What is drawn over the picture: scale bar, measured lines, handles of sections, boxes of parts, what rays asked for.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <imgui.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "viewer/scene/option_values.h"
#include "viewer/window/interface.h"

namespace vcp {

namespace {

constexpr float kScaleBarLargest = 160;
constexpr size_t kMostBoxes = 2000;
constexpr double kUrgentDoublings = 5;  // doublings of the tolerated error, until a ray that asks is red
constexpr float kInset = 16;            // of what stands in a corner of the picture

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

/// Returns the largest of 1, 2, 5 times a power of ten that is at most `most`.
double roundLength(double most) {
    const double power = std::pow(10.0, std::floor(std::log10(most)));
    for (const double step : {5.0, 2.0})
        if (step * power <= most) return step * power;
    return power;
}

}  // namespace

void Interface::plateAt(ImDrawList& list, glm::vec2 at, const std::string& line) const {
    const std::string set = typeset(line);
    const ImVec2 size = ImGui::CalcTextSize(set.data(), set.data() + set.size());
    const ImU32 plate = (look_->palette.raised & ~IM_COL32_A_MASK) | IM_COL32(0, 0, 0, 235);
    list.AddRectFilled({at.x - units(6), at.y - units(3)}, {at.x + size.x + units(6), at.y + size.y + units(3)}, plate,
                       units(4));
    list.AddText(vec(at), look_->palette.ink, set.data(), set.data() + set.size());
}

void Interface::drawScaleBar() const {
    const Viewer& viewer = session_->viewer();
    const double unitsPerPixel = viewer.camera().viewHeight() / std::max(1, viewer.size().y);
    const float largest = std::min(units(kScaleBarLargest), 0.5f * (size_.x - panelWidth_));
    const double length = roundLength(double(largest) * unitsPerPixel);
    const auto pixels = float(length / unitsPerPixel);
    if (!std::isfinite(pixels)) return;
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const glm::vec2 from(units(kInset), size_.y - statusHeight_ - units(kInset));
    const Palette& palette = look_->palette;
    for (const auto& [colour, width] : {std::pair(palette.halo, units(4)), std::pair(palette.ink, units(2))}) {
        list.AddLine(vec(from), {from.x + pixels, from.y}, colour, width);
        for (const float x : {from.x, from.x + pixels})
            list.AddLine({x, from.y - units(4)}, {x, from.y + units(4)}, colour, width);
    }
    const bool everywhere = viewer.camera().projection == Projection::Orthographic;
    plateAt(list, from + glm::vec2(units(6), -units(28)), formatLength(length) + (everywhere ? "" : " in the middle"));
}

void Interface::drawMeasured() const {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const Viewer& viewer = session_->viewer();
    const Palette& palette = look_->palette;
    const auto pixelOf = [&](const MeasuredPoint& p) { return viewer.camera().pixelOf(p.position, viewer.size()); };
    for (const MeasuredLine& line : session_->measurement().lines())
        for (size_t i = 0; i < line.size(); ++i) {
            const auto at = pixelOf(line[i]);
            if (!at) continue;
            const glm::vec2 here(*at);
            const auto next = i + 1 < line.size() ? pixelOf(line[i + 1]) : std::nullopt;
            const glm::vec2 there(next ? glm::vec2(*next) : here);
            list.AddLine(vec(here), vec(there), palette.halo, units(5));
            list.AddLine(vec(here), vec(there), palette.accent, units(2.5f));
            list.AddCircleFilled(vec(here), units(6), palette.raised);
            list.AddCircleFilled(vec(here), units(4), palette.accent);
            if (next)
                plateAt(list, 0.5f * (here + there) + glm::vec2(units(12), -units(8)),
                        formatLength(segmentLength(line, i)));
        }
}

void Interface::drawSectionHandles() const {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const SectionGrab grab = session_->viewer().sectionGrab();
    const Palette& palette = look_->palette;
    for (const SectionHandle& handle : session_->viewer().sectionHandles()) {
        // What the mouse would grip is drawn as text is: it stands out from the accent in both themes.
        const auto colourOf = [&](SectionGrip part) {
            return grab == SectionGrab{part, handle.plane} ? palette.ink : palette.accent;
        };
        std::vector<ImVec2> ring;
        for (const glm::dvec2 at : handle.ring) ring.push_back(vec(glm::vec2(at)));
        list.AddPolyline(ring.data(), int(ring.size()), palette.halo, ImDrawFlags_Closed, units(5));
        list.AddPolyline(ring.data(), int(ring.size()), colourOf(SectionGrip::Turn), ImDrawFlags_Closed, units(2.5f));
        const glm::vec2 foot(handle.foot), tip(handle.tip);
        const ImU32 colour = colourOf(SectionGrip::Move);
        list.AddCircleFilled(vec(foot), units(8), palette.halo);
        list.AddCircleFilled(vec(foot), units(6.5f), colour);
        if (handle.isAlongView) continue;
        const glm::vec2 along = glm::normalize(tip - foot), across(-along.y, along.x);
        const glm::vec2 neck = tip - units(12) * along;
        list.AddLine(vec(foot), vec(neck), palette.halo, units(5));
        list.AddLine(vec(foot), vec(neck), colour, units(3));
        list.AddTriangleFilled(vec(tip), vec(neck + units(6) * across), vec(neck - units(6) * across), colour);
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
                drawSegment(list, viewer, from, from + page.edges[size_t(axis)], colour, units(1));
            }
    }
    const std::string said =
        fmt::format("{} of {} subvolumes in memory are drawn{}",
                    std::count_if(pages.begin(), pages.end(), [](const PageBox& p) { return p.isDrawn; }), pages.size(),
                    drawn > kMostBoxes ? fmt::format("; the first {} as boxes", kMostBoxes) : "");
    plateAt(list, {units(kInset + 6), size_.y - statusHeight_ - units(kInset + 56)}, said);
}

void Interface::drawFeedback() const {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    Viewer& viewer = session_->viewer();
    const auto& kept = viewer.renderer().feedbackPicture();
    const float cell = units(8);
    const glm::vec2 size(FeedbackPicture::kWidth * cell, FeedbackPicture::kHeight * cell);
    const glm::vec2 corner(units(kInset + 8), toolbarHeight_ + units(kInset + 8));
    const ImU32 plate = (look_->palette.raised & ~IM_COL32_A_MASK) | IM_COL32(0, 0, 0, 235);
    list.AddRectFilled(vec(corner - units(8)), vec(corner + size + glm::vec2(units(8), units(32))), plate, units(8));
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
        list.AddRectFilled(vec(at), vec(at + cell - units(1)), colour);
    }
    const std::string said =
        kept ? fmt::format("{} of {} rays asked", asking, kept->errorPixels.size()) : "Nothing is missing";
    plateAt(list, corner + glm::vec2(0, size.y + units(8)), said);
}

}  // namespace vcp
