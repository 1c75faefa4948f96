// The report of the build benchmark as JSON, CSV, Markdown and plots.
#include <algorithm>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "viewer/bench/bench_build.h"
#include "viewer/bench/report/csv_text.h"
#include "viewer/bench/report/plot_svg.h"

namespace vcp {

namespace {

using Json = nlohmann::ordered_json;

Json toJson(const BenchBuildRow& row) {
    Json json = {{"model", row.model},
                 {"triangles", row.triangles},
                 {"seconds", row.seconds},
                 {"triangles_per_second", row.trianglesPerSecond},
                 {"peak_rss_bytes", row.peakRssBytes},
                 {"file_bytes", row.fileBytes},
                 {"embree_bvh_seconds", row.embreeBvhSeconds},
                 {"ratio_to_embree", row.ratioToEmbree},
                 {"generated", row.isGenerated},
                 {"cpu_seconds", row.cpuSeconds},
                 {"memory_bytes", row.memoryBytes},
                 {"temp_bytes", row.tempBytes},
                 {"bytes_per_triangle", row.bytesPerTriangle()},
                 {"leaves", row.leaves},
                 {"hard_leaves", row.hardLeaves},
                 {"cell", row.cell},
                 {"error_cells", row.errorCells},
                 {"certified_max_cells", row.certifiedCells}};
    // Columns are the same for all rows; values that were not measured are null.
    const auto add = [&](const std::string& prefix, const std::optional<Quantiles>& cells) {
        json[prefix + "p50_cells"] = cells ? Json(cells->p50) : Json();
        json[prefix + "p99_cells"] = cells ? Json(cells->p99) : Json();
        json[prefix + "max_cells"] = cells ? Json(cells->max) : Json();
    };
    const auto inCells = [&](const Quantiles& world) {
        return Quantiles{world.p50 / row.cell, world.p95 / row.cell, world.p99 / row.cell, world.max / row.cell};
    };
    const auto& distance = row.distance;
    add("", distance ? std::optional(row.distanceCells()) : std::nullopt);
    add("mesh_to_surface_", distance ? std::optional(inCells(distance->meshToSurface)) : std::nullopt);
    add("surface_to_mesh_", distance ? std::optional(inCells(distance->surfaceToMesh)) : std::nullopt);
    json["samples"] = distance ? distance->samples : 0;
    return json;
}

Json rowsOf(const BenchBuildReport& report) {
    Json json = Json::array();
    for (const BenchBuildRow& row : report.rows) json.push_back(toJson(row));
    return json;
}

}  // namespace

std::string benchBuildJson(const BenchBuildReport& report) { return Json{{"rows", rowsOf(report)}}.dump(); }
std::string benchBuildCsv(const BenchBuildReport& report) { return csvOf(rowsOf(report)); }

std::string benchBuildMarkdown(const BenchBuildReport& report) {
    std::string text =
        "| model | triangles | seconds | M triangles/s | peak MB | file MB | bytes a triangle | Embree BVH s | of "
        "Embree | tolerance | certified | p50 | p99 | max cells |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    for (const BenchBuildRow& row : report.rows) {
        text +=
            fmt::format("| {} | {} | {:.2f} | {:.3f} | {:.0f} | {:.1f} | {:.1f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} ",
                        row.model, row.triangles, row.seconds, row.trianglesPerSecond * 1e-6,
                        double(row.peakRssBytes) * 1e-6, double(row.fileBytes) * 1e-6, row.bytesPerTriangle(),
                        row.embreeBvhSeconds, row.ratioToEmbree, row.errorCells, row.certifiedCells);
        if (row.distance) {
            const Quantiles cells = row.distanceCells();
            text += fmt::format("| {:.4f} | {:.4f} | {:.4f} |\n", cells.p50, cells.p99, cells.max);
        } else
            text += "| | | |\n";
    }
    return text;
}

std::vector<std::pair<std::string, std::string>> benchBuildPlots(const BenchBuildReport& report) {
    Plot cost{.title = "Cost of a build",
              .xName = "triangles",
              .yName = "microseconds a triangle",
              .logX = true,
              .logY = false};
    Plot memory{
        .title = "Peak memory of a build", .xName = "triangles", .yName = "resident bytes", .logX = true, .logY = true};
    Plot bytes{.title = "File size against measured error",
               .xName = "p99 distance, cells",
               .yName = "bytes a triangle",
               .logX = true,
               .logY = true};
    bytes.levels = {{"Nexus", 30}, {"Nanite", 13}, {"Nexus, compressed and quantised", 4}};
    const auto add = [](Plot& plot, const std::string& name, PlotPoint point) {
        const auto same = [&](const PlotSeries& series) { return series.name == name; };
        auto series = std::find_if(plot.series.begin(), plot.series.end(), same);
        if (series == plot.series.end()) series = plot.series.insert(series, PlotSeries{name, {}});
        series->points.push_back(std::move(point));
    };
    const BenchBuildRow* last = nullptr;
    for (const BenchBuildRow& row : report.rows) {
        // The first row of a model is the default build.
        if (const bool isDefault = !last || last->model != row.model; isDefault) {
            const double triangles = double(row.triangles);
            const std::string series = row.isGenerated ? "generated scans" : row.model;
            add(cost, series, {triangles, 1e6 * row.seconds / triangles});
            add(memory, series, {triangles, double(row.peakRssBytes)});
        }
        last = &row;
        if (row.distance)
            add(bytes, row.model,
                {row.distanceCells().p99, row.bytesPerTriangle(), fmt::format("{:.3g}", row.errorCells)});
    }
    // The points are sorted by error, with the default among the others.
    for (PlotSeries& series : bytes.series) std::ranges::sort(series.points, {}, &PlotPoint::x);
    std::vector<std::pair<std::string, std::string>> plots = {{"bench_build_cost", plotSvg(cost)},
                                                              {"bench_build_memory", plotSvg(memory)}};
    if (!bytes.series.empty()) plots.emplace_back("bench_build_bytes", plotSvg(bytes));
    return plots;
}

}  // namespace vcp
