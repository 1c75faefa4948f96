// The benchmarks' reports as JSON, CSV and Markdown.
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "viewer/bench_build.h"
#include "viewer/bench_rays.h"

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
    return {{"model", row.model},
            {"triangles", row.triangles},
            {"seconds", row.seconds},
            {"triangles_per_second", row.trianglesPerSecond},
            {"peak_rss_bytes", row.peakRssBytes},
            {"file_bytes", row.fileBytes},
            {"embree_bvh_seconds", row.embreeBvhSeconds},
            {"ratio_to_embree", row.ratioToEmbree}};
}

template <class Row>
Json rowsOf(const std::vector<Row>& rows) {
    Json json = Json::array();
    for (const Row& row : rows) json.push_back(toJson(row));
    return json;
}

std::string quoted(const Json& value) {
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
        "Embree |\n"
        "|---|---|---|---|---|---|---|---|---|\n";
    for (const BenchBuildRow& row : report.rows)
        text +=
            fmt::format("| {} | {} | {:.2f} | {:.3f} | {:.0f} | {:.1f} | {:.1f} | {:.3f} | {:.3f} |\n", row.model,
                        row.triangles, row.seconds, row.trianglesPerSecond * 1e-6,
                        static_cast<double>(row.peakRssBytes) * 1e-6, static_cast<double>(row.fileBytes) * 1e-6,
                        static_cast<double>(row.fileBytes) / static_cast<double>(std::max<uint64_t>(row.triangles, 1)),
                        row.embreeBvhSeconds, row.ratioToEmbree);
    return text;
}

}  // namespace vcp
