// The report of the mesostructure benchmark as JSON, CSV, Markdown and plots.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "viewer/bench/bench_meso.h"
#include "viewer/bench/report/csv_text.h"
#include "viewer/bench/report/plot_svg.h"

namespace vcp {

namespace {

using Json = nlohmann::ordered_json;

Json toJson(const BenchMesoRow& row) {
    Json json = {{"asset", row.asset},
                 {"view", row.view},
                 {"method", row.method},
                 {"knob", row.knob},
                 {"device", row.device},
                 {"rays", row.rays},
                 {"ns_per_ray", row.nsPerRay},
                 {"ratio_to_peer", row.ratioToPeer},
                 {"ratio_p25", row.ratioLow},
                 {"ratio_p75", row.ratioHigh},
                 {"fetches_mean", row.fetchesMean},
                 {"iterations_mean", row.iterationsMean},
                 {"iterations_p95", row.iterationsP95},
                 {"surface_tests_mean", row.surfaceTestsMean},
                 {"surface_tests_max", row.surfaceTestsMost},
                 {"divergence_8", row.divergence8}};
    for (size_t i = 0; i < kMesoClassNames.size(); ++i) json[std::string(kMesoClassNames[i])] = row.shape.fractions[i];
    json["p50_texels"] = row.shape.p50, json["p95_texels"] = row.shape.p95, json["p99_texels"] = row.shape.p99,
    json["max_texels"] = row.shape.max;
    const auto normal = [&](double value) { return row.shape.hasNormals ? Json(value) : Json(); };
    json["normal_p50_degrees"] = normal(row.shape.normalP50);
    json["normal_p95_degrees"] = normal(row.shape.normalP95);
    // Columns are the same for all rows.
    const auto solver = [&](double value) { return row.hasSolver ? Json(value) : Json(); };
    json["solver_missed"] = solver(row.solver.fraction(MesoClass::Missed));
    json["solver_wrong"] = solver(row.solver.wrong());
    json["solver_p95_texels"] = solver(row.solver.p95);
    json["solver_max_texels"] = solver(row.solver.max);
    const char* bins[] = {"iterations_0_10", "iterations_11_34", "iterations_35_59", "iterations_60"};
    for (size_t i = 0; i < 4; ++i) json[bins[i]] = row.iterationBins[i];
    json["bytes"] = row.bytes;
    json["preprocess_seconds"] = row.preprocessSeconds;
    return json;
}

Json rowsOf(const BenchMesoReport& report) {
    Json json = Json::array();
    for (const BenchMesoRow& row : report.rows) json.push_back(toJson(row));
    return json;
}

template <class Of>
std::string plotOf(const std::vector<const BenchMesoRow*>& rows, std::string title, const char* xName,
                   const char* yName, Of of) {
    Plot plot{.title = std::move(title), .xName = xName, .yName = yName, .logX = true, .logY = true};
    for (const BenchMesoRow* first : rows) {
        auto series = std::ranges::find(plot.series, first->method, &PlotSeries::name);
        if (series == plot.series.end()) series = plot.series.insert(series, PlotSeries{first->method, {}});
        if (std::ranges::find(series->points, first->knob, &PlotPoint::label) != series->points.end()) continue;
        // The mean over the views.
        PlotPoint point{0, 0, first->knob};
        double count = 0;
        for (const BenchMesoRow* row : rows) {
            if (row->method != first->method || row->knob != first->knob) continue;
            const auto [x, y] = of(*row);
            point.x += x, point.y += y, ++count;
        }
        point.x /= count, point.y /= count;
        series->points.push_back(point);
    }
    return plotSvg(plot);
}

/// A ratio that a paper prints, and of what it is here.
struct Ratio {
    const char *what, *method, *knob, *baseMethod, *baseKnob;
    double least, most;
    bool isOfRefinements = false;
};
constexpr Ratio kRatios[] = {
    {"Table 1: DDM 2x1 over distance map", "ddm", "2x1 grid 64", "dm", "grid 64", 0.705, 0.855},
    {"Table 1: DDM 4x1 over distance map", "ddm", "4x1 grid 64", "dm", "grid 64", 0.636, 0.735},
    {"Table 1: DDM 8x1 over distance map", "ddm", "8x1 grid 64", "dm", "grid 64", 0.614, 0.709},
    {"Table 2: distance map 128 over relief mapping", "dm", "grid 128", "relief-binary", "steps 32", 0.38, 1.05},
    {"Table 2: DDM 4x1 128 over relief mapping", "ddm", "4x1 grid 128", "relief-binary", "steps 32", 0.10, 0.42},
    {"Table 2: DDM 4x1 over distance map, 128", "ddm", "4x1 grid 128", "dm", "grid 128", 0.22, 0.50},
    {"Table 2: DDM 4x1 over distance map, 128, cap 1", "ddm", "4x1 grid 128 cap 1", "dm", "grid 128 cap 1", 0.22, 0.50},
    {"Table 2: DDM with quadrics 16 over relief mapping", "ddm-quadric-fitted", "4x1 grid 16", "relief-binary",
     "steps 32", 0.34, 2.10},
    {"Table 2: DDM with quadrics 16 over distance map 128", "ddm-quadric-fitted", "4x1 grid 16", "dm", "grid 128", 0.89,
     2.4},
    {"Table 3: DDM 4x1, compressed over not", "ddm-compressed", "4x1 grid 64", "ddm", "4x1 grid 64", 1, 1.05},
    {"Risser: binary over secant, 5 steps", "relief-binary", "steps 5", "relief-secant", "steps 5", 5.0 / 3, 8.0 / 2,
     true},
    {"Wang: rate of GDM over VDM", "vdm", "rank 16 grid 32", "gdm", "rank 16 grid 32", 0.630, 0.686},
    {"Wang: rate of GDM over slices, 64 x 64 x 16", "slices", "grid 64 layers 16", "gdm", "rank 16 grid 32 layers 16",
     1.88, 1.88},
    {"Wang: rate of GDM over slices, 64 x 64 x 32", "slices", "grid 64 layers 32", "gdm", "rank 16 grid 32 layers 32",
     3.8, 3.8},
    {"Wang: rate of GDM, 32 layers over 16", "gdm", "rank 16 grid 32 layers 16", "gdm", "rank 16 grid 32 layers 32",
     0.95, 0.95},
    {"Wang: rate of slices, 32 layers over 16", "slices", "grid 64 layers 16", "slices", "grid 64 layers 32", 0.47,
     0.47}};

/// The cost of a method on an asset, summed over the views; count 0 where it was not measured.
struct Cost {
    double ratio = 0, fetches = 0, tests = 0, count = 0;
};

Cost costOf(const std::vector<BenchMesoRow>& rows, const std::string& asset, std::string_view method,
            std::string_view knob) {
    Cost cost;
    for (const BenchMesoRow& row : rows)
        if (row.asset == asset && row.method == method && row.knob == knob)
            cost.ratio += row.ratioToPeer, cost.fetches += row.fetchesMean, cost.tests += row.surfaceTestsMean,
                ++cost.count;
    return cost;
}

}  // namespace

bool isOfPublished(std::string_view method, std::string_view knob) {
    return std::ranges::any_of(kRatios, [&](const Ratio& r) {
        return (method == r.method && knob == r.knob) || (method == r.baseMethod && knob == r.baseKnob);
    });
}

std::vector<MesoPublished> publishedOf(const std::vector<BenchMesoRow>& rows) {
    std::vector<std::string> assets;
    for (const BenchMesoRow& row : rows)
        if (std::ranges::find(assets, row.asset) == assets.end()) assets.push_back(row.asset);
    std::vector<MesoPublished> published;
    for (const Ratio& ratio : kRatios)
        for (const std::string& asset : assets) {
            const Cost of = costOf(rows, asset, ratio.method, ratio.knob),
                       base = costOf(rows, asset, ratio.baseMethod, ratio.baseKnob);
            if (of.count == 0 || base.count == 0) continue;
            const double work = ratio.isOfRefinements ? of.tests / base.tests : of.fetches / base.fetches;
            if (!std::isfinite(work)) continue;
            published.push_back({ratio.what, asset, ratio.isOfRefinements ? "refinements" : "fetches", ratio.least,
                                 ratio.most, work, of.ratio / base.ratio});
        }
    return published;
}

std::string benchMesoJson(const BenchMesoReport& report) {
    Json checks = Json::array();
    for (const MesoCheck& check : report.checks)
        checks.push_back({{"asset", check.asset},
                          {"map", check.map},
                          {"rays", check.rays},
                          {"oversteps", check.oversteps},
                          {"worst_texels", check.worstTexels}});
    Json published = Json::array();
    for (const MesoPublished& row : report.published)
        published.push_back({{"what", row.what},
                             {"asset", row.asset},
                             {"published_least", row.least},
                             {"published_most", row.most},
                             {"of", row.of},
                             {"ours", row.ours},
                             {"ours_time", row.oursTime},
                             {"near", row.isNear()}});
    Json headlines = Json::array();
    for (const MesoHeadline& h : headlinesOf(report.rows))
        headlines.push_back({{"asset", h.asset},
                             {"method", h.method},
                             {"fetches_mean", h.fetches},
                             {"fetches_knob", h.fetchesKnob},
                             {"ratio_to_peer", h.ratioToPeer},
                             {"ratio_knob", h.timeKnob}});
    Json goals = Json::array();
    for (const MesoGoal& g : goalsOf(report.rows))
        goals.push_back({{"asset", g.asset},
                         {"rival", g.rival},
                         {"rival_knob", g.rivalKnob},
                         {"rival_is_right", g.rivalIsRight},
                         {"rival_wrong", g.rivalWrong},
                         {"rival_p95_texels", g.rivalP95},
                         {"knob", g.oursKnob},
                         {"wrong", g.oursWrong},
                         {"p95_texels", g.oursP95},
                         {"time_over_rival", g.time},
                         {"fetches_over_rival", g.fetches},
                         {"right_knob", g.rightKnob},
                         {"right_time_over_rival", g.rightKnob.empty() ? Json() : Json(g.rightTime)}});
    Json factors = Json::array();
    for (const MesoFactors& f : report.factors)
        factors.push_back({{"asset", f.asset},
                           {"form", f.form},
                           {"rank", f.rank},
                           {"clusters", f.clusters},
                           {"bytes", f.bytes},
                           {"rms_points", f.rmsPoints},
                           {"off_by_a_point", f.offByPoint},
                           {"wrong_hits", f.wrongHits}});
    Json shadows = Json::array();
    for (const MesoShadows& s : report.shadows)
        shadows.push_back({{"asset", s.asset},
                           {"method", s.method},
                           {"offset_points", s.offsetPoints},
                           {"own_hits", s.ownHits},
                           {"places", s.places},
                           {"dark", s.dark},
                           {"leak", s.leak},
                           {"acne", s.acne}});
    Json lights = Json::array();
    for (const MesoLight& l : report.lights)
        lights.push_back({{"asset", l.asset},
                          {"sky", l.sky},
                          {"form", l.form},
                          {"relative_mse", l.relativeMse},
                          {"flip_mean", l.flipMean},
                          {"energy", l.energy},
                          {"bytes", l.bytes}});
    Json prisms = Json::array();
    for (const MesoPrisms& p : report.prisms) {
        Json row = {{"turn_degrees", p.turnDegrees},
                    {"height_over_radius", p.heightOverRadius},
                    {"prisms", p.prisms},
                    {"cut_columns", p.cutColumns},
                    {"rays", p.rays},
                    {"between", p.between}};
        for (const auto& [name, d] :
             {std::pair("straight", p.straight), std::pair("tetrahedra", p.linear),
              std::pair("straight_smooth", p.straightSmooth), std::pair("tetrahedra_smooth", p.linearSmooth),
              std::pair("curved_smooth", p.curvedSmooth)})
            row[std::string(name) + "_p50_texels"] = d.p50, row[std::string(name) + "_p95_texels"] = d.p95;
        row["printed_exit_wrong"] = p.printedWrong;
        prisms.push_back(row);
    }
    Json bent = Json::array();
    for (const MesoBent& b : report.bent) {
        Json row = {{"asset", b.asset},
                    {"base", b.base},
                    {"slab_over_radius", b.overRadius},
                    {"method", b.method},
                    {"knob", b.knob},
                    {"rays", b.rays},
                    {"p50_texels", b.p50},
                    {"p95_texels", b.p95},
                    {"iterations_mean", b.iterations},
                    {"fetches_most", b.fetches > 0 ? Json(b.fetches) : Json()},
                    {"bytes", b.bytes},
                    {"preprocess_seconds", b.preprocessSeconds > 0 ? Json(b.preprocessSeconds) : Json()},
                    {"time_over_gdm", b.timeOverGdm}};
        for (size_t c = 0; c < kMesoClassNames.size(); ++c) row[std::string(kMesoClassNames[c])] = b.shape.fractions[c];
        bent.push_back(row);
    }
    Json models = Json::array();
    for (const MesoModel& m : report.models)
        models.push_back({{"asset", m.asset},
                          {"base", m.base},
                          {"method", m.method},
                          {"light", m.light},
                          {"device", m.device},
                          {"prisms", m.prisms},
                          {"pixels", m.pixels},
                          {"unresolved", m.unresolved},
                          {"ms_frame", m.msFrame},
                          {"ns_pixel", m.nsPixel},
                          {"ns_prism", m.nsPrism}});
    Json remeshed = Json::array();
    for (const RemeshRow& row : report.remeshed)
        remeshed.push_back({{"asset", row.asset},
                            {"view", row.view},
                            {"filter", row.filter},
                            {"cell_pixels", row.cell},
                            {"error_p50_pixels", row.p50},
                            {"error_p95_pixels", row.p95},
                            {"error_max_pixels", row.max},
                            {"bound_pixels", row.boundPixels},
                            {"uncertified", row.uncertified},
                            {"bias", row.bias},
                            {"horizon_loss_pixels", row.horizonLoss},
                            {"vertices", row.vertices},
                            {"triangles", row.triangles},
                            {"bytes", row.bytes},
                            {"ms", row.ms},
                            {"device", row.device},
                            {"pieces_ms", row.piecesMs},
                            {"sweep_ms", row.sweepMs},
                            {"sweep_processor_ms", row.sweepProcessorMs}});
    Json pictures = Json::array();
    for (const RemeshDrawnRow& row : report.remeshedPictures)
        pictures.push_back({{"asset", row.asset},
                            {"view", row.view},
                            {"way", row.way},
                            {"cell_pixels", row.cell},
                            {"error_p50_pixels", row.p50},
                            {"error_p95_pixels", row.p95},
                            {"error_max_pixels", row.max},
                            {"pixels", row.pixels},
                            {"vertices", row.vertices},
                            {"triangles", row.triangles},
                            {"ms", row.ms},
                            {"processor_ms", row.processorMs}});
    return Json{{"rows", rowsOf(report)},
                {"headline", headlines},
                {"goals", goals},
                {"checks", checks},
                {"published", published},
                {"factors", factors},
                {"shadows", shadows},
                {"lights", lights},
                {"prisms", prisms},
                {"bent", bent},
                {"models", models},
                {"remeshed", remeshed},
                {"remeshed_pictures", pictures}}
        .dump();
}

std::string benchMesoCsv(const BenchMesoReport& report) { return csvOf(rowsOf(report)); }

std::string benchMesoMarkdown(const BenchMesoReport& report) {
    std::string text =
        "| asset | view | method | knob | ns/ray | time over peer | fetches | iterations | hit % | missed % | false % "
        "| wrong feature % | unresolved % | p50 | p95 | p99 texels | "
        "solver wrong % | MB | built s "
        "|\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    for (const BenchMesoRow& row : report.rows) {
        const auto percent = [&](MesoClass c) { return 100 * row.shape.fraction(c); };
        text += fmt::format(
            "| {} | {} | {} | {} | {:.0f} | {:.3f} | {:.1f} | {:.1f} | {:.2f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} ",
            row.asset, row.view, row.method, row.knob, row.nsPerRay, row.ratioToPeer, row.fetchesMean,
            row.iterationsMean, percent(MesoClass::Hit), percent(MesoClass::Missed), percent(MesoClass::False),
            percent(MesoClass::WrongFeature), percent(MesoClass::Unresolved));
        text +=
            fmt::format("| {:.4f} | {:.4f} | {:.4f} | {} | {:.2f} | {:.2f} |\n", row.shape.p50, row.shape.p95,
                        row.shape.p99, row.hasSolver ? fmt::format("{:.3f}", 100 * row.solver.wrong()) : std::string(),
                        double(row.bytes) * 1e-6, row.preprocessSeconds);
    }
    if (const auto headlines = headlinesOf(report.rows); !headlines.empty()) {
        text +=
            "\n| least work for <= 0.1 % wrong, p95 <= 0.25 texels | method | fetches | knob | time over peer | knob "
            "|\n|---|---|---|---|---|---|\n";
        for (const MesoHeadline& h : headlines)
            text += fmt::format("| {} | {} | {:.1f} | {} | {:.3f} | {} |\n", h.asset, h.method, h.fetches,
                                h.fetchesKnob, h.ratioToPeer, h.timeKnob);
    }
    if (const auto goals = goalsOf(report.rows); !goals.empty()) {
        text +=
            "\n| asset | rival, its cheapest right knob, or its rightest | wrong % | p95 | boxes, as right | wrong % | "
            "p95 | time over the rival's | fetches | boxes with <= 0.1 %, 0.25 texels | time over the rival's "
            "|\n|---|---|---|---|---|---|---|---|---|---|---|\n";
        for (const MesoGoal& g : goals)
            text +=
                fmt::format("| {} | {} {}{} | {:.3f} | {:.3f} | {} | {:.3f} | {:.3f} | {:.2f} | {:.2f} | {} | {} |\n",
                            g.asset, g.rival, g.rivalKnob, g.rivalIsRight ? " (right)" : "", 100 * g.rivalWrong,
                            g.rivalP95, g.oursKnob, 100 * g.oursWrong, g.oursP95, g.time, g.fetches, g.rightKnob,
                            g.rightKnob.empty() ? std::string() : fmt::format("{:.2f}", g.rightTime));
    }
    if (!report.published.empty()) {
        text +=
            "\n| published | asset | ratio there | of | ours | within 25 % | ours, times "
            "|\n|---|---|---|---|---|---|---|\n";
        for (const MesoPublished& row : report.published)
            text += fmt::format("| {} | {} | {:.3g} to {:.3g} | {} | {:.3g} | {} | {} |\n", row.what, row.asset,
                                row.least, row.most, row.of, row.ours, row.isNear() ? "yes" : "no",
                                row.oursTime > 0 ? fmt::format("{:.3g}", row.oursTime) : std::string());
    }
    if (!report.factors.empty()) {
        text +=
            "\n| asset | form | rank | clusters | MB | rms, points | off by a point % | wrong hits % "
            "|\n|---|---|---|---|---|---|---|---|\n";
        for (const MesoFactors& f : report.factors)
            text += fmt::format("| {} | {} | {} | {} | {:.3f} | {:.3f} | {:.1f} | {:.1f} |\n", f.asset, f.form, f.rank,
                                f.clusters, double(f.bytes) * 1e-6, f.rmsPoints, 100 * f.offByPoint, 100 * f.wrongHits);
    }
    if (!report.shadows.empty()) {
        text +=
            "\n| asset | shadows by | from | offset, points | places | dark % | leak % | acne % "
            "|\n|---|---|---|---|---|---|---|---|\n";
        for (const MesoShadows& s : report.shadows)
            text += fmt::format("| {} | {} | {} | {:.3g} | {} | {:.1f} | {:.2f} | {:.2f} |\n", s.asset, s.method,
                                s.ownHits ? "its own hits" : "the surface", s.offsetPoints, s.places, 100 * s.dark,
                                100 * s.leak, 100 * s.acne);
    }
    if (!report.lights.empty()) {
        text +=
            "\n| asset | light from everywhere | form | relative MSE | FLIP | energy | MB "
            "|\n|---|---|---|---|---|---|---|\n";
        for (const MesoLight& l : report.lights)
            text += fmt::format("| {} | {} | {} | {:.4f} | {:.4f} | {:.3f} | {:.2f} |\n", l.asset, l.sky, l.form,
                                l.relativeMse, l.flipMean, l.energy, double(l.bytes) * 1e-6);
    }
    if (!report.prisms.empty()) {
        text +=
            "\n| a prism turns | slab over radius | prisms | straight from curved, p50, p95 texels | tetrahedra from "
            "curved | straight from smooth | tetrahedra from smooth | curved from smooth | printed exit wrong % "
            "|\n|---|---|---|---|---|---|---|---|---|\n";
        const auto both = [](const MesoDistortion& d) { return fmt::format("{:.3f}, {:.3f}", d.p50, d.p95); };
        for (const MesoPrisms& p : report.prisms)
            text += fmt::format("| {:.3g}° | {:.3f} | {} | {} | {} | {} | {} | {} | {:.1f} |\n", p.turnDegrees,
                                p.heightOverRadius, p.prisms, both(p.straight), both(p.linear), both(p.straightSmooth),
                                both(p.linearSmooth), both(p.curvedSmooth), 100 * p.printedWrong);
    }
    if (!report.bent.empty()) {
        text +=
            "\n| asset | base | slab over radius | method | knob | rays | missed % | false % | off by 2 texels % | p50 "
            "| "
            "p95 texels | questions | fetches | MB | built s | time over gdm's "
            "|\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
        for (const MesoBent& b : report.bent)
            text += fmt::format(
                "| {} | {} | {:.3f} | {} | {} | {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {} | {:.2f} "
                "| "
                "{} | {:.2f} |\n",
                b.asset, b.base, b.overRadius, b.method, b.knob, b.rays, 100 * b.shape.fraction(MesoClass::Missed),
                100 * b.shape.fraction(MesoClass::False), 100 * b.shape.fraction(MesoClass::WrongFeature), b.p50, b.p95,
                b.iterations, b.fetches > 0 ? fmt::format("{:.1f}", b.fetches) : std::string(), double(b.bytes) * 1e-6,
                b.preprocessSeconds > 0 ? fmt::format("{:.1f}", b.preprocessSeconds) : std::string(), b.timeOverGdm);
    }
    if (!report.models.empty()) {
        text +=
            "\n| model | method | light | prisms | covered pixels | ms | ns a pixel | ns a prism | unresolved "
            "|\n|---|---|---|---|---|---|---|---|---|\n";
        for (const MesoModel& m : report.models)
            text += fmt::format("| {} on {} | {} | {} | {} | {} | {:.1f} | {:.0f} | {:.0f} | {} |\n", m.asset, m.base,
                                m.method, m.light, m.prisms, m.pixels, m.msFrame, m.nsPixel, m.nsPrism, m.unresolved);
    }
    if (!report.remeshed.empty()) {
        text +=
            "\n| remeshed | view | filter | cell px | error p50 | p95 | max px | certified px | but of patches | bias "
            "| horizon lower "
            "by px "
            "| vertices | ms | on a device: pieces | sweep | its processor ms "
            "|\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
        for (const RemeshRow& row : report.remeshed)
            text += fmt::format(
                "| {} | {} | {} | {:g} | {:.3f} | {:.3f} | {:.2f} | {:.2f} | {} | {:+.5f} | {:+.2f} | {} | {:.1f} | "
                "{:.2f} "
                "| {:.1f} | "
                "{:.1f} |\n",
                row.asset, row.view, row.filter, row.cell, row.p50, row.p95, row.max, row.boundPixels, row.uncertified,
                row.bias, row.horizonLoss, row.vertices, row.ms, row.piecesMs, row.sweepMs, row.sweepProcessorMs);
    }
    if (!report.remeshedPictures.empty()) {
        text +=
            "\n| drawn | view | way | cell px | error p50 | p95 | max px | pixels | vertices | triangles | ms | "
            "processor ms |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n";
        for (const RemeshDrawnRow& row : report.remeshedPictures)
            text += fmt::format("| {} | {} | {} | {:g} | {:.3f} | {:.3f} | {:.2f} | {} | {} | {} | {:.1f} | {:.1f} |\n",
                                row.asset, row.view, row.way, row.cell, row.p50, row.p95, row.max, row.pixels,
                                row.vertices, row.triangles, row.ms, row.processorMs);
    }
    if (report.checks.empty()) return text;
    text += "\n| asset | map | rays | oversteps | worst, texels |\n|---|---|---|---|---|\n";
    for (const MesoCheck& check : report.checks)
        text += fmt::format("| {} | {} | {} | {} | {:.3f} |\n", check.asset, check.map, check.rays, check.oversteps,
                            check.worstTexels);
    return text;
}

std::vector<std::pair<std::string, std::string>> benchMesoPlots(const BenchMesoReport& report) {
    std::vector<std::pair<std::string, std::string>> plots;
    std::vector<std::string> assets;
    for (const BenchMesoRow& row : report.rows)
        if (std::ranges::find(assets, row.asset) == assets.end()) assets.push_back(row.asset);
    for (const std::string& asset : assets) {
        std::vector<const BenchMesoRow*> rows;
        for (const BenchMesoRow& row : report.rows)
            if (row.asset == asset) rows.push_back(&row);
        // A view without a wrong ray counts as half a wrong ray.
        const auto wrong = [](const BenchMesoRow& row) {
            return std::max(row.shape.wrong(), 0.5 / double(std::max<uint64_t>(row.rays, 1)));
        };
        std::string name = asset.substr(asset.rfind('/') + 1);
        plots.emplace_back("bench_meso_" + name + "_p95_time",
                           plotOf(rows, name + ": error, p95", "time over the peer's", "texels",
                                  [](const BenchMesoRow& r) { return std::pair(r.ratioToPeer, r.shape.p95); }));
        plots.emplace_back("bench_meso_" + name + "_wrong_fetches",
                           plotOf(rows, name + ": wrong rays", "fetches a ray", "fraction; none: half a ray",
                                  [&](const BenchMesoRow& r) { return std::pair(r.fetchesMean, wrong(r)); }));
        plots.emplace_back("bench_meso_" + name + "_p95_bytes",
                           plotOf(rows, name + ": error, p95", "bytes", "texels",
                                  [](const BenchMesoRow& r) { return std::pair(double(r.bytes), r.shape.p95); }));
    }
    return plots;
}

}  // namespace vcp
