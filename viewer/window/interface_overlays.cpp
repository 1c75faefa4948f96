// What is drawn over the picture: annotations, handles of sections, boxes of parts, what rays asked for.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <imgui.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "render/false_colours.h"
#include "viewer/annotation/annotations.h"
#include "viewer/annotation/projector.h"
#include "viewer/window/interface.h"

namespace vcp {

namespace {

constexpr size_t kMostBoxes = 2000;
constexpr double kUrgentDoublings = 5;  // doublings of the tolerated error, until a ray that asks is red
constexpr float kInset = 16;            // of what stands in a corner of the picture

ImU32 packed(glm::vec3 colour, int alpha) {
    const glm::vec3 c = 255.0f * colour + 0.5f;
    return IM_COL32(int(c.x), int(c.y), int(c.z), alpha);
}

/// Draws annotations behind the panels, with the window's fonts.
class WindowCanvas : public AnnotationCanvas {
public:
    explicit WindowCanvas(const Look& look) : look_(look), list_(*ImGui::GetBackgroundDrawList()) {}

    void line(glm::dvec2 from, glm::dvec2 to, double width, AnnotationInk ink) override {
        list_.AddLine(vec(glm::vec2(from)), vec(glm::vec2(to)), colourOf(ink), float(width));
    }
    void disc(glm::dvec2 middle, double radius, AnnotationInk ink) override {
        list_.AddCircleFilled(vec(glm::vec2(middle)), float(radius), colourOf(ink));
    }
    void rectangle(glm::ivec2 low, glm::ivec2 high, glm::vec3 colour) override {
        list_.AddRectFilled(vec(glm::vec2(low)), vec(glm::vec2(high)), packed(colour, 255));
    }
    void plate(glm::dvec2 low, glm::dvec2 high) override {
        list_.AddRectFilled(vec(glm::vec2(low)), vec(glm::vec2(high)), plateColour(), look_.units(4));
    }
    void text(glm::dvec2 at, const std::string& text) override {
        const std::string set = typeset(text);
        list_.AddText(vec(glm::vec2(at)), look_.palette.ink, set.data(), set.data() + set.size());
    }
    [[nodiscard]] glm::dvec2 textSize(const std::string& text) const override {
        const std::string set = typeset(text);
        const ImVec2 size = ImGui::CalcTextSize(set.data(), set.data() + set.size());
        return {size.x, size.y};
    }

private:
    [[nodiscard]] ImU32 plateColour() const {
        return (look_.palette.raised & ~IM_COL32_A_MASK) | IM_COL32(0, 0, 0, 235);
    }
    [[nodiscard]] ImU32 colourOf(AnnotationInk ink) const {
        const Palette& palette = look_.palette;
        return ink == AnnotationInk::Text   ? palette.ink
               : ink == AnnotationInk::Halo ? palette.halo
               : ink == AnnotationInk::Mark ? palette.accent
                                            : palette.raised;
    }

    const Look& look_;
    ImDrawList& list_;
};

}  // namespace

void Interface::plateAt(glm::vec2 at, const std::string& line) const {
    WindowCanvas canvas(*look_);
    writeOnPlate(canvas, at, line, double(look_->scale));
}

AnnotatedView Interface::annotatedView() const {
    const Viewer& viewer = session_->viewer();
    return {.camera = viewer.camera().current(),
            .viewHeight = viewer.camera().viewHeight(),
            .size = glm::uvec2(glm::max(viewer.size(), 1)),
            .low = {0, toolbarHeight_},
            .high = {size_.x - panelWidth_, size_.y - statusHeight_},
            .unit = double(look_->scale)};
}

void Interface::drawAnnotations() const {
    WindowCanvas canvas(*look_);
    draw(session_->annotations(), annotatedView(), canvas);
    if (ImGui::GetIO().WantCaptureMouse || takesText()) return;
    const ImVec2 mouse = ImGui::GetIO().MousePos;
    const auto under = annotationAt(session_->points(), annotatedView(), {mouse.x, mouse.y});
    if (!under || session_->points()[*under].text.empty()) return;
    // Below the title, or above it where the picture ends.
    const bool isLow = mouse.y > 0.75f * ImGui::GetIO().DisplaySize.y;
    ImGui::SetNextWindowPos({mouse.x, mouse.y + units(isLow ? -24 : 24)}, 0, {0, isLow ? 1.0f : 0.0f});
    ImGui::BeginTooltip();
    ImGui::PushTextWrapPos(units(320));
    text(session_->points()[*under].text);
    ImGui::PopTextWrapPos();
    ImGui::EndTooltip();
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
    const double finest = std::max(1u, viewer.status().levels - 1);
    const Projector projector(viewer.camera().current(), glm::uvec2(glm::max(viewer.size(), 1)));
    size_t drawn = 0;
    for (const PageBox& page : pages) {
        if (!page.isDrawn || ++drawn > kMostBoxes) continue;
        const ImU32 colour = packed(falseColour(page.level / finest), 150);
        for (int axis = 0; axis < 3; ++axis)
            for (int side = 0; side < 4; ++side) {
                const glm::dvec3 from = page.corner + page.edges[size_t(axis + 1) % 3] * double(side & 1) +
                                        page.edges[size_t(axis + 2) % 3] * double(side >> 1);
                if (const auto edge = projector.segment(from, from + page.edges[size_t(axis)]))
                    list.AddLine(vec(glm::vec2(edge->from)), vec(glm::vec2(edge->to)), colour, units(1));
            }
    }
    const std::string said =
        fmt::format("{} of {} parts in memory are drawn{}",
                    std::count_if(pages.begin(), pages.end(), [](const PageBox& p) { return p.isDrawn; }), pages.size(),
                    drawn > kMostBoxes ? fmt::format("; the first {} as boxes", kMostBoxes) : "");
    plateAt({units(kInset + 6), size_.y - statusHeight_ - units(kInset + 56)}, said);
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
    const std::string said = kept
                                 ? fmt::format("Detail is missing at {} of {} points", asking, kept->errorPixels.size())
                                 : "Nothing is missing";
    plateAt(corner + glm::vec2(0, size.y + units(8)), said);
}

}  // namespace vcp
