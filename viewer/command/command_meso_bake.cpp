// vcp meso bake: from a scan to a base of few triangles with displacement.
#include "viewer/command/command_meso_bake.h"

#include <chrono>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "mesostructure/tile_grid.h"
#include "viewer/bake/bake.h"
#include "viewer/bake/bake_files.h"
#include "viewer/command/manual/help_text.h"
#include "viewer/command/parsed_option.h"
#include "viewer/command/source_arguments.h"
#include "viewer/command/terminal/interrupt.h"
#include "viewer/export/surface_cut.h"
#include "viewer/scene/option_values.h"
#include "viewer/scene/scene_opening.h"

namespace vcp {

namespace {

struct BakeMeso {
    std::string scan, out, base;
    uint64_t triangles = 10'000;
    std::optional<Length> reach;
    bool overwrite = false;
    BakeOptions options;
    SourceAccess source;
    ReportOptions report;
};

Json toJson(const Quantiles& q) { return {{"p50", q.p50}, {"p95", q.p95}, {"p99", q.p99}, {"max", q.max}}; }

/// Bytes of the scan's mesh as a binary PLY: three floats a vertex, a count and three numbers a triangle.
uint64_t meshBytes(const BakeFigures& f) { return 12 * f.scanVertices + 13 * f.scanTriangles; }

Json toJson(const BakeMeso& command, const BakeFigures& f, uint64_t scanBytes, double seconds) {
    Json json = {{"output", command.out},
                 {"triangles_of_scan", f.scanTriangles},
                 {"triangles", f.baseTriangles},
                 {"left_out", f.leftOut},
                 {"triangles_coarsened", f.coarseTriangles},
                 {"texels", command.options.texels},
                 {"map", f.isAtlas ? "atlas" : "given"},
                 {"reach", f.reach},
                 {"offset", f.offset},
                 {"range", f.range},
                 {"height_field", f.shares.height},
                 {"no_hit", f.shares.noHit},
                 {"several_sheets", f.shares.sheets},
                 {"steep", f.shares.steep},
                 {"tried_at_first", f.unlikeAtFirst},
                 {"tried_at_last", f.unlike},
                 {"bytes", f.bytes},
                 {"base_bytes", f.baseBytes},
                 {"height_bytes", f.heightBytes},
                 {"scan_bytes", scanBytes}};
    if (f.scanVertices > 0) json["mesh_bytes"] = meshBytes(f);
    if (f.scanToBase) json["scan_to_base"] = toJson(*f.scanToBase);
    if (f.baseToScan) json["base_to_scan"] = toJson(*f.baseToScan);
    json["seconds"] = seconds;
    return json;
}

std::string summary(const BakeMeso& command, const BakeFigures& f, uint64_t scanBytes, double diagonal) {
    const int n = command.options.texels;
    const std::string mesh = f.scanVertices == 0 ? "" : fmt::format(", {} of its mesh", formatBytes(meshBytes(f)));
    std::string text = fmt::format(
        "{}: {} triangles for {}, maps of {} x {} texels, {} ({} of the scan{})\n"
        "  heights from {} to {} along the base's normals, looked for up to {}\n"
        "  a height field over {:.2f} % of the base; no hit {:.2f} %, several sheets {:.2f} %, steep {:.2f} % "
        "(mask.png)",
        command.out, formatCount(f.baseTriangles), formatCount(f.scanTriangles), n, n, formatBytes(f.bytes),
        formatBytes(scanBytes), mesh, formatLength(f.offset), formatLength(f.offset + f.range), formatLength(f.reach),
        100 * f.shares.height, 100 * f.shares.noHit, 100 * f.shares.sheets, 100 * f.shares.steep);
    if (f.coarseTriangles > 0)
        text += fmt::format("\n  the scan was made coarser first, to {} triangles", formatCount(f.coarseTriangles));
    if (f.unlikeAtFirst > f.unlike)
        text += fmt::format(
            "\n  the base was made to follow the scan: by small maps, it was none over {:.2f} %, now {:.2f} %",
            100 * f.unlikeAtFirst, 100 * f.unlike);
    if (f.leftOut > 0)
        text += fmt::format(
            "\n  the base is made without {} triangles of the scan, on edges of more than two or without an outside",
            formatCount(f.leftOut));
    const auto line = [&](const char* what, const Quantiles& q) {
        text +=
            fmt::format("\n  {} p50 {} p95 {} p99 {} max {}, of the diagonal {:.3f} {:.3f} {:.3f} {:.3f} %", what,
                        formatLength(q.p50), formatLength(q.p95), formatLength(q.p99), formatLength(q.max),
                        100 * q.p50 / diagonal, 100 * q.p95 / diagonal, 100 * q.p99 / diagonal, 100 * q.max / diagonal);
    };
    if (f.scanToBase) line("from scan to displaced base", *f.scanToBase);
    if (f.baseToScan) line("from displaced base to scan", *f.baseToScan);
    return text;
}

Result<int> runBake(BakeMeso& command) {
    const auto start = std::chrono::steady_clock::now();
    const InterruptScope catching;
    VCP_TRY_ASSIGN(auto folder,
                   OutputFolder::create(command.out, {.isOurs = isBakedName,
                                                      .ofWhat = "a baked scan",
                                                      .overwrite = command.overwrite,
                                                      .howToReplace = "--overwrite replaces it",
                                                      .inputs = {command.scan, command.base, command.source.caFile}}));
    command.source.cancelled = interrupted;
    VCP_TRY_ASSIGN(const auto reader, openReader(command.scan, command.source));
    VCP_TRY_ASSIGN(const auto dataset, readDataset(*reader));
    const Box bounds = boundsOf(dataset.header);
    const double diagonal = glm::distance(bounds.low, bounds.high);
    BakeOptions& options = command.options;
    options.base = command.base;
    options.triangles = size_t(command.triangles);
    if (command.reach)
        options.reach = command.reach->isRelative ? command.reach->value * diagonal : command.reach->value;
    ProgressDisplay display(command.report.progressStyle(), stderr);
    options.progress = [&](std::string_view stage, double fraction) {
        display.update(stage, fraction);
        return !interrupted();
    };
    VCP_TRY_ASSIGN(const BakeFigures figures, bake(reader, dataset, folder.unfinished(), options));
    VCP_TRY(folder.commit());
    display.finish();
    if (!command.report.json) {
        VCP_TRY(printLine(summary(command, figures, reader->size(), diagonal)));
        return 0;
    }
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    VCP_TRY(printJson(toJson(command, figures, reader->size(), seconds)));
    return 0;
}

}  // namespace

RunCommand addMesoBake(CLI::App& meso) {
    auto command = std::make_shared<BakeMeso>();
    BakeOptions& options = command->options;
    CLI::App* app = meso.add_subcommand("bake", "Turn a scan into a base of few triangles with displacement");
    app->add_option("SCAN", command->scan, "A .vcp file, a folder of shards, or the http(s) address of either")
        ->type_name("")
        ->required();
    beginGroup(*app, help_group::kOutput);
    app->add_option("-o,--output", command->out,
                    "The folder to write: scene.json for `vcp render`, base.glb and pictures for other programs")
        ->type_name("DIR")
        ->required();
    addOverwriteOption(*app, command->overwrite);
    app->add_option("--triangles", command->triangles, "Triangles of the base that the scan is decimated to")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(uint64_t{4}, uint64_t{1'000'000}));
    app->add_option("--base", command->base,
                    "A base of your own, in the scan's place and unit. Its texture coordinates are used where it has "
                    "them [the scan is decimated]")
        ->type_name("MESH");
    app->add_flag("--new-map", options.newMap, "Lay out the base's triangles anew, whatever coordinates it has");
    app->add_option("--texels", options.texels, "Texels an edge of the maps")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(8, meso::kMaxGridEdge));
    addParsed(*app, "--reach", command->reach, parseLength, "like 0.25 or 1%",
              "How far from the base the scan is looked for: a length, or a part of the scan's diagonal [what a "
              "decimated base needs; 2% with --base]")
        ->type_name("LENGTH");
    app->add_flag("--colour,!--no-colour", options.withColour, "Write colours where the scan has them [on]");
    app->add_flag("--measure", options.measured,
                  "Measure the distances between the scan and the displaced base, both ways");
    addMemory(*app, options.memoryBytes, "Memory [4G]");
    addSourceSettings(*app, command->source);
    beginGroup(*app, help_group::kReport);
    addJsonOption(*app, command->report);
    addProgressOption(*app, command->report);
    return [command] { return runBake(*command); };
}

}  // namespace vcp
