#include "viewer/bench/report/plot_svg.h"

#include <cmath>
#include <limits>
#include <regex>

#include <gtest/gtest.h>

namespace vcp {
namespace {

size_t countOf(const std::string& text, const std::string& part) {
    size_t count = 0;
    for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
    return count;
}

/// Centres of the points, without those of the legend (radius 4).
std::vector<std::pair<double, double>> pointsOf(const std::string& svg) {
    static const std::regex point("<circle cx=\"([-0-9.]+)\" cy=\"([-0-9.]+)\" r=\"3.5\"");
    std::vector<std::pair<double, double>> points;
    for (std::sregex_iterator it(svg.begin(), svg.end(), point), end; it != end; ++it)
        points.emplace_back(std::stod((*it)[1]), std::stod((*it)[2]));
    return points;
}

TEST(PlotSvg, MarksAreRound) {
    EXPECT_EQ(plotMarks(0, 10, false), (std::vector<double>{0, 2, 4, 6, 8, 10}));
    EXPECT_EQ(plotMarks(-1, 1.2, false), (std::vector<double>{-1, -0.5, 0, 0.5, 1}));
    EXPECT_EQ(plotMarks(0.9, 11, true), (std::vector<double>{1, 2, 5, 10}));
    EXPECT_EQ(plotMarks(0.5, 2e6, true), (std::vector<double>{1, 10, 100, 1e3, 1e4, 1e5, 1e6}));
    for (const auto& [low, high, isLog] :
         {std::tuple{1.0, 1.0, false}, {2.0, 1.0, true}, {0.0, 1.0, true}, {-1.0, 1.0, true}, {NAN, 1.0, false}})
        EXPECT_TRUE(plotMarks(low, high, isLog).empty()) << low << " " << high;
}

TEST(PlotSvg, PointsLieWhereTheirValuesAre) {
    const std::string svg = plotSvg({.title = "",
                                     .xName = "",
                                     .yName = "",
                                     .logX = true,
                                     .logY = false,
                                     .series = {{"a", {{1, 0}, {10, 5}, {100, 10}}}},
                                     .levels = {}});
    const auto points = pointsOf(svg);
    ASSERT_EQ(points.size(), 3u);
    EXPECT_NEAR(points[1].first, (points[0].first + points[2].first) / 2, 0.2) << "logarithmic across";
    EXPECT_NEAR(points[1].second, (points[0].second + points[2].second) / 2, 0.2) << "linear upwards";
    EXPECT_LT(points[2].second, points[0].second) << "more is higher";
    EXPECT_EQ(countOf(svg, "<path "), 1u);
}

TEST(PlotSvg, WhatCannotBeShownIsLeftOut) {
    const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
    const std::string svg =
        plotSvg({.title = "t",
                 .xName = "x",
                 .yName = "y",
                 .logX = true,
                 .logY = true,
                 .series = {{"a", {{1, 1}, {0, 1}, {-1, 1}, {1, nan}, {inf, 1}, {2, 3}}}, {"b", {{nan, nan}}}},
                 .levels = {{"none", 0}, {"some", 2}}});
    EXPECT_EQ(pointsOf(svg).size(), 2u);
    EXPECT_EQ(countOf(svg, "stroke-dasharray"), 1u);
    EXPECT_EQ(svg.find("nan"), std::string::npos);
    EXPECT_EQ(svg.find("inf"), std::string::npos);
}

TEST(PlotSvg, NothingAndOnePointAreFramesToo) {
    for (const bool isLog : {true, false}) {
        Plot plot{.title = "t", .xName = "x", .yName = "y", .logX = isLog, .logY = isLog};
        EXPECT_EQ(plotSvg(plot).find("nan"), std::string::npos);
        plot.series = {{"a", {{3, 0.5, "here"}}}};
        const std::string svg = plotSvg(plot);
        EXPECT_EQ(pointsOf(svg).size(), 1u);
        EXPECT_NE(svg.find(">here<"), std::string::npos);
        EXPECT_EQ(svg.find("nan"), std::string::npos);
    }
}

TEST(PlotSvg, NamesAreEscaped) {
    const std::string svg = plotSvg({.title = "a<b & \"c\"",
                                     .xName = "x>y",
                                     .yName = "",
                                     .logX = false,
                                     .logY = false,
                                     .series = {{"<&>", {{1, 1, "<"}}}},
                                     .levels = {{"l<", 1}}});
    EXPECT_NE(svg.find("a&lt;b &amp; &quot;c&quot;"), std::string::npos);
    EXPECT_EQ(svg.find("<b"), std::string::npos);
    EXPECT_EQ(svg.find("<&"), std::string::npos);
    EXPECT_EQ(countOf(svg, "<svg"), 1u);
    EXPECT_EQ(svg.substr(svg.size() - 7), "</svg>\n");
}

}  // namespace
}  // namespace vcp
