// The report of the benchmark of pictures as JSON, CSV, Markdown and plots.
#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "viewer/bench/picture/bench_picture.h"
#include "viewer/bench/report/csv_text.h"
#include "viewer/bench/report/plot_svg.h"

namespace vcp {

namespace {

using Json = nlohmann::ordered_json;

Json toJson(const BenchPictureRow& row) {
    return {{"model", row.model},
            {"camera", row.camera},
            {"method", row.method},
            {"knob", row.knob},
            {"device", row.device},
            {"pixels", row.pixels},
            {"hit_pixels", row.hitPixels},
            {"cell_px", row.cellPixels},
            {"rmse", row.rmse},
            {"flip_mean", row.flipMean},
            {"flip_p99", row.flipP99},
            {"isolated_pixels", row.isolatedPixels},
            {"isolated_in_mesh", row.isolatedInMesh},
            {"silhouette_pixels", row.silhouettePixels},
            {"silhouette_p50_px", row.silhouetteDistance.p50},
            {"silhouette_p95_px", row.silhouetteDistance.p95},
            {"silhouette_max_px", row.silhouetteDistance.max},
            {"normal_p50_degrees", row.normalDegrees.p50},
            {"normal_p95_degrees", row.normalDegrees.p95},
            {"normal_p99_degrees", row.normalDegrees.p99},
            {"cpu_ms", row.cpuMs},
            {"bytes_read", row.bytesRead},
            {"resident_bytes", row.residentBytes},
            {"coarsest_level", row.coarsestLevel},
            {"finest_level", row.finestLevel}};
}

Json rowsOf(const BenchPictureReport& report) {
    Json json = Json::array();
    for (const BenchPictureRow& row : report.rows) json.push_back(toJson(row));
    return json;
}

struct PlottedValue {
    std::string name, title;
    double (*of)(const BenchPictureRow&);
};
const std::array<PlottedValue, 2> kPlotted = {
    {{"flip", "FLIP, mean", [](const BenchPictureRow& row) { return row.flipMean; }},
     {"rmse", "Error of light, root of the mean square", [](const BenchPictureRow& row) { return row.rmse; }}}};
const std::array<PlottedValue, 2> kCosts = {
    {{"time", "processor time a frame, ms", [](const BenchPictureRow& row) { return row.cpuMs; }},
     {"bytes", "resident bytes", [](const BenchPictureRow& row) { return double(row.residentBytes); }}}};

std::string plotOf(const BenchPictureReport& report, const std::string& model, const PlottedValue& value,
                   const PlottedValue& cost) {
    Plot plot{
        .title = model + ": " + value.title, .xName = cost.title, .yName = value.name, .logX = true, .logY = true};
    for (const BenchPictureRow& row : report.rows) {
        if (row.model != model) continue;
        const std::string name = row.knob.empty() ? row.method : row.method + ", " + row.knob;
        auto series = std::ranges::find(plot.series, name, &PlotSeries::name);
        if (series == plot.series.end()) series = plot.series.insert(series, PlotSeries{name, {}});
        series->points.push_back({cost.of(row), value.of(row), row.camera});
    }
    return plotSvg(plot);
}

}  // namespace

std::string benchPictureJson(const BenchPictureReport& report) { return Json{{"rows", rowsOf(report)}}.dump(); }
std::string benchPictureCsv(const BenchPictureReport& report) { return csvOf(rowsOf(report)); }

std::string benchPictureMarkdown(const BenchPictureReport& report) {
    std::string text =
        "| model | camera | cell px | method | knob | RMSE | FLIP mean | p99 | isolated | silhouette px | p95 | "
        "normal p50 | p95 | p99 | cpu ms | MB read | MB resident | levels |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    for (const BenchPictureRow& row : report.rows) {
        text += fmt::format("| {} | {} | {:.2f} | {} | {} | {:.4f} | {:.4f} | {:.3f} | {} | {} | {:.1f} ", row.model,
                            row.camera, row.cellPixels, row.method, row.knob, row.rmse, row.flipMean, row.flipP99,
                            row.isolatedPixels, row.silhouettePixels, row.silhouetteDistance.p95);
        const std::string levels =
            row.finestLevel > 0 ? fmt::format("{}-{}", row.coarsestLevel, row.finestLevel) : std::string();
        text += fmt::format("| {:.2f}\u00b0 | {:.2f}\u00b0 | {:.2f}\u00b0 | {:.1f} | {:.2f} | {:.1f} | {} |\n",
                            row.normalDegrees.p50, row.normalDegrees.p95, row.normalDegrees.p99, row.cpuMs,
                            double(row.bytesRead) * 1e-6, double(row.residentBytes) * 1e-6, levels);
    }
    return text;
}

std::vector<std::pair<std::string, std::string>> benchPicturePlots(const BenchPictureReport& report) {
    std::vector<std::pair<std::string, std::string>> plots;
    std::vector<std::string> models;
    for (const BenchPictureRow& row : report.rows)
        if (std::ranges::find(models, row.model) == models.end()) models.push_back(row.model);
    for (const std::string& model : models)
        for (const PlottedValue& value : kPlotted)
            for (const PlottedValue& cost : kCosts)
                plots.emplace_back(fmt::format("bench_picture_{}_{}_{}", model, value.name, cost.name),
                                   plotOf(report, model, value, cost));
    return plots;
}

}  // namespace vcp
