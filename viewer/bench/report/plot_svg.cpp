#include "viewer/bench/report/plot_svg.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>

#include <fmt/format.h>

namespace vcp {

namespace {

constexpr double kWidth = 720, kHeight = 440, kLeft = 76, kRight = 170, kTop = 40, kBottom = 56;

// Okabe and Ito's palette, which colour-blind people can tell apart.
constexpr std::array<std::string_view, 10> kColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00",
                                                       "#56b4e9", "#000000", "#7b3fa0", "#8c6d31", "#a01010"};

std::string escaped(std::string_view text) {
    std::string safe;
    for (const char c : text) {
        if (c == '<')
            safe += "&lt;";
        else if (c == '>')
            safe += "&gt;";
        else if (c == '&')
            safe += "&amp;";
        else if (c == '"')
            safe += "&quot;";
        else
            safe += c;
    }
    return safe;
}

/// Returns a short text such as 2.5M, 30k or 0.02.
std::string shortNumber(double value) {
    const double size = std::abs(value);
    if (size >= 1e9) return fmt::format("{:g}G", value * 1e-9);
    if (size >= 1e6) return fmt::format("{:g}M", value * 1e-6);
    if (size >= 1e4) return fmt::format("{:g}k", value * 1e-3);
    return fmt::format("{:g}", value);
}

/// Maps values to pixels.
class Axis {
public:
    Axis(bool isLog, double firstPixel, double lastPixel) : isLog_(isLog), first_(firstPixel), last_(lastPixel) {}

    [[nodiscard]] bool shows(double value) const { return std::isfinite(value) && (!isLog_ || value > 0); }

    void include(double value) {
        if (!shows(value)) return;
        low_ = low_ ? std::min(*low_, value) : value;
        high_ = high_ ? std::max(*high_, value) : value;
    }

    /// Leaves some space around the values; a linear axis begins at 0 where they are positive.
    void settle() {
        double low = low_.value_or(1), high = high_.value_or(1);
        if (isLog_) {
            low /= 1.3, high *= 1.3;
        } else {
            if (low > 0) low = 0;
            const double air = high > low ? 0.06 * (high - low) : 1;
            high += air;
            if (low < 0) low -= air;
        }
        low_ = low, high_ = high;
    }

    [[nodiscard]] double pixel(double value) const {
        const double low = scaled(*low_), high = scaled(*high_);
        return first_ + (last_ - first_) * (scaled(value) - low) / (high - low);
    }

    [[nodiscard]] std::vector<double> marks() const { return plotMarks(*low_, *high_, isLog_); }

private:
    [[nodiscard]] double scaled(double value) const { return isLog_ ? std::log10(value) : value; }

    bool isLog_;
    double first_, last_;
    std::optional<double> low_, high_;
};

struct Axes {
    Axis x, y;

    explicit Axes(const Plot& plot) : x(plot.logX, kLeft, kWidth - kRight), y(plot.logY, kHeight - kBottom, kTop) {
        for (const PlotSeries& series : plot.series)
            for (const PlotPoint& point : series.points) {
                if (!shows(point)) continue;
                x.include(point.x);
                y.include(point.y);
            }
        for (const PlotLevel& level : plot.levels) y.include(level.y);
        x.settle();
        y.settle();
    }

    [[nodiscard]] bool shows(const PlotPoint& point) const { return x.shows(point.x) && y.shows(point.y); }
};

std::string text(double x, double y, std::string_view anchor, std::string_view words, std::string_view more = "") {
    return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text>\n", x, y, anchor, more,
                       escaped(words));
}

std::string line(double x1, double y1, double x2, double y2, std::string_view stroke) {
    return fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" {}/>\n", x1, y1, x2, y2, stroke);
}

std::string frame(const Plot& plot, const Axes& axes) {
    constexpr std::string_view kGrid = "stroke=\"#dddddd\"", kEdge = "stroke=\"#444444\"";
    const double right = kWidth - kRight, bottom = kHeight - kBottom;
    std::string svg;
    for (const double mark : axes.x.marks()) {
        const double x = axes.x.pixel(mark);
        svg += line(x, kTop, x, bottom, kGrid) + text(x, bottom + 18, "middle", shortNumber(mark));
    }
    for (const double mark : axes.y.marks()) {
        const double y = axes.y.pixel(mark);
        svg += line(kLeft, y, right, y, kGrid) + text(kLeft - 8, y + 4, "end", shortNumber(mark));
    }
    svg += line(kLeft, bottom, right, bottom, kEdge) + line(kLeft, kTop, kLeft, bottom, kEdge);
    svg += text((kLeft + right) / 2, kHeight - 16, "middle", plot.xName);
    svg += text(18, (kTop + bottom) / 2, "middle", plot.yName,
                fmt::format(" transform=\"rotate(-90 18 {:.1f})\"", (kTop + bottom) / 2));
    svg += text(kLeft, 24, "start", plot.title, " font-size=\"15\" font-weight=\"bold\"");
    return svg;
}

std::string drawn(const PlotSeries& series, const Axes& axes, std::string_view colour) {
    std::string path, marks;
    for (const PlotPoint& point : series.points) {
        if (!axes.shows(point)) continue;
        const double x = axes.x.pixel(point.x), y = axes.y.pixel(point.y);
        path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : " L", x, y);
        marks += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.5\" fill=\"{}\"/>\n", x, y, colour);
        if (!point.label.empty()) marks += text(x + 6, y - 6, "start", point.label);
    }
    if (path.empty()) return "";
    return fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"/>\n", path, colour) + marks;
}

}  // namespace

std::vector<double> plotMarks(double low, double high, bool isLog) {
    std::vector<double> marks;
    if (!(high > low) || (isLog && !(low > 0))) return marks;
    if (isLog) {
        const bool isWide = std::log10(high / low) > 3;
        for (int decade = int(std::floor(std::log10(low))); std::pow(10.0, decade) <= high; ++decade)
            for (const double step : {1.0, 2.0, 5.0})
                if (const double mark = step * std::pow(10.0, decade);
                    mark >= low && mark <= high && (step == 1 || !isWide))
                    marks.push_back(mark);
        return marks;
    }
    const double rough = (high - low) / 6, power = std::pow(10.0, std::floor(std::log10(rough)));
    const double step = power * (rough <= power ? 1 : rough <= 2 * power ? 2 : rough <= 5 * power ? 5 : 10);
    // The marks are counted, not added up, so that 0 is exact.
    for (auto i = int64_t(std::ceil(low / step)); double(i) * step <= high; ++i) marks.push_back(double(i) * step);
    return marks;
}

std::string plotSvg(const Plot& plot) {
    const Axes axes(plot);
    std::string svg = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
        "font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n",
        kWidth, kHeight);
    svg += frame(plot, axes);
    const double right = kWidth - kRight;
    for (const PlotLevel& level : plot.levels) {
        if (!axes.y.shows(level.y)) continue;
        const double y = axes.y.pixel(level.y);
        svg += line(kLeft, y, right, y, "stroke=\"#888888\" stroke-dasharray=\"5 4\"") +
               text(right - 4, y - 4, "end", level.name);
    }
    double legend = kTop + 8;
    for (size_t i = 0; i < plot.series.size(); ++i, legend += 18) {
        const std::string_view colour = kColours[i % kColours.size()];
        svg += drawn(plot.series[i], axes, colour);
        svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" fill=\"{}\"/>\n", right + 16, legend, colour);
        svg += text(right + 26, legend + 4, "start", plot.series[i].name);
    }
    return svg + "</svg>\n";
}

}  // namespace vcp
