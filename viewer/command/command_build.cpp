// vcp build: meshes in, one .vcp out.
#include <cmath>

#include <fmt/format.h>

#include "builder/build.h"
#include "builder/estimate.h"
#include "builder/paper/paper_file.h"
#include "octree/io/durable_file.h"
#include "viewer/command/build_arguments.h"
#include "viewer/command/commands.h"
#include "viewer/command/manual/help_text.h"
#include "viewer/command/paper_arguments.h"
#include "viewer/command/shard_arguments.h"
#include "viewer/command/terminal/interrupt.h"
#include "viewer/scene/option_values.h"

namespace vcp {

namespace {

struct BuildCommand {
    std::vector<std::string> inputs;
    std::string output;
    bool resume = false;
    bool dryRun = false;
    bool overwrite = false;
    uint64_t shardBytes = 0;  ///< 0: one file
    double checkpointSeconds = BuildOptions().checkpointSeconds;
    std::string method = "certified";
    PaperOptions paper;
    bool paperOptionsGiven = false;
    BuildOptions settings;

    [[nodiscard]] bool isPaper() const { return method == "paper"; }
    ReportOptions report;
};

std::string summary(const std::string& output, const BuildReport& report) {
    const double triangles = double(std::max<uint64_t>(report.triangles, 1));
    const std::string rate = report.isResumed
                                 ? "since it was resumed"
                                 : fmt::format("({:.2f} M/s)", 1e-6 * triangles / std::max(report.seconds, 1e-9));
    std::string text =
        fmt::format("{}: {} in {} {}, peak memory {}\n", output, formatCount(report.triangles, "triangle"),
                    formatSeconds(report.seconds), rate, formatBytes(report.peakRssBytes));
    if (report.degenerateTriangles > 0)
        text += fmt::format("  left out: {} without area\n", formatCount(report.degenerateTriangles, "triangle"));
    if (report.cutTriangles > 0)
        text += fmt::format("  masks cut {} of the mesh\n", formatCount(report.cutTriangles, "triangle"));
    for (const std::string& warning : report.warnings) text += fmt::format("  {}\n", warning);
    text += fmt::format("  {} ({:.1f} bytes a triangle), {}, {}, {}, {} of them hard\n", formatBytes(report.fileBytes),
                        double(report.fileBytes) / triangles, formatCount(report.levels, "level"),
                        formatCount(report.subvolumes, "subvolume"), formatCount(report.leaves, "leaf", "leaves"),
                        formatCount(report.hardLeaves));
    text += fmt::format("  cell {}, ", formatLength(report.cell));
    if (std::isnan(report.certifiedErrorMax)) return text + "no certified error";
    return text + fmt::format("certified error {} ({:.3f} cells)", formatLength(report.certifiedErrorMax),
                              report.certifiedErrorMax / report.cell);
}

Json toJson(const BuildEstimate& estimate) {
    const SoupMeasures& m = estimate.measures;
    return {{"triangles", m.triangles},
            {"degenerate_triangles", m.degenerateTriangles},
            {"vertices", m.vertices},
            {"vertex_colours", m.hasVertexColours},
            {"materials", m.hasMaterials},
            {"bounds_min", {m.boundsMin.x, m.boundsMin.y, m.boundsMin.z}},
            {"bounds_max", {m.boundsMax.x, m.boundsMax.y, m.boundsMax.z}},
            {"cell", estimate.frame.cell},
            {"levels", estimate.frame.levels},
            {"memory_bytes", estimate.memoryBytes},
            {"memory_cap_bytes", estimate.memoryCap},
            {"temp_bytes", estimate.tempBytes},
            {"free_temp_bytes", estimate.freeTempBytes},
            {"file_bytes", estimate.fileBytes},
            {"free_output_bytes", estimate.freeOutputBytes},
            {"seconds", estimate.seconds},
            {"warnings", estimate.warning ? Json::array({*estimate.warning}) : Json::array()}};
}

std::string summary(const BuildEstimate& estimate) {
    const SoupMeasures& m = estimate.measures;
    std::string text = fmt::format("{} ({} without area), {}, {}\n", formatCount(m.triangles, "triangle"),
                                   formatCount(m.degenerateTriangles), formatCount(m.vertices, "vertex", "vertices"),
                                   m.hasVertexColours ? "with colours"
                                   : m.hasMaterials   ? "with materials"
                                                      : "no colour");
    text += fmt::format("  bounds      {:.9g} {:.9g} {:.9g}  to  {:.9g} {:.9g} {:.9g}\n", m.boundsMin.x, m.boundsMin.y,
                        m.boundsMin.z, m.boundsMax.x, m.boundsMax.y, m.boundsMax.z);
    text += fmt::format("  cell        {}{}, {}\n", estimate.isAreaComplete ? "" : "about ",
                        formatLength(estimate.frame.cell), formatCount(estimate.frame.levels, "level"));
    if (estimate.warning) text += fmt::format("  {}\n", *estimate.warning);
    text += fmt::format("  memory      about {}, at most {}\n", formatBytes(estimate.memoryBytes),
                        formatBytes(estimate.memoryCap));
    text += estimate.tempBytes == 0 ? std::string("  temporary   nothing: it fits memory, and is soon done\n")
                                    : fmt::format("  temporary   up to {} of {} free\n",
                                                  formatBytes(estimate.tempBytes), formatBytes(estimate.freeTempBytes));
    text += fmt::format("  file        about {} of {} free\n", formatBytes(estimate.fileBytes),
                        formatBytes(estimate.freeOutputBytes));
    text += fmt::format("  time        about {}", formatSeconds(estimate.seconds));
    return text;
}

/// Reports what the build would need; nothing is written but a sample, which goes again.
Result<int> tell(const BuildOptions& options, bool asJson) {
    VCP_TRY_ASSIGN(const auto estimate, estimateBuild(options));
    if (asJson)
        VCP_TRY(printJson(toJson(estimate)));
    else
        VCP_TRY(printLine(summary(estimate)));
    return 0;
}

/// Refuses options that do not go with the method.
Result<void> checkMethod(const BuildCommand& command) {
    const auto usage = [](const char* message) { return Error{.code = ErrorCode::Usage, .message = message}; };
    const BuildOptions& s = command.settings;
    if (!command.isPaper() && command.paperOptionsGiven) return usage("the options --paper-... go with --method paper");
    if (!command.isPaper()) return {};
    if (s.error > 0 || s.colour == ColourChoice::Vertex || s.colour == ColourChoice::Texture)
        return usage("--method paper has neither a tolerance (--error) nor colour");
    if (command.shardBytes > 0) return usage("--method paper makes files that are not cut into shards");
    if (command.resume || command.dryRun) return usage("--method paper goes without --resume and --dry-run");
    if (command.paper.subvolumeCells == 0 && (s.memoryBytes > 0 || !s.temp.empty()))
        return usage("--method paper builds one page in memory: --memory and --temp go with --paper-subvolumes");
    return {};
}

/// Returns where the one file is built that is cut into shards then.
std::string wholeFileOf(const std::string& folder) {
    const std::filesystem::path named(folder);
    return (named.has_filename() ? named : named.parent_path()).string() + ".whole.vcp";
}

/// Cuts what was built into shards, and removes it. Where that fails it stays, and the error says how to go on.
Result<ShardReport> cutIntoShards(const BuildCommand& command, const BuildOptions& options) {
    auto report = [&]() -> Result<ShardReport> {
        VCP_TRY_ASSIGN(const auto whole, openFile(options.output));
        return shardWithProgress(*whole, command.output, command.shardBytes, options.inputs,
                                 command.report.progressStyle());
    }();
    if (!report) {
        Error error = report.error();
        error.message += fmt::format("; the mesh is built: `vcp shard {} -o {} --size {}` goes on from there",
                                     options.output.string(), command.output, command.shardBytes);
        return error;
    }
    std::error_code failed;
    if (!std::filesystem::remove(options.output, failed))
        return systemError(options.output, "cannot be removed", failed.value());
    return report;
}

Result<int> run(const BuildCommand& command) {
    VCP_TRY(checkMethod(command));
    BuildOptions options = command.settings;
    options.inputs.assign(command.inputs.begin(), command.inputs.end());
    if (command.output.empty() && !command.dryRun)
        return Error{.code = ErrorCode::Usage, .message = "--output is required; only --dry-run does without"};
    const std::string folder = command.shardBytes > 0 ? command.output : std::string();
    options.output = command.output.empty() ? "." : folder.empty() ? command.output : wholeFileOf(folder);
    if (!folder.empty() && !command.dryRun) {
        VCP_TRY(checkShardFolder({.folder = folder, .inputs = options.inputs}));
        std::error_code ignored;
        if (std::filesystem::exists(options.output, ignored))
            return Error{.code = ErrorCode::Usage,
                         .message =
                             "is there, where the file that is cut would be built: cut it with `vcp shard` if an "
                             "interrupted build left it, or move it away",
                         .file = options.output.string()};
    }
    options.resume = command.resume;
    options.overwrite = command.overwrite;
    options.checkpointSeconds = command.checkpointSeconds;
    ProgressDisplay display(command.report.progressStyle(), stderr);
    const InterruptScope catching;
    options.progress = [&](const BuildProgress& at) {
        display.update(at.stage, at.fraction, detailsOf(at));
        return !interrupted();
    };
    if (command.dryRun) return tell(options, command.report.json);
    const auto report = command.isPaper() ? buildPaperFile(options, command.paper) : buildOctree(options);
    display.finish();
    if (!report) return report.error();
    std::optional<ShardReport> shards;
    if (!folder.empty()) {
        VCP_TRY_ASSIGN(shards, cutIntoShards(command, options));
    }
    if (command.report.json) {
        Json json = toJson(*report);
        if (shards) json.update(toJson(*shards));
        json["cut_triangles"] = report->cutTriangles;
        json["warnings"] = report->warnings;
        VCP_TRY(printJson(json));
    } else {
        VCP_TRY(printLine(summary(command.output, *report) + (shards ? "\n  " + summary(*shards) : "")));
    }
    return 0;
}

}  // namespace

Command addBuild(CLI::App& vcp) {
    auto command = std::make_shared<BuildCommand>();
    CLI::App* app = vcp.add_subcommand("build", "Build meshes into a .vcp file");
    addBuildInputs(*app, command->inputs,
                   "Meshes: PLY, OBJ, STL, OFF, glTF, GLB, Draco, also as .gz or .zst; several are joined, a folder "
                   "stands for those in it, - for standard input");
    beginGroup(*app, help_group::kOutput);
    addBuildOutput(*app, command->output);
    addShardBytes(*app, "--shards", command->shardBytes);
    addOverwriteOption(*app, command->overwrite);
    app->add_flag("--resume", command->resume, "Go on where an interrupted build of the same output was");
    app->add_option("--checkpoint", command->checkpointSeconds,
                    "Seconds between the times at which what is done is made safe from a crash, at least")
        ->type_name("SECONDS")
        ->capture_default_str()
        ->check(CLI::NonNegativeNumber);
    app->add_flag("--dry-run", command->dryRun,
                  "Say what is in the meshes and what the build would need; write nothing");
    addBuildSettings(*app, command->settings, help_group::kBuilding);
    beginGroup(*app, help_group::kPaper);
    app->add_option("--method", command->method,
                    "certified, or paper: their octree, for comparison (no colour, nothing certified)")
        ->type_name("certified|paper")
        ->capture_default_str()
        ->check(CLI::IsMember({"certified", "paper"}));
    addPaperStructureOptions(*app, command->paper);
    addPaperSchemeOption(*app, command->paper.mergeScheme);
    addPaperSubvolumesOption(*app, command->paper.subvolumeCells, "one page, in memory");
    addProgressOption(*app, command->report);
    addJsonOption(*app, command->report);
    return {app, [command, app] {
                for (const CLI::Option* option : app->get_options())
                    command->paperOptionsGiven = command->paperOptionsGiven ||
                                                 (option->count() > 0 && option->get_name().starts_with("--paper-"));
                return run(*command);
            }};
}

}  // namespace vcp
