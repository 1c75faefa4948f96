// The reports of vcp stress and vcp bench stream as JSON, CSV, Markdown and plots.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "viewer/bench/report/csv_text.h"
#include "viewer/bench/report/plot_svg.h"
#include "viewer/bench/stress/bench_stream.h"
#include "viewer/scene/option_values.h"

namespace vcp {

namespace {

using Json = nlohmann::ordered_json;

Json toJson(const Quantiles& q) { return {{"p50", q.p50}, {"p95", q.p95}, {"p99", q.p99}, {"max", q.max}}; }

Json toJson(const StressSample& s) {
    return {{"seconds", s.seconds},          {"frame_ms", s.frameMs},
            {"error_pixels", s.errorPixels}, {"resident_bytes", s.residentBytes},
            {"requests", s.pending},         {"loads", s.loads},
            {"evictions", s.evictions},      {"missing", s.missing}};
}

Json toJson(const OrderCurve& curve) {
    Json samples = Json::array();
    for (const OrderSample& s : curve.samples)
        samples.push_back({{"seconds", s.seconds}, {"bytes", s.bytes}, {"error", s.error}});
    return {{"order", nameOf(curve.order)},
            {"mean_error", curve.meanError},
            {"bytes_to_tenth", curve.bytesToTenth},
            {"samples", samples}};
}

std::string ordersMarkdown(const std::vector<OrderCurve>& orders) {
    if (orders.empty()) return "";
    std::string text =
        "\nThe path's last view from nothing, pages in different orders; error: root mean square of colours (0 to 255) "
        "against the settled picture.\n\n"
        "| order | mean error over the bytes | read until a tenth of the error | read |\n|---|---|---|---|\n";
    for (const OrderCurve& curve : orders)
        text += fmt::format("| {} | {:.3f} | {} | {} |\n", nameOf(curve.order), curve.meanError,
                            formatBytes(curve.bytesToTenth),
                            formatBytes(curve.samples.empty() ? 0 : curve.samples.back().bytes));
    return text + "\n![orders of arrival](stress_orders.svg)\n";
}

Json toJson(const StressViews& v) {
    return {{"views", v.views},
            {"settled_seconds", v.settledSeconds},
            {"resident_bytes_max", v.residentBytesMax},
            {"pages_wanted", v.pagesWanted},
            {"pages_resident", v.pagesResident},
            {"loads", v.loads},
            {"relaxed", v.relaxed},
            {"identical", v.identical}};
}

std::string viewsMarkdown(const std::optional<StressViews>& views) {
    if (!views) return "";
    return fmt::format(
        "\n{} views shared the pool: {} pages wanted by each summed up, {} resident together, at most {}. All had "
        "settled {:.3f} s after the last "
        "frame; {} showed what they show alone, the budget was too small for {}.\n",
        views->views, formatCount(views->pagesWanted), formatCount(views->pagesResident),
        formatBytes(views->residentBytesMax), views->settledSeconds, views->identical, views->relaxed);
}

double ratio(double a, double b) { return b > 0 ? a / b : 0; }

std::string row(const std::string& name, const Quantiles& q) {
    return fmt::format("| {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} |\n", name, q.p50, q.p95, q.p99, q.max);
}

/// Returns the fields that are one number or word each.
Json summaryOf(const StressReport& r) {
    return {{"name", r.name},
            {"path", r.path},
            {"faults", r.faults},
            {"seed", r.seed},
            {"frames", r.frames},
            {"device", r.device},
            {"first_picture_seconds", r.firstPictureSeconds},
            {"detail_90_seconds", r.detail90Seconds},
            {"settled_seconds", r.settledSeconds},
            {"path_settled_seconds", r.pathSettledSeconds},
            {"bytes_read", r.bytesRead},
            {"bytes_needed", r.bytesNeeded},
            {"reads", r.requests},
            {"failed_reads", r.failures},
            {"pages_given_up", r.pagesGivenUp},
            {"budget_bytes", r.budgetBytes},
            {"resident_bytes_max", r.residentBytesMax},
            {"ram_bytes", r.ramBytes},
            {"held_bytes_max", r.heldBytesMax},
            {"loads", r.loads},
            {"evictions", r.evictions},
            {"relaxed", r.relaxed},
            {"error_pixels", r.errorPixels},
            {"frame_ms", toJson(r.frameMs)},
            {"frame_ms_no_loads", toJson(r.frameMsNoLoads)},
            {"violations", r.violations}};
}

/// Makes one field a column: `frame_ms` becomes `frame_ms_p50` and so on.
Json flatOf(const StressReport& report) {
    const Json summary = summaryOf(report);
    Json flat;
    for (const auto& [name, value] : summary.items()) {
        if (value.is_object())
            for (const auto& [part, number] : value.items()) flat[fmt::format("{}_{}", name, part)] = number;
        else
            flat[name] = value.is_array() ? Json(fmt::format("{}", fmt::join(report.violations, "; "))) : value;
    }
    return flat;
}

std::string timesOf(const Quantiles& q) {
    return fmt::format("{:.0f} / {:.0f} / {:.0f} / {:.0f}", q.p50, q.p95, q.p99, q.max);
}

std::string streamRow(const StressReport& r) {
    return fmt::format(
        "| {} | {} | {} | {:.2f} | {:.2f} | {:.2f} | {} | {} | {:.2f} | {:.1f} | {:.1f} | {:.2f} | {} |{}\n", r.name,
        r.path, formatBytes(r.budgetBytes), r.firstPictureSeconds, r.detail90Seconds, r.settledSeconds,
        timesOf(r.frameMs), timesOf(r.frameMsNoLoads), ratio(r.frameMs.p99, r.frameMsNoLoads.p99),
        1e-6 * double(r.bytesRead), 1e-6 * double(r.bytesNeeded), ratio(double(r.bytesRead), double(r.bytesNeeded)),
        r.relaxed ? "yes" : "no",
        r.violations.empty() ? "" : fmt::format(" **broken: {}**", fmt::join(r.violations, "; ")));
}

/// Draws a line over the budgets for each model and path.
Plot overBudgets(const std::string& title, const std::string& yName, const std::vector<StressReport>& rows,
                 double (*valueOf)(const StressReport&)) {
    Plot plot{.title = title, .xName = "budget, MB", .yName = yName, .logX = true};
    for (const StressReport& row : rows) {
        const std::string name = fmt::format("{}, {}", row.name, row.path);
        if (plot.series.empty() || plot.series.back().name != name) plot.series.push_back({name, {}});
        plot.series.back().points.push_back({1e-6 * double(row.budgetBytes), valueOf(row)});
    }
    return plot;
}

template <class Value>
PlotSeries series(const StressReport& report, const std::string& name, Value valueOf) {
    PlotSeries made{name, {}};
    for (const StressSample& sample : report.samples) made.points.push_back({sample.seconds, valueOf(sample)});
    return made;
}

}  // namespace

std::string stressJson(const StressReport& r) {
    Json samples = Json::array();
    for (const StressSample& sample : r.samples) samples.push_back(toJson(sample));
    Json orders = Json::array();
    for (const OrderCurve& curve : r.orders) orders.push_back(toJson(curve));
    Json json = summaryOf(r);
    json["orders"] = orders;
    json["samples"] = samples;
    if (r.views) json["several_views"] = toJson(*r.views);
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string stressMarkdown(const StressReport& r) {
    std::string text = fmt::format("# Streaming {}\n\nPath {}, {} frames, seed {}, on {}. Faults: {}.\n\n", r.name,
                                   r.path, r.frames, r.seed, r.device, r.faults.empty() ? "none" : r.faults);
    text += r.violations.empty() ? "**All invariants hold.**\n\n" : "**Broken invariants:**\n\n";
    for (const std::string& violation : r.violations) text += "- " + violation + "\n";
    if (!r.violations.empty()) text += "\n";
    text += fmt::format(
        "| first picture | 90 % detail | settled | path settled |\n|---|---|---|---|\n| {:.3f} s | {:.3f} s | {:.3f} s "
        "| {:.3f} s |\n\n",
        r.firstPictureSeconds, r.detail90Seconds, r.settledSeconds, r.pathSettledSeconds);
    text += fmt::format(
        "| budget | resident at most | memory | held at most | read | needed | read over needed "
        "|\n|---|---|---|---|---|---|---|\n"
        "| {} | {} | {} | {} | {} | {} | {:.2f} |\n\n",
        formatBytes(r.budgetBytes), formatBytes(r.residentBytesMax), formatBytes(r.ramBytes),
        formatBytes(r.heldBytesMax), formatBytes(r.bytesRead), formatBytes(r.bytesNeeded),
        ratio(double(r.bytesRead), double(r.bytesNeeded)));
    text += "| frame, ms | p50 | p95 | p99 | max |\n|---|---|---|---|---|\n" + row("with loads", r.frameMs) +
            row("without loads", r.frameMsNoLoads);
    text += fmt::format(
        "\np99 with loads is {:.2f} of that without. {} pages loaded, {} evicted; {} reads failed, {} pages given up. "
        "The last view settled at {:.2g} pixels of error{}.\n",
        ratio(r.frameMs.p99, r.frameMsNoLoads.p99), formatCount(r.loads), formatCount(r.evictions),
        formatCount(r.failures), formatCount(r.pagesGivenUp), r.errorPixels,
        r.relaxed ? "; the budget was too small for some views" : "");
    text +=
        "\n![resident bytes](stress_bytes.svg)\n![pages](stress_pages.svg)\n![frame "
        "time](stress_frames.svg)\n![error](stress_error.svg)\n";
    return text + ordersMarkdown(r.orders) + viewsMarkdown(r.views);
}

std::vector<std::pair<std::string, std::string>> stressPlots(const StressReport& r) {
    const auto plot = [&](const std::string& title, const std::string& unit, std::vector<PlotSeries> all) {
        Plot made{.title = title, .xName = "seconds", .yName = unit};
        made.series = std::move(all);
        return made;
    };
    Plot bytes = plot("Resident bytes", "MB",
                      {series(r, "resident", [](const StressSample& s) { return 1e-6 * double(s.residentBytes); })});
    bytes.levels = {{"budget", 1e-6 * double(r.budgetBytes)}};
    const Plot pages =
        plot("Pages", "pages",
             {series(r, "requests", [](const StressSample& s) { return double(s.pending); }),
              series(r, "loads a frame", [](const StressSample& s) { return double(s.loads); }),
              series(r, "evictions a frame", [](const StressSample& s) { return double(s.evictions); })});
    const Plot frames = plot("Frame time", "ms", {series(r, "frame", [](const StressSample& s) { return s.frameMs; })});
    const Plot error = plot("Error and missing detail", "pixels; % of pages",
                            {series(r, "pixel error", [](const StressSample& s) { return s.errorPixels; }),
                             series(r, "missing detail, %", [](const StressSample& s) { return 100 * s.missing; })});
    std::vector<std::pair<std::string, std::string>> plots{{"stress_bytes", plotSvg(bytes)},
                                                           {"stress_pages", plotSvg(pages)},
                                                           {"stress_frames", plotSvg(frames)},
                                                           {"stress_error", plotSvg(error)}};
    if (r.orders.empty()) return plots;
    Plot orders{.title = "Orders of arrival", .xName = "MB read", .yName = "error of the picture"};
    for (const OrderCurve& curve : r.orders) {
        PlotSeries points{std::string(nameOf(curve.order)), {}};
        for (const OrderSample& sample : curve.samples)
            points.points.push_back({1e-6 * double(sample.bytes), sample.error});
        orders.series.push_back(std::move(points));
    }
    plots.emplace_back("stress_orders", plotSvg(orders));
    return plots;
}

std::string benchStreamJson(const std::vector<StressReport>& rows) {
    Json all = Json::array();
    for (const StressReport& row : rows) all.push_back(summaryOf(row));
    return Json{{"rows", all}}.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string benchStreamCsv(const std::vector<StressReport>& rows) {
    Json all = Json::array();
    for (const StressReport& row : rows) all.push_back(flatOf(row));
    return csvOf(all);
}

std::string benchStreamMarkdown(const std::vector<StressReport>& rows) {
    std::string text =
        "| source | path | budget | first picture, s | 90 % detail, s | settled, s | frame p50 / p95 / p99 / max, ms | "
        "without loads | p99 ratio | read, MB | needed, MB | "
        "ratio | relaxed |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    for (const StressReport& row : rows) text += streamRow(row);
    return text;
}

std::vector<std::pair<std::string, std::string>> benchStreamPlots(const std::vector<StressReport>& rows) {
    Plot frames = overBudgets("Frame times, p99: with loads over without", "ratio", rows,
                              [](const StressReport& r) { return ratio(r.frameMs.p99, r.frameMsNoLoads.p99); });
    Plot bytes = overBudgets("Bytes read over bytes needed", "ratio", rows,
                             [](const StressReport& r) { return ratio(double(r.bytesRead), double(r.bytesNeeded)); });
    frames.levels = {{"goal", 1.25}};
    bytes.levels = {{"goal", 1.3}};
    return {{"bench_stream_frames", plotSvg(frames)}, {"bench_stream_bytes", plotSvg(bytes)}};
}

}  // namespace vcp
