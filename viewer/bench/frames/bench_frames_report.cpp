// The report of the benchmark of frames as JSON, CSV and Markdown.
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "viewer/bench/frames/bench_frames.h"
#include "viewer/bench/report/csv_text.h"

namespace vcp {

namespace {

using Json = nlohmann::ordered_json;

Json rowsOf(const std::vector<BenchFramesRow>& rows) {
    Json json = Json::array();
    for (const BenchFramesRow& row : rows)
        json.push_back({{"model", row.model},
                        {"camera", row.camera},
                        {"frame", row.frame},
                        {"rays", row.rays},
                        {"light_rays", row.lightRays},
                        {"hits", row.hits},
                        {"other_hits", row.otherHits},
                        {"wall_ms", row.host.wallMs},
                        {"cpu_ms", row.host.cpuMs},
                        {"embree_wall_ms", row.embree.wallMs},
                        {"embree_cpu_ms", row.embree.cpuMs},
                        {"ratio_to_embree", row.wallRatio()},
                        {"cpu_ratio_to_embree", row.cpuRatio()},
                        {"difference_mean", row.differenceMean}});
    return json;
}

/// Returns the ratio of what two rows' light rays alone cost, or nothing where there are none. `lit`: the same frame
/// without them.
std::string lightRaysRatio(const BenchFramesRow& row, const BenchFramesRow* lit) {
    if (lit == nullptr || row.lightRays == 0) return "";
    const double ours = row.host.cpuMs - lit->host.cpuMs, theirs = row.embree.cpuMs - lit->embree.cpuMs;
    return ours > 0 && theirs > 0 ? fmt::format("{:.2f}", theirs / ours) : "";
}

}  // namespace

std::string benchFramesJson(const std::vector<BenchFramesRow>& rows) { return Json{{"rows", rowsOf(rows)}}.dump(); }
std::string benchFramesCsv(const std::vector<BenchFramesRow>& rows) { return csvOf(rowsOf(rows)); }

std::string benchFramesMarkdown(const std::vector<BenchFramesRow>& rows) {
    std::string text =
        "| model | camera | frame | light rays | host ms | cpu ms | Embree ms | cpu ms | of Embree | by cpu | light "
        "rays by cpu | difference of 255 |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    const BenchFramesRow* lit = nullptr;
    for (const BenchFramesRow& row : rows) {
        if (row.frame == "trace") lit = nullptr;
        text += fmt::format(
            "| {} | {} | {} | {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.2f} | {:.2f} | {} | {:.2f} |\n", row.model,
            row.camera, row.frame, row.lightRays, row.host.wallMs, row.host.cpuMs, row.embree.wallMs, row.embree.cpuMs,
            row.wallRatio(), row.cpuRatio(), lightRaysRatio(row, lit), row.differenceMean);
        if (row.frame == "light") lit = &row;
    }
    return text;
}

}  // namespace vcp
