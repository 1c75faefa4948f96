// vcp export: the surface of a .vcp as a mesh file, or what a plane cuts of it as a drawing.
#include <algorithm>
#include <chrono>

#include <fmt/format.h>

#include "viewer/command/commands.h"
#include "viewer/command/manual/help_text.h"
#include "viewer/command/parsed_option.h"
#include "viewer/command/source_arguments.h"
#include "viewer/command/terminal/interrupt.h"
#include "viewer/export/mesh_export.h"
#include "viewer/export/section_export.h"
#include "viewer/scene/option_values.h"

namespace vcp {

namespace {

struct ExportCommand {
    std::string file, output;
    bool overwrite = false;
    std::optional<uint32_t> level;
    std::optional<Length> error;
    std::optional<PlaneChoice> section;
    std::optional<Box> box;
    std::optional<LengthUnit> unit;
    bool colour = true;
    unsigned threads = 0;
    SourceAccess source;
    ReportOptions report;

    [[nodiscard]] OutputKind kind() const { return outputKindOf(output).value_or(OutputKind::Ply); }
    [[nodiscard]] bool isDrawing() const { return kind() == OutputKind::Svg || kind() == OutputKind::Dxf; }
};

bool isExportKind(std::optional<OutputKind> kind) {
    constexpr OutputKind kKinds[] = {OutputKind::Ply, OutputKind::Obj, OutputKind::Stl,
                                     OutputKind::Glb, OutputKind::Svg, OutputKind::Dxf};
    return kind && std::ranges::find(kKinds, *kind) != std::end(kKinds);
}

/// What is exported, and what the options mean for this dataset.
struct Job {
    const ExportCommand& command;
    std::shared_ptr<const ByteReader> reader;
    const Dataset& dataset;
    std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();

    [[nodiscard]] uint32_t levels() const { return dataset.header.levels; }
    [[nodiscard]] OutputRules rules() const {
        return {.overwrite = command.overwrite, .inputs = {command.file, command.source.caFile}};
    }
    [[nodiscard]] double seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    }
};

Result<SurfaceCut> cutOf(const Job& job, uint32_t level, const std::optional<CutPlane>& plane = {}) {
    return SurfaceCut::create(job.dataset, job.reader->name(), level, job.command.box, plane);
}

StreamOptions streamOptions(const Job& job, ProgressDisplay& display) {
    return {.colour = job.command.colour, .threads = job.command.threads, .progress = [&display](double fraction) {
                display.update("exporting", fraction);
                return !interrupted();
            }};
}

/// Returns the largest error that is wanted, world units; 0: none is given.
double mostErrorOf(const Job& job) {
    if (!job.command.error) return 0;
    const Length& length = *job.command.error;
    const Box bounds = boundsOf(job.dataset.header);
    return length.isRelative ? length.value * glm::distance(bounds.low, bounds.high) : length.value;
}

/// Returns the coarsest level that is certified within the error that is wanted, or the level that is.
Result<uint32_t> levelOf(const Job& job, const std::optional<CutPlane>& plane) {
    if (job.command.level) {
        if (*job.command.level < job.levels()) return *job.command.level;
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("has no level {}, only 0 to {}", *job.command.level, job.levels() - 1),
                     .file = job.command.file};
    }
    if (!job.command.error) return job.levels() - 1;
    return coarsestLevelWithin(mostErrorOf(job), job.dataset, job.command.file, job.command.box, plane);
}

Notes notesOf(const Job& job, const SurfaceCut& cut) {
    Notes notes = {{"source", std::filesystem::path(job.reader->name()).filename().string()},
                   {"level", fmt::format("{} of 0 to {}{}", cut.level(), job.levels() - 1,
                                         cut.isMesh() ? ", the mesh itself" : "")},
                   {"unit", job.command.unit ? std::string(job.command.unit->name) : "unknown"}};
    if (const auto& box = job.command.box)
        notes.emplace_back("box", fmt::format("{:.17g} {:.17g} {:.17g} to {:.17g} {:.17g} {:.17g}", box->low.x,
                                              box->low.y, box->low.z, box->high.x, box->high.y, box->high.z));
    return notes;
}

Json toJson(const Job& job, const SurfaceCut& cut, double certified, uint64_t fileBytes) {
    return {{"output", job.command.output},    {"level", cut.level()},    {"is_mesh", cut.isMesh()},
            {"certified_distance", certified}, {"file_bytes", fileBytes}, {"seconds", job.seconds()}};
}

Result<int> reportMesh(const Job& job, const SurfaceCut& cut, const MeshExportFigures& figures) {
    if (figures.rounding > figures.totals.certified)
        warnOnTerminal(fmt::format("{} keeps single precision, which moves points by up to {}; a .ply or .obj does not",
                                   job.command.output, formatLength(figures.rounding)));
    if (job.command.report.json) {
        Json json = toJson(job, cut, figures.certified, figures.fileBytes);
        json["triangles"] = figures.totals.triangles;
        json["vertices"] = figures.totals.vertices;
        json["rounding"] = figures.rounding;
        VCP_TRY(printJson(json));
        return 0;
    }
    const std::string vertices =
        figures.totals.vertices > 0 ? ", " + formatCount(figures.totals.vertices, "vertex", "vertices") : "";
    VCP_TRY(printLine(fmt::format("{}: {}{}, level {} of 0 to {}, {} in {}\n  within {} of the mesh, both ways",
                                  job.command.output, formatCount(figures.totals.triangles, "triangle"), vertices,
                                  cut.level(), job.levels() - 1, formatBytes(figures.fileBytes),
                                  formatSeconds(job.seconds()), formatLength(figures.certified))));
    return 0;
}

Result<int> runMesh(const Job& job) {
    VCP_TRY_ASSIGN(const uint32_t first, levelOf(job, {}));
    for (uint32_t level = first;; ++level) {
        VCP_TRY_ASSIGN(const auto cut, cutOf(job, level));
        ProgressDisplay display(job.command.report.progressStyle(), stderr);
        // Polygons of a level may be farther from the mesh than what is drawn of it; the finest are not.
        const bool isLast = level + 1 == job.levels();
        const auto figures = exportMesh(*job.reader, cut,
                                        {.output = job.command.output,
                                         .kind = job.command.kind(),
                                         .rules = job.rules(),
                                         .notes = notesOf(job, cut),
                                         .mostError = isLast ? 0 : mostErrorOf(job),
                                         .stream = streamOptions(job, display)});
        display.finish();
        if (!figures) return figures.error();
        if (!figures->isTooCoarse) return reportMesh(job, cut, *figures);
    }
}

Result<int> runSection(const Job& job) {
    const PlaneChoice& choice = *job.command.section;
    const CutPlane plane{choice.normal, offsetIn(choice, boundsOf(job.dataset.header))};
    VCP_TRY_ASSIGN(const uint32_t level, levelOf(job, plane));
    VCP_TRY_ASSIGN(const auto cut, cutOf(job, level, plane));
    ProgressDisplay display(job.command.report.progressStyle(), stderr);
    const auto figures = exportSection(*job.reader, cut,
                                       {.output = job.command.output,
                                        .kind = job.command.kind(),
                                        .rules = job.rules(),
                                        .notes = notesOf(job, cut),
                                        .plane = plane,
                                        .unit = job.command.unit,
                                        .stream = streamOptions(job, display)});
    display.finish();
    if (!figures) return figures.error();
    const std::string unit = job.command.unit ? " " + std::string(job.command.unit->name) : "";
    if (job.command.report.json) {
        Json json = toJson(job, cut, figures->certified, figures->fileBytes);
        json["lines"] = figures->lines;
        json["closed_lines"] = figures->closedLines;
        json["points"] = figures->points;
        json["length"] = figures->length;
        VCP_TRY(printJson(json));
        return 0;
    }
    VCP_TRY(printLine(
        fmt::format("{}: {}, {} of them closed, {}, {}{} long, level {} of 0 to {}, {}\n  of a surface within {} of "
                    "the mesh",
                    job.command.output, formatCount(figures->lines, "line"), formatCount(figures->closedLines),
                    formatCount(figures->points, "point"), formatLength(figures->length), unit, cut.level(),
                    job.levels() - 1, formatBytes(figures->fileBytes), formatLength(figures->certified))));
    return 0;
}

Result<int> run(const ExportCommand& command) {
    const auto usage = [](const char* message) { return Error{.code = ErrorCode::Usage, .message = message}; };
    if (command.isDrawing() != command.section.has_value())
        return usage("--section goes with -o OUT.svg or OUT.dxf, and a mesh with .ply, .obj, .stl or .glb");
    if (command.level && command.error) return usage("--level and --error both choose the level; give one");
    const InterruptScope catching;
    VCP_TRY_ASSIGN(const auto reader, openReader(command.file, command.source));
    VCP_TRY_ASSIGN(const auto dataset, readDataset(*reader));
    const Job job{command, reader, dataset};
    VCP_TRY(checkOutput(command.output, command.kind(), job.rules()));
    return command.section ? runSection(job) : runMesh(job);
}

std::string checkName(const std::string& name) {
    return isExportKind(outputKindOf(name)) ? std::string()
                                            : "must end in .ply, .obj, .stl, .glb, .svg or .dxf, not \"" + name + "\"";
}

}  // namespace

Command addExport(CLI::App& vcp) {
    auto command = std::make_shared<ExportCommand>();
    CLI::App* app =
        vcp.add_subcommand("export", "Write the surface of a .vcp file as a mesh, or a section as a drawing");
    app->add_option("FILE", command->file, "A .vcp file, a folder of shards, or the http(s) address of either")
        ->type_name("")
        ->required();
    beginGroup(*app, help_group::kOutput);
    app->add_option("-o,--output", command->output,
                    "The file to write, its format by its name: .ply, .obj, .stl or .glb, or with --section .svg or "
                    ".dxf")
        ->type_name("OUT")
        ->required()
        ->check(checkName);
    addOverwriteOption(*app, command->overwrite);
    beginGroup(*app, help_group::kPart);
    app->add_option("--level", command->level, "Level to export, 0 the coarsest [the finest, which is the mesh itself]")
        ->type_name("N");
    addParsed(*app, "--error", command->error, parseLength, "like 0.25 or 0.01%",
              "Export the coarsest level within this distance of the mesh: world units, or a part of the bounding "
              "box's diagonal")
        ->type_name("LENGTH");
    addParsed(*app, "--section", command->section, parsePlane, "like \"x<0.2\", \"z>50%\" or \"a,b,c,d\"",
              "The lines in which a plane cuts the surface: x<0.2, z>50% (of the bounding box), or a,b,c,d for ax + by "
              "+ cz = d")
        ->type_name("PLANE");
    addParsed(*app, "--box", command->box, parseBox, "like 0,0,0,1,1,1, a corner and the opposite one",
              "Only triangles whose centre lies in a box: boxes side by side share none")
        ->type_name("X,Y,Z,X,Y,Z");
    addUnit(*app, command->unit, "What one unit of the file is: drawings get it, and their true size [unknown]");
    app->add_flag("--colour,!--no-colour", command->colour, "Write colours where the file has them [on]");
    addSourceSettings(*app, command->source);
    beginGroup(*app, help_group::kReport);
    app->add_option("--threads", command->threads, "Threads that read [one a processor]")
        ->type_name("N")
        ->check(CLI::Range(1, 1024));
    addProgressOption(*app, command->report);
    addJsonOption(*app, command->report);
    return {app, [command] { return run(*command); }};
}

}  // namespace vcp
