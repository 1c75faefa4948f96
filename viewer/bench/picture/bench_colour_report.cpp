// The report of the benchmark of colours as JSON, CSV, Markdown and plots.
#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "viewer/bench/picture/bench_colour.h"
#include "viewer/bench/report/csv_text.h"
#include "viewer/bench/report/plot_svg.h"

namespace vcp {

namespace {

using Json = nlohmann::ordered_json;

Json toJson(const BenchColourRow& row) {
    const auto ofDive = [&](auto valueOf) { return row.dive ? Json(double(valueOf(*row.dive))) : Json(); };
    return {{"model", row.model},
            {"camera", row.camera},
            {"method", row.method},
            {"knob", row.knob},
            {"device", row.device},
            {"pixels", row.pixels},
            {"compared_pixels", row.comparedPixels},
            {"cell_px", row.cellPixels},
            {"delta_e_mean", row.differenceMean},
            {"delta_e_p50", row.difference.p50},
            {"delta_e_p95", row.difference.p95},
            {"delta_e_p99", row.difference.p99},
            {"delta_e_max", row.difference.max},
            {"flip_mean", row.flipMean},
            {"cpu_ms", row.cpuMs},
            {"geometry_bytes", row.geometryBytes},
            {"colour_bytes", row.colourBytes},
            {"bytes_read", row.bytesRead},
            {"resident_bytes", row.residentBytes},
            {"coarsest_level", row.coarsestLevel},
            {"finest_level", row.finestLevel},
            {"pop_mean", ofDive([](const DiveChange& dive) { return dive.popMean; })},
            {"pop_p99", ofDive([](const DiveChange& dive) { return dive.pop.p99; })},
            {"pop_max", ofDive([](const DiveChange& dive) { return dive.pop.max; })},
            {"change_mean", ofDive([](const DiveChange& dive) { return dive.changeMean; })},
            {"mesh_change_mean", ofDive([](const DiveChange& dive) { return dive.meshChangeMean; })}};
}

Json rowsOf(const BenchColourReport& report) {
    Json json = Json::array();
    for (const BenchColourRow& row : report.rows) json.push_back(toJson(row));
    return json;
}

struct Cost {
    std::string name, title;
    double (*of)(const BenchColourRow&);
};
const std::array<Cost, 2> kCosts = {
    {{"time", "processor time a frame, ms", [](const BenchColourRow& row) { return row.cpuMs; }},
     {"bytes", "stored bytes, geometry and colour",
      [](const BenchColourRow& row) { return double(row.geometryBytes + row.colourBytes); }}}};

std::string plotOf(const BenchColourReport& report, const std::string& model, const Cost& cost) {
    Plot plot{.title = model + ": difference of colour, mean",
              .xName = cost.title,
              .yName = "delta_e",
              .logX = true,
              .logY = true};
    for (const BenchColourRow& row : report.rows) {
        if (row.model != model) continue;
        const std::string name = row.method + ", " + row.knob;
        auto series = std::ranges::find(plot.series, name, &PlotSeries::name);
        if (series == plot.series.end()) series = plot.series.insert(series, PlotSeries{name, {}});
        series->points.push_back({cost.of(row), row.differenceMean, row.camera});
    }
    return plotSvg(plot);
}

}  // namespace

std::string benchColourJson(const BenchColourReport& report) {
    return Json{{"rows", rowsOf(report)}, {"warnings", report.warnings}}.dump();
}
std::string benchColourCsv(const BenchColourReport& report) { return csvOf(rowsOf(report)); }

namespace {

/// What changes along dives; empty where there is none.
std::string divesOf(const BenchColourReport& report) {
    std::string text;
    for (const BenchColourRow& row : report.rows) {
        if (!row.dive) continue;
        if (text.empty())
            text =
                "\n| model | camera | knob | pop mean | p99 | max | change mean | the mesh's |\n"
                "|---|---|---|---|---|---|---|---|\n";
        text += fmt::format("| {} | {} | {} | {:.2f} | {:.2f} | {:.1f} | {:.2f} | {:.2f} |\n", row.model, row.camera,
                            row.knob, row.dive->popMean, row.dive->pop.p99, row.dive->pop.max, row.dive->changeMean,
                            row.dive->meshChangeMean);
    }
    return text;
}

}  // namespace

std::string benchColourMarkdown(const BenchColourReport& report) {
    std::string text =
        "| model | camera | cell px | method | knob | pixels | \u0394E mean | p50 | p95 | p99 | max | FLIP | cpu ms | "
        "MB geometry | MB colour | MB read | MB resident | levels |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    for (const BenchColourRow& row : report.rows) {
        const std::string levels =
            row.finestLevel > 0 ? fmt::format("{}-{}", row.coarsestLevel, row.finestLevel) : std::string();
        text += fmt::format("| {} | {} | {:.2f} | {} | {} | {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.1f} | {:.4f} ",
                            row.model, row.camera, row.cellPixels, row.method, row.knob, row.comparedPixels,
                            row.differenceMean, row.difference.p50, row.difference.p95, row.difference.p99,
                            row.difference.max, row.flipMean);
        text += fmt::format("| {:.1f} | {:.2f} | {:.2f} | {:.2f} | {:.1f} | {} |\n", row.cpuMs,
                            double(row.geometryBytes) * 1e-6, double(row.colourBytes) * 1e-6,
                            double(row.bytesRead) * 1e-6, double(row.residentBytes) * 1e-6, levels);
    }
    text += divesOf(report);
    for (const std::string& warning : report.warnings) text += "\n" + warning + "\n";
    return text;
}

std::vector<std::pair<std::string, std::string>> benchColourPlots(const BenchColourReport& report) {
    std::vector<std::pair<std::string, std::string>> plots;
    std::vector<std::string> models;
    for (const BenchColourRow& row : report.rows)
        if (std::ranges::find(models, row.model) == models.end()) models.push_back(row.model);
    for (const std::string& model : models)
        for (const Cost& cost : kCosts)
            plots.emplace_back(fmt::format("bench_colour_{}_{}", model, cost.name), plotOf(report, model, cost));
    return plots;
}

}  // namespace vcp
