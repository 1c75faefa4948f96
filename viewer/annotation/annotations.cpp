#include "viewer/annotation/annotations.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "viewer/annotation/projector.h"

namespace vcp {

namespace {

// Sizes in units.
constexpr double kInset = 16;  // of what stands in a corner of the picture
constexpr double kPlateX = 6, kPlateY = 3;
constexpr double kScaleBarLargest = 160, kScaleBarEnds = 4, kScaleBarText = 10;
constexpr double kLegendWidth = 208, kLegendPadding = 8, kLegendBar = 10, kLegendGap = 4;
constexpr double kLegendPart = 0.4;  // of the picture's width, at most, where its title is not wider
constexpr double kScaleBarHeight = 44;
constexpr double kPointRadius = 6, kPointText = 12;
// A picture so large has units of a pixel.
constexpr glm::dvec2 kUsualSize(1280, 800);
constexpr double kLeastUnit = 0.8;

/// Returns the largest of 1, 2, 5 times a power of ten that is at most `most`.
double roundLength(double most) {
    const double power = std::pow(10.0, std::floor(std::log10(most)));
    for (const double step : {5.0, 2.0})
        if (step * power <= most) return step * power;
    return power;
}

class Layout {
public:
    Layout(const Annotations& annotations, const AnnotatedView& view, AnnotationCanvas& canvas)
        : annotations_(annotations), view_(view), canvas_(canvas), room_(view.high - view.low) {}

    void drawLines() const {
        const Projector projector(view_.camera, view_.size);
        for (const AnnotatedLine& line : annotations_.lines) {
            for (size_t i = 0; i + 1 < line.points.size(); ++i)
                if (const auto segment = projector.segment(line.points[i], line.points[i + 1])) {
                    canvas_.line(segment->from, segment->to, units(5), AnnotationInk::Halo);
                    canvas_.line(segment->from, segment->to, units(2.5), AnnotationInk::Mark);
                }
            for (const glm::dvec3& point : line.points)
                if (const auto at = projector.point(point)) {
                    canvas_.disc(*at, units(6), AnnotationInk::Plate);
                    canvas_.disc(*at, units(4), AnnotationInk::Mark);
                }
            for (size_t i = 0; i < line.lengths.size(); ++i)
                if (const auto at = lengthPlace(projector, line, i)) write(*at, line.lengths[i]);
        }
    }

    /// Marks the points; a title that would cover another one's is left out, and none stands outside of the picture.
    void drawPoints() const {
        const Projector projector(view_.camera, view_.size);
        std::vector<Box2> taken;
        for (const Annotation& point : annotations_.points) {
            const auto at = projector.point(point.position);
            if (!at || !isInRoom(*at)) continue;
            canvas_.disc(*at, units(kPointRadius), AnnotationInk::Plate);
            canvas_.disc(*at, units(kPointRadius - 2), AnnotationInk::Mark);
            if (point.title.empty()) continue;
            const glm::dvec2 size = canvas_.textSize(point.title), border = glm::dvec2(units(kPlateX), units(kPlateY));
            const double right = at->x + units(kPointText) + border.x;
            const bool isLeft = right + size.x + border.x > view_.high.x;
            const double left = isLeft ? at->x - units(kPointText) - border.x - size.x : right;
            const glm::dvec2 from(left, at->y - 0.5 * size.y);
            const Box2 plate{from - border, from + size + border};
            if (std::ranges::any_of(taken, [&](const Box2& other) { return plate.doesTouch(other); })) continue;
            taken.push_back(plate);
            write(from, point.title);
        }
    }

    /// Returns where it ends at the right.
    [[nodiscard]] double drawScaleBar() const {
        const double unitsPerPixel = view_.viewHeight / double(view_.size.y);
        const double length = roundLength(std::min(units(kScaleBarLargest), 0.5 * room_.x) * unitsPerPixel);
        const double pixels = length / unitsPerPixel;
        if (!std::isfinite(pixels)) return view_.low.x;
        const glm::dvec2 from(view_.low.x + units(kInset), view_.high.y - units(kInset)),
            to = from + glm::dvec2(pixels, 0);
        for (const auto& [ink, width] : {std::pair(AnnotationInk::Halo, units(4)), {AnnotationInk::Text, units(2)}}) {
            canvas_.line(from, to, width, ink);
            for (const glm::dvec2 end : {from, to})
                canvas_.line(end - glm::dvec2(0, units(kScaleBarEnds)), end + glm::dvec2(0, units(kScaleBarEnds)),
                             width, ink);
        }
        const bool isSameEverywhere = view_.camera.projection == Projection::Orthographic;
        const std::string text = lengthText(length, annotations_.unit) + (isSameEverywhere ? "" : " at the middle");
        const glm::dvec2 size = canvas_.textSize(text);
        write(from + glm::dvec2(units(kPlateX), -units(kScaleBarText) - size.y), text);
        return std::max(to.x, from.x + size.x + 2 * units(kPlateX));
    }

    /// Draws them above each other. `free`: where what stands to the left ends; wider legends stand above it.
    void drawLegends(double free) const {
        double width = 0;
        for (const Legend& legend : annotations_.legends) width = std::max(width, widthOf(legend));
        const double left = view_.high.x - units(kInset) - width;
        double bottom = view_.high.y - units(kInset);
        if (left < free + units(kLegendGap)) bottom -= units(kScaleBarHeight);
        // At the upper edge, where they would cover a measured length below.
        double height = -units(kLegendGap);
        for (const Legend& legend : annotations_.legends) height += heightOf(legend) + units(kLegendGap);
        const auto coversLength = [&](double end) {
            return doesCoverLength({{left, end - height}, {left + width, end}});
        };
        const double upper = view_.low.y + units(kInset) + height;
        if (coversLength(bottom) && !coversLength(upper)) bottom = upper;
        for (const Legend& legend : annotations_.legends)
            bottom = drawLegend(legend, {left, bottom}, width) - units(kLegendGap);
    }

private:
    struct Box2 {
        glm::dvec2 low, high;
        [[nodiscard]] bool doesTouch(const Box2& other) const {
            return low.x < other.high.x && other.low.x < high.x && low.y < other.high.y && other.low.y < high.y;
        }
    };

    [[nodiscard]] double units(double n) const { return n * view_.unit; }
    [[nodiscard]] bool isInRoom(glm::dvec2 at) const {
        return at.x >= view_.low.x && at.x < view_.high.x && at.y >= view_.low.y && at.y < view_.high.y;
    }
    void write(glm::dvec2 at, const std::string& text) const { writeOnPlate(canvas_, at, text, view_.unit); }

    /// Returns how wide a legend is, with what is around it.
    [[nodiscard]] double widthOf(const Legend& legend) const {
        const double bar = std::min(units(kLegendWidth), kLegendPart * room_.x);
        return std::round(std::max(bar, canvas_.textSize(legend.title()).x) + 2 * units(kLegendPadding));
    }

    /// Returns how high a legend is, with what is around it.
    [[nodiscard]] double heightOf(const Legend& legend) const {
        const double line = canvas_.textSize(legend.title()).y;
        return 2 * (units(kLegendPadding) + line + units(kLegendGap)) + units(kLegendBar);
    }

    /// Returns where the length of a segment is written, if it is in the picture.
    [[nodiscard]] std::optional<glm::dvec2> lengthPlace(const Projector& projector, const AnnotatedLine& line,
                                                        size_t i) const {
        const auto segment = projector.segment(line.points[i], line.points[i + 1]);
        if (!segment) return std::nullopt;
        return 0.5 * (segment->from + segment->to) + glm::dvec2(units(12), -units(8));
    }

    [[nodiscard]] bool doesCoverLength(const Box2& box) const {
        const Projector projector(view_.camera, view_.size);
        const glm::dvec2 border(units(kPlateX), units(kPlateY));
        for (const AnnotatedLine& line : annotations_.lines)
            for (size_t i = 0; i < line.lengths.size(); ++i)
                if (const auto at = lengthPlace(projector, line, i);
                    at && box.doesTouch({*at - border, *at + canvas_.textSize(line.lengths[i]) + border}))
                    return true;
        return false;
    }

    /// Draws a title, a bar of colours and its numbers. Returns where they begin.
    [[nodiscard]] double drawLegend(const Legend& legend, glm::dvec2 lowerLeft, double width) const {
        const double line = canvas_.textSize(legend.title()).y;
        const double padding = units(kLegendPadding), gap = units(kLegendGap);
        const double left = std::round(lowerLeft.x), top = lowerLeft.y - heightOf(legend);
        if (left < view_.low.x || top < view_.low.y) return lowerLeft.y;
        canvas_.plate({left, top}, {left + width, lowerLeft.y});
        const double from = std::round(left + padding), to = std::round(left + width - padding);
        canvas_.text({from, top + padding}, legend.title());
        const double barTop = std::round(top + padding + line + gap);
        const double barBottom = std::round(barTop + units(kLegendBar));
        for (double x = from; x < to; ++x)
            canvas_.rectangle(glm::dvec2(x, barTop), glm::dvec2(x + 1, barBottom),
                              legend.colourAt((x + 0.5 - from) / (to - from)));
        writeTicks(legend, {from, barBottom + gap}, to);
        return top;
    }

    /// Writes every number, or every second, or every third, so that none touches another; and the last one.
    void writeTicks(const Legend& legend, glm::dvec2 at, double right) const {
        if (legend.ticks.empty()) return;
        std::vector<Span> places;
        for (const LegendTick& tick : legend.ticks) {
            const double width = canvas_.textSize(tick.text).x;
            const double middle = at.x + tick.part * (right - at.x);
            const double from = std::clamp(middle - 0.5 * width, at.x, std::max(at.x, right - width));
            places.push_back({from, from + width + units(kLegendGap)});
        }
        size_t every = 1;
        while (every < places.size() && doTouch(places, every)) ++every;
        for (size_t i = 0; i + 1 < places.size(); i += every)
            if (places[i].to <= places.back().from) canvas_.text({places[i].from, at.y}, legend.ticks[i].text);
        canvas_.text({places.back().from, at.y}, legend.ticks.back().text);
    }

    struct Span {
        double from, to;
    };
    /// Whether of the spans from the first on, `every` apart, two touch; where the last one is not among them, the one
    /// before it does not count.
    static bool doTouch(const std::vector<Span>& spans, size_t every) {
        for (size_t i = 0; i + every < spans.size(); i += every)
            if (spans[i].to > spans[i + every].from) return true;
        return false;
    }

    const Annotations& annotations_;
    const AnnotatedView& view_;
    AnnotationCanvas& canvas_;
    glm::dvec2 room_;
};

}  // namespace

AnnotatedView annotatedPicture(const Camera& camera, double viewHeight, glm::uvec2 size) {
    const glm::dvec2 parts = glm::dvec2(size) / kUsualSize;
    return {.camera = camera,
            .viewHeight = viewHeight,
            .size = size,
            .low = glm::dvec2(0),
            .high = glm::dvec2(size),
            .unit = std::max(std::min(parts.x, parts.y), kLeastUnit)};
}

std::optional<size_t> annotationAt(const std::vector<Annotation>& points, const AnnotatedView& view, glm::dvec2 pixel) {
    const Projector projector(view.camera, view.size);
    for (size_t i = points.size(); i-- > 0;)
        if (const auto at = projector.point(points[i].position);
            at && glm::distance(*at, pixel) <= (kPointRadius + 2) * view.unit)
            return i;
    return std::nullopt;
}

void draw(const Annotations& annotations, const AnnotatedView& view, AnnotationCanvas& canvas) {
    const Layout layout(annotations, view, canvas);
    layout.drawLines();
    layout.drawPoints();
    layout.drawLegends(annotations.hasScaleBar ? layout.drawScaleBar() : view.low.x);
}

void writeOnPlate(AnnotationCanvas& canvas, glm::dvec2 at, const std::string& text, double unit) {
    const glm::dvec2 border(unit * kPlateX, unit * kPlateY);
    canvas.plate(at - border, at + canvas.textSize(text) + border);
    canvas.text(at, text);
}

}  // namespace vcp
