// What is written over pictures: where it is, what it says, and that rows of a picture get the same as the whole.
#include "viewer/annotation/annotations.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "viewer/annotation/picture_canvas.h"

namespace vcp {
namespace {

/// Keeps what is drawn; letters are 6 pixels wide and 10 high.
struct RecordingCanvas : AnnotationCanvas {
    struct Line {
        glm::dvec2 from, to;
        AnnotationInk ink;
    };
    struct Text {
        glm::dvec2 at;
        std::string text;
    };
    struct Rectangle {
        glm::ivec2 low, high;
        glm::vec3 colour;
    };
    std::vector<Line> lines;
    std::vector<Text> texts;
    std::vector<Rectangle> rectangles;
    std::vector<glm::dvec2> discs;

    void line(glm::dvec2 from, glm::dvec2 to, double, AnnotationInk ink) override { lines.push_back({from, to, ink}); }
    void disc(glm::dvec2 middle, double, AnnotationInk) override { discs.push_back(middle); }
    void rectangle(glm::ivec2 low, glm::ivec2 high, glm::vec3 colour) override {
        rectangles.push_back({low, high, colour});
    }
    void plate(glm::dvec2, glm::dvec2) override {}
    void text(glm::dvec2 at, const std::string& text) override { texts.push_back({at, text}); }
    [[nodiscard]] glm::dvec2 textSize(const std::string& text) const override { return {6 * double(text.size()), 10}; }
};

constexpr glm::uvec2 kSize(1280, 800);

/// Looks along -z; a pixel is `unitsPerPixel` wide, and (0, 0) is the picture's middle.
AnnotatedView flat(double unitsPerPixel, glm::uvec2 size = kSize) {
    Camera camera{.eye = {0, 0, 10}, .forward = {0, 0, -1}, .up = {0, 1, 0}};
    camera.projection = Projection::Orthographic;
    camera.orthographicHeight = unitsPerPixel * size.y;
    return annotatedPicture(camera, camera.orthographicHeight, size);
}

RecordingCanvas drawn(const Annotations& annotations, const AnnotatedView& view) {
    RecordingCanvas canvas;
    draw(annotations, view, canvas);
    return canvas;
}

Annotations steps() {
    return {.legends = legendsOf(ShadingMode::Steps, {.levels = {5}, .hasRelief = false}), .lines = {}, .unit = {}};
}

TEST(Annotations, TheScaleBarIsAsLongAsItSays) {
    for (const double unitsPerPixel : {0.37, 0.021, 12.0, 1e-5}) {
        const RecordingCanvas canvas =
            drawn({.legends = {}, .hasScaleBar = true, .lines = {}, .unit = {}}, flat(unitsPerPixel));
        ASSERT_EQ(canvas.texts.size(), 1u);
        const double length = std::stod(canvas.texts[0].text);
        double longest = 0;
        for (const auto& line : canvas.lines) longest = std::max(longest, glm::distance(line.from, line.to));
        EXPECT_NEAR(longest * unitsPerPixel, length, 1e-9 * length);
        EXPECT_LE(longest, 160);
        EXPECT_GE(longest, 160 / 2.5) << "the next longer one would not fit";
    }
}

TEST(Annotations, PointsAreMarkedAndTitled) {
    const AnnotatedView view = flat(0.01);
    Annotations annotations;
    annotations.points = {
        {{1, 2, 0}, "Nose"}, {{6.3, 0, 0}, "At the right edge"}, {{100, 0, 0}, "Outside"}, {{-2, 0, 0}, ""}};
    const RecordingCanvas canvas = drawn(annotations, view);
    const glm::dvec2 nose(640 + 100, 400 - 200), edge(640 + 630, 400);
    ASSERT_EQ(canvas.discs.size(), 6u) << "two for each point that is seen";
    EXPECT_LT(glm::distance(canvas.discs[0], nose), 1e-6);
    ASSERT_EQ(canvas.texts.size(), 2u);
    EXPECT_EQ(canvas.texts[0].text, "Nose");
    EXPECT_GT(canvas.texts[0].at.x, nose.x);
    EXPECT_LT(canvas.texts[1].at.x + 6 * 17, edge.x) << "what has no room at the right stands at the left";
    EXPECT_EQ(annotationAt(annotations.points, view, nose + 3.0), 0u);
    EXPECT_EQ(annotationAt(annotations.points, view, edge), 1u);
    EXPECT_FALSE(annotationAt(annotations.points, view, {400, 100}));
}

TEST(Annotations, NoTitleCoversAnother) {
    Annotations annotations;
    for (int i = 0; i < 50; ++i) annotations.points.push_back({{0.02 * i, 0, 0}, "Point " + std::to_string(i)});
    const RecordingCanvas canvas = drawn(annotations, flat(0.01));
    EXPECT_EQ(canvas.discs.size(), 100u);
    EXPECT_GE(canvas.texts.size(), 2u);
    for (size_t i = 0; i + 1 < canvas.texts.size(); ++i)
        EXPECT_GT(canvas.texts[i + 1].at.x, canvas.texts[i].at.x + 6 * double(canvas.texts[i].text.size()));
}

TEST(Annotations, TheScaleBarHasTheUnitAndSaysWhereItHolds) {
    AnnotatedView view = flat(10);
    const Annotations annotations{.legends = {}, .hasScaleBar = true, .lines = {}, .unit = unitNamed("mm")};
    EXPECT_EQ(drawn(annotations, view).texts.at(0).text, "1000 mm");
    view.camera.projection = Projection::Perspective;
    EXPECT_EQ(drawn(annotations, view).texts.at(0).text, "1000 mm at the middle");
}

TEST(Annotations, EveryColourOfTheLegendStandsAboveItsNumber) {
    for (const glm::uvec2 size : {kSize, glm::uvec2(320, 240), glm::uvec2(1920, 1200)}) {
        const Annotations annotations = steps();
        const Legend& legend = annotations.legends.at(0);
        const RecordingCanvas canvas = drawn(annotations, flat(1, size));
        EXPECT_EQ(canvas.texts.at(0).text, "Steps of each ray");
        const double left = canvas.rectangles.front().low.x, right = canvas.rectangles.back().high.x;
        for (const auto& column : canvas.rectangles) {
            const double number = legend.end * (column.low.x + 0.5 - left) / (right - left);
            EXPECT_EQ(column.colour, legend.colourOf(number)) << number;
        }
        for (size_t i = 2; i + 1 < canvas.texts.size(); ++i) {
            const double middle = canvas.texts[i].at.x + 0.5 * canvas.textSize(canvas.texts[i].text).x;
            EXPECT_NEAR((middle - left) / (right - left), std::stod(canvas.texts[i].text) / legend.end, 0.01);
        }
        EXPECT_EQ(canvas.texts.back().text, "64+");
        EXPECT_LE(canvas.texts.back().at.x + 18, size.x);
    }
}

TEST(Annotations, NumbersOfALegendDoNotTouch) {
    for (const uint32_t levels : {1u, 2u, 9u, 23u, 300u}) {
        const RecordingCanvas canvas =
            drawn({.legends = legendsOf(ShadingMode::Level, {.levels = {levels}, .hasRelief = false}),
                   .lines = {},
                   .unit = {}},
                  flat(1));
        for (size_t i = 2; i < canvas.texts.size(); ++i)
            EXPECT_GE(canvas.texts[i].at.x, canvas.texts[i - 1].at.x + canvas.textSize(canvas.texts[i - 1].text).x + 3);
        EXPECT_EQ(canvas.texts.at(1).text, "0");
        EXPECT_EQ(canvas.texts.back().text, std::to_string(levels - 1));
    }
}

TEST(Annotations, ALegendWithoutRoomIsLeftOut) {
    EXPECT_TRUE(drawn(steps(), flat(1, {120, 240})).texts.empty());
    EXPECT_TRUE(drawn(steps(), flat(1, {320, 40})).texts.empty());
    AnnotatedView covered = flat(1);
    covered.high.x = 120;
    EXPECT_TRUE(drawn(steps(), covered).texts.empty());
}

TEST(Annotations, ALegendGivesWayToAMeasuredLength) {
    constexpr glm::uvec2 kSmall(320, 240);
    Annotations annotations = steps();
    const auto upperLeftOf = [](const RecordingCanvas& canvas) {
        return glm::dvec2(std::ranges::min_element(canvas.rectangles, {}, [](const auto& r) { return r.low.x; })->low);
    };
    const glm::dvec2 usual = upperLeftOf(drawn(annotations, flat(1, kSmall)));
    // A length is written where the legend would be: (0, 0) is the picture's middle, y up.
    const glm::dvec3 place(usual.x - 160 + 20, 120 - usual.y, 0);
    annotations.lines = {
        {.points = {place - glm::dvec3(20, 0, 0), place + glm::dvec3(20, 0, 0)}, .lengths = {"40 mm"}}};
    const RecordingCanvas canvas = drawn(annotations, flat(1, kSmall));
    EXPECT_LT(upperLeftOf(canvas).y, 120) << "it stands at the upper edge";
    EXPECT_EQ(upperLeftOf(canvas).x, usual.x);
    annotations.lines[0].points = {{-150, 100, 0}, {-120, 100, 0}};
    EXPECT_EQ(upperLeftOf(drawn(annotations, flat(1, kSmall))), usual);
}

TEST(Annotations, MeasuredLinesAreWhereTheyWereMeasured) {
    const Annotations annotations{
        .legends = {}, .lines = {{.points = {{0, 0, 0}, {100, 0, 0}}, .lengths = {"100 mm"}}}, .unit = {}};
    const RecordingCanvas canvas = drawn(annotations, flat(1));
    ASSERT_EQ(canvas.lines.size(), 2u) << "a halo and the line";
    EXPECT_EQ(canvas.lines[1].from, glm::dvec2(640, 400));
    EXPECT_EQ(canvas.lines[1].to, glm::dvec2(740, 400));
    ASSERT_EQ(canvas.discs.size(), 4u);
    EXPECT_EQ(canvas.discs[3], glm::dvec2(740, 400));
    EXPECT_EQ(canvas.texts.at(0).text, "100 mm");
    EXPECT_NEAR(canvas.texts[0].at.x, 690, 20);
}

TEST(Annotations, WhatIsBehindTheEyeIsNotDrawn) {
    AnnotatedView view = flat(1);
    view.camera.projection = Projection::Perspective;
    const Annotations annotations{
        .legends = {}, .lines = {{.points = {{0, 0, 20}, {1, 0, 30}}, .lengths = {"10"}}}, .unit = {}};
    const RecordingCanvas canvas = drawn(annotations, view);
    EXPECT_TRUE(canvas.lines.empty());
    EXPECT_TRUE(canvas.discs.empty());
    EXPECT_TRUE(canvas.texts.empty());
}

/// A picture's rows one by one, a few at a time, and at once.
TEST(Annotations, RowsGetWhatTheWholeGets) {
    static constexpr glm::uvec2 kSmall(320, 240);
    Annotations annotations = steps();
    annotations.hasScaleBar = true;
    annotations.lines = {{.points = {{-100, -80, 0}, {90, 70, 0}, {120, -20, 0}}, .lengths = {"242.1", "94.9"}}};
    const auto blank = [](uint32_t rows) {
        return Picture{kSmall.x, rows, std::vector<uint8_t>(4 * size_t{kSmall.x} * rows, 90)};
    };
    Picture whole = blank(kSmall.y);
    paintAnnotations(annotations, flat(1, kSmall), true, whole);
    EXPECT_NE(whole, blank(kSmall.y));
    for (const uint32_t step : {1u, 7u, 100u}) {
        std::vector<uint8_t> joined;
        for (uint32_t row = 0; row < kSmall.y; row += step) {
            Picture rows = blank(std::min(step, kSmall.y - row));
            paintAnnotations(annotations, flat(1, kSmall), true, rows, row);
            joined.insert(joined.end(), rows.rgba.begin(), rows.rgba.end());
        }
        EXPECT_EQ(joined, whole.rgba) << step;
    }
}

}  // namespace
}  // namespace vcp
