// The benchmarks' reports as JSON, CSV and Markdown.
#include <algorithm>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "viewer/bench_build.h"
#include "viewer/bench_rays.h"
#include "viewer/plot_svg.h"

namespace vcp {

namespace {

using Json = nlohmann::ordered_json;

Json toJson(const BenchRaysRow& row) {
    const Quantiles distance = row.classes.distanceCells(row.cell), depth = row.classes.depthCells(row.cell);
    const Quantiles normal = row.classes.normalDegrees();
    Json json = {{"model", row.model},         {"camera", row.camera},
                 {"method", row.method},       {"knob", row.knob},
                 {"device", row.device},       {"rays", row.rays},
                 {"ns_per_ray", row.nsPerRay}, {"ratio_to_embree", row.ratioToEmbree}};
    for (size_t i = 0; i < kRayClassNames.size(); ++i)
        json[std::string(kRayClassNames[i])] = row.classes.fraction(static_cast<RayClass>(i));
    json["p50_cells"] = distance.p50;
    json["p95_cells"] = distance.p95;
    json["p99_cells"] = distance.p99;
    json["max_cells"] = distance.max;
    json["steps_mean"] = row.stepsMean;
    json["fetches_mean"] = row.fetchesMean;
    json["bytes"] = row.bytes;
    json["judged_rays"] = row.classes.rays();
    json["holes"] = row.classes.holes();
    json["beyond_certified"] = row.classes.tooFar();
    json["max_over_certified"] = row.classes.overCertifiedMax();
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
    // Columns are the same for all rows; what was not measured is null.
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

template <class Row>
Json rowsOf(const std::vector<Row>& rows) {
    Json json = Json::array();
    for (const Row& row : rows) json.push_back(toJson(row));
    return json;
}

std::string quoted(const Json& value) {
    if (value.is_null()) return "";
    if (!value.is_string()) return value.dump();
    std::string text = "\"";
    for (const char c : value.get<std::string>()) text += c == '"' ? std::string("\"\"") : std::string(1, c);
    return text + "\"";
}

/// One column a field, in the order of the JSON.
std::string csvOf(const Json& rows) {
    std::string text;
    if (rows.empty()) return text;
    const auto line = [&](const Json& row, bool names) {
        for (const auto& [name, value] : row.items()) text += (names ? name : quoted(value)) + ',';
        text.back() = '\n';
    };
    line(rows.front(), true);
    for (const Json& row : rows) line(row, false);
    return text;
}

}  // namespace

std::string benchRaysJson(const BenchRaysReport& report) { return Json{{"rows", rowsOf(report.rows)}}.dump(); }
std::string benchRaysCsv(const BenchRaysReport& report) { return csvOf(rowsOf(report.rows)); }
std::string benchBuildJson(const BenchBuildReport& report) { return Json{{"rows", rowsOf(report.rows)}}.dump(); }
std::string benchBuildCsv(const BenchBuildReport& report) { return csvOf(rowsOf(report.rows)); }

std::string benchRaysMarkdown(const BenchRaysReport& report) {
    std::string text =
        "| model | camera | method | Mray/s | of Embree | hit % | missed % | false % | wrong sheet % | holes | beyond "
        "certified | p50 | p99 | max cells | normal p50 |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    for (const BenchRaysRow& row : report.rows) {
        const Quantiles distance = row.classes.distanceCells(row.cell);
        const auto percent = [&](RayClass rayClass) { return 100 * row.classes.fraction(rayClass); };
        text += fmt::format(
            "| {} | {} | {} | {:.2f} | {:.3f} | {:.2f} | {:.5f} | {:.5f} | {:.5f} | {} | {} | {:.5f} | {:.5f} | {:.4f} "
            "| {:.1f}\u00b0 |\n",
            row.model, row.camera, row.method, 1e3 / row.nsPerRay, row.ratioToEmbree, percent(RayClass::Hit),
            percent(RayClass::Missed), percent(RayClass::False), percent(RayClass::WrongSheet), row.classes.holes(),
            row.classes.tooFar(), distance.p50, distance.p99, distance.max, row.classes.normalDegrees().p50);
    }
    return text;
}

std::string benchBuildMarkdown(const BenchBuildReport& report) {
    std::string text =
        "| model | triangles | seconds | M triangles/s | peak MB | file MB | bytes a triangle | Embree BVH s | of "
        "Embree | tolerance | certified | p50 | p99 | max cells |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    for (const BenchBuildRow& row : report.rows) {
        text += fmt::format("| {} | {} | {:.2f} | {:.3f} | {:.0f} | {:.1f} | {:.1f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} ",
                            row.model, row.triangles, row.seconds, row.trianglesPerSecond * 1e-6,
                            static_cast<double>(row.peakRssBytes) * 1e-6, static_cast<double>(row.fileBytes) * 1e-6,
                            row.bytesPerTriangle(), row.embreeBvhSeconds, row.ratioToEmbree, row.errorCells, row.certifiedCells);
        if (row.distance) {
            const Quantiles cells = row.distanceCells();
            text += fmt::format("| {:.4f} | {:.4f} | {:.4f} |\n", cells.p50, cells.p99, cells.max);
        } else
            text += "| | | |\n";
    }
    return text;
}

std::vector<std::pair<std::string, std::string>> benchBuildPlots(const BenchBuildReport& report) {
    Plot cost{.title = "Cost of a build", .xName = "triangles", .yName = "microseconds a triangle", .logX = true, .logY = false};
    Plot memory{.title = "Peak memory of a build", .xName = "triangles", .yName = "resident bytes", .logX = true, .logY = true};
    Plot bytes{.title = "File size against measured error", .xName = "p99 distance, cells", .yName = "bytes a triangle", .logX = true, .logY = true};
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
            const double triangles = static_cast<double>(row.triangles);
            const std::string series = row.isGenerated ? "generated scans" : row.model;
            add(cost, series, {triangles, 1e6 * row.seconds / triangles});
            add(memory, series, {triangles, static_cast<double>(row.peakRssBytes)});
        }
        last = &row;
        if (row.distance) add(bytes, row.model, {row.distanceCells().p99, row.bytesPerTriangle(), fmt::format("{:.3g}", row.errorCells)});
    }
    // In the order of the error, the default among the others.
    for (PlotSeries& series : bytes.series)
        std::ranges::sort(series.points, {}, &PlotPoint::x);
    std::vector<std::pair<std::string, std::string>> plots = {{"bench_build_cost", plotSvg(cost)}, {"bench_build_memory", plotSvg(memory)}};
    if (!bytes.series.empty()) plots.emplace_back("bench_build_bytes", plotSvg(bytes));
    return plots;
}

}  // namespace vcp
