// A plot as an SVG picture: points and lines over linear or logarithmic axes, for the reports of the benchmarks.
#pragma once

#include <string>
#include <vector>

namespace vcp {

struct PlotPoint {
    double x = 0, y = 0;
    std::string label = {};  ///< written beside the point; may be empty
};

struct PlotSeries {
    std::string name;
    std::vector<PlotPoint> points;  ///< joined in this order
};

/// A known value, drawn as a dashed line across the plot.
struct PlotLevel {
    std::string name;
    double y = 0;
};

struct Plot {
    std::string title, xName, yName;
    bool logX = false, logY = false;
    std::vector<PlotSeries> series = {};
    std::vector<PlotLevel> levels = {};
};

/// Returns the values where an axis has its marks: 1, 2 and 5 times powers of ten that lie in [low, high]; on a
/// logarithmic axis of many decades only the powers.
std::vector<double> plotMarks(double low, double high, bool isLog);

/// Returns the picture. Values that are not finite, or not positive on a logarithmic axis, are left out; a plot of
/// nothing is an empty frame.
std::string plotSvg(const Plot& plot);

}  // namespace vcp
