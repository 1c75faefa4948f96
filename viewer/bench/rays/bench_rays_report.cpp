// The report of the ray benchmark as JSON, CSV, Markdown and plots.
#include <algorithm>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "viewer/bench/rays/bench_rays.h"
#include "viewer/bench/rays/levels_saved.h"
#include "viewer/bench/rays/paper_tables.h"
#include "viewer/bench/report/csv_text.h"
#include "viewer/bench/report/plot_svg.h"

namespace vcp {

namespace {

using Json = nlohmann::ordered_json;

Json toJson(const BenchRaysRow& row) {
    const RaySummary& classes = row.classes;
    const Quantiles &distance = classes.distanceCells, &depth = classes.depthCells, &normal = classes.normalDegrees;
    Json json = {{"model", row.model},         {"camera", row.camera},
                 {"method", row.method},       {"knob", row.knob},
                 {"device", row.device},       {"rays", row.rays},
                 {"ns_per_ray", row.nsPerRay}, {"ratio_to_embree", row.ratioToEmbree}};
    for (size_t i = 0; i < kRayClassNames.size(); ++i) json[std::string(kRayClassNames[i])] = classes.fractions[i];
    json["p50_cells"] = distance.p50;
    json["p95_cells"] = distance.p95;
    json["p99_cells"] = distance.p99;
    json["max_cells"] = distance.max;
    // Columns are the same for all rows; what a method does not count ray by ray is null.
    const auto work = [&](const std::string& name, const WorkHistogram& rays) {
        json[name + "_mean"] = rays.mean();
        json[name + "_p95"] = rays.empty() ? Json() : Json(rays.quantile(0.95));
        json[name + "_p99"] = rays.empty() ? Json() : Json(rays.quantile(0.99));
    };
    work("steps", row.work.steps);
    work("cells", row.work.cells);
    work("fetches", row.work.fetches);
    json["bytes"] = row.bytes;
    json["judged_rays"] = classes.judged;
    json["holes"] = classes.holes;
    json["beyond_certified"] = classes.beyondCertified;
    json["max_over_certified"] = classes.maxOverCertified;
    json["depth_p50_cells"] = depth.p50;
    json["depth_p95_cells"] = depth.p95;
    json["depth_p99_cells"] = depth.p99;
    json["depth_max_cells"] = depth.max;
    json["normal_p50_degrees"] = normal.p50;
    json["normal_p95_degrees"] = normal.p95;
    json["normal_p99_degrees"] = normal.p99;
    json["cell"] = row.cell;
    return json;
}

Json toJson(const PrecisionRow& row) {
    return {{"hits", row.hits},
            {"other_outcome", row.otherOutcome},
            {"depth_p50_cells", row.depthCells.p50},
            {"depth_p99_cells", row.depthCells.p99},
            {"depth_max_cells", row.depthCells.max},
            {"holes", row.holes},
            {"p50_cells", row.distanceCells.p50},
            {"p99_cells", row.distanceCells.p99},
            {"max_cells", row.distanceCells.max}};
}

Json toJson(const StabilityRow& row) {
    return {{"cell", row.cell},
            {"origin_cells", row.originCells},
            {"rays", row.rays},
            {"certified_cells", row.certifiedCells},
            {"double", toJson(row.doubles)},
            {"float", toJson(row.floats)},
            {"device", toJson(row.device)}};
}

Json rowsOf(const BenchRaysReport& report) {
    Json json = Json::array();
    for (const BenchRaysRow& row : report.rows) json.push_back(toJson(row));
    return json;
}

double wrongRays(const RaySummary& classes) {
    return classes.fraction(RayClass::Missed) + classes.fraction(RayClass::False) +
           classes.fraction(RayClass::WrongSheet) + classes.fraction(RayClass::Unresolved);
}

struct PlottedValue {
    std::string name, title, axis;
    double (*of)(const BenchRaysRow&);
};
const std::array<PlottedValue, 4> kPlotted = {
    {{"p50", "Hit error, p50", "cells", [](const BenchRaysRow& row) { return row.classes.distanceCells.p50; }},
     {"p95", "Hit error, p95", "cells", [](const BenchRaysRow& row) { return row.classes.distanceCells.p95; }},
     {"p99", "Hit error, p99", "cells", [](const BenchRaysRow& row) { return row.classes.distanceCells.p99; }},
     {"wrong", "Rays missed, false, on the wrong sheet or unresolved", "fraction of all rays; none: half a ray",
      [](const BenchRaysRow& row) {
          return std::max(wrongRays(row.classes), 0.5 / double(std::max<uint64_t>(row.classes.judged, 1)));
      }}}};

/// Makes a plot: one series a method, one point a value of its knob: means over the rows, which differ by camera.
std::string plotOf(const std::vector<const BenchRaysRow*>& rows, const PlottedValue& value, bool againstTime) {
    Plot plot{.title = rows.front()->model + ": " + value.title,
              .xName = againstTime ? "ns a ray" : "bytes",
              .yName = value.axis,
              .logX = true,
              .logY = true};
    std::vector<std::pair<std::string, std::string>> seen;
    for (const BenchRaysRow* first : rows) {
        const std::pair key(first->method, first->knob);
        if (std::ranges::find(seen, key) != seen.end()) continue;
        seen.push_back(key);
        PlotPoint point{.label = first->knob};
        int count = 0;
        for (const BenchRaysRow* row : rows) {
            if (std::pair(row->method, row->knob) != key) continue;
            point.x += againstTime ? row->nsPerRay : double(row->bytes);
            point.y += value.of(*row);
            ++count;
        }
        point.x /= count;
        point.y /= count;
        auto series = std::ranges::find(plot.series, first->method, &PlotSeries::name);
        if (series == plot.series.end()) series = plot.series.insert(series, PlotSeries{first->method, {}});
        series->points.push_back(std::move(point));
    }
    return plotSvg(plot);
}

}  // namespace

std::vector<std::string> modelsOf(const BenchRaysReport& report) {
    std::vector<std::string> models;
    for (const BenchRaysRow& row : report.rows)
        if (std::ranges::find(models, row.model) == models.end()) models.push_back(row.model);
    return models;
}

std::string benchRaysJson(const BenchRaysReport& report) {
    Json json{{"rows", rowsOf(report)}};
    for (const StabilityRow& row : report.stability) json["stability"].push_back(toJson(row));
    return json.dump();
}
std::string benchRaysCsv(const BenchRaysReport& report) { return csvOf(rowsOf(report)); }

std::string benchRaysMarkdown(const BenchRaysReport& report) {
    std::string text =
        "| model | camera | method | knob | Mray/s | of Embree | hit % | missed % | false % | wrong sheet % | "
        "unresolved % | holes | beyond certified | p50 | p95 | p99 | max cells | normal p50 | p95 | p99 | steps | p99 "
        "| cells | "
        "p99 | fetches | "
        "p99 | MB |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|"
        "\n";
    const auto tail = [](const WorkHistogram& rays) {
        return rays.empty() ? std::string() : fmt::format("{}", rays.quantile(0.99));
    };
    for (const BenchRaysRow& row : report.rows) {
        const RaySummary& classes = row.classes;
        const Quantiles& distance = classes.distanceCells;
        const auto percent = [&](RayClass rayClass) { return 100 * classes.fraction(rayClass); };
        text += fmt::format(
            "| {} | {} | {} | {} | {:.2f} | {:.3f} | {:.2f} | {:.5f} | {:.5f} | {:.5f} | {:.5f} | {} | {} ", row.model,
            row.camera, row.method, row.knob, 1e3 / row.nsPerRay, row.ratioToEmbree, percent(RayClass::Hit),
            percent(RayClass::Missed), percent(RayClass::False), percent(RayClass::WrongSheet),
            percent(RayClass::Unresolved), classes.holes, classes.beyondCertified);
        text += fmt::format(
            "| {:.5f} | {:.5f} | {:.5f} | {:.4f} | {:.1f}\u00b0 | {:.1f}\u00b0 | {:.1f}\u00b0 | {:.1f} | {} | {:.1f} | "
            "{} | {:.1f} | {} | {:.1f} |\n",
            distance.p50, distance.p95, distance.p99, distance.max, classes.normalDegrees.p50,
            classes.normalDegrees.p95, classes.normalDegrees.p99, row.work.steps.mean(), tail(row.work.steps),
            row.work.cells.mean(), tail(row.work.cells), row.work.fetches.mean(), tail(row.work.fetches),
            double(row.bytes) * 1e-6);
    }
    return text + besidePaperMarkdown(report) + levelsSavedMarkdown(report) + stabilityMarkdown(report.stability);
}

std::vector<std::pair<std::string, std::string>> benchRaysPlots(const BenchRaysReport& report) {
    std::vector<std::pair<std::string, std::string>> plots;
    for (const std::string& model : modelsOf(report)) {
        std::vector<const BenchRaysRow*> rows;
        for (const BenchRaysRow& row : report.rows)
            if (row.model == model) rows.push_back(&row);
        for (const PlottedValue& value : kPlotted)
            for (const bool againstTime : {true, false})
                plots.emplace_back(
                    fmt::format("bench_rays_{}_{}_{}", model, value.name, againstTime ? "time" : "bytes"),
                    plotOf(rows, value, againstTime));
    }
    return plots;
}

}  // namespace vcp
