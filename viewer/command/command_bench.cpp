// vcp bench: run time against error, beside a peer measured in the same run.
#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include "viewer/bench/bench_build.h"
#include "viewer/bench/bench_meso.h"
#include "viewer/bench/frames/bench_frames.h"
#include "viewer/bench/rays/bench_methods.h"
#include "viewer/bench/rays/bench_rays.h"
#include "viewer/bench/stress/bench_stream.h"
#include "viewer/bench/stress/stress_path.h"
#include "viewer/command/bench_command.h"
#include "viewer/command/paper_arguments.h"
#include "viewer/command/parsed_option.h"
#include "viewer/command/source_arguments.h"
#include "viewer/scene/option_values.h"

namespace vcp {

namespace {

struct BuildBenchCommand : BenchCommand {
    std::vector<uint64_t> generated;
    std::vector<double> errors;
    uint64_t memoryBytes = 0;
    std::string temp;
    uint64_t samples = BenchBuildOptions().samples;
};

struct RaysCommand : BenchCommand {
    std::vector<std::string> methods, cameras;
    glm::ivec2 size{1920, 1200};
    std::string device;
    int views = 1;
    int judgeEvery = 1;
    bool sweep = false, stability = false, frames = false;
    PaperOptions paper;
};

struct StreamCommand {
    BenchCommand bench;
    std::vector<uint64_t> budgets{64 << 20, 256 << 20, 1 << 30};
    std::vector<std::string> paths = BenchStreamOptions().paths;
    glm::ivec2 size{320, 200};
    uint64_t ramBytes = 256 << 20;
    std::string device;
    int frames = 240;
    double errorPixels = StressOptions().errorPixels;
    SourceAccess source;
};

constexpr const char* kBestDevice = "best";
constexpr const char* kSweep = "sweep";
constexpr const char* kTessellation = "tessellation";

struct MesoCommand {
    BenchMesoOptions options;
    std::string device;  ///< empty: the CPU
    std::string remesh;  ///< empty: it is not measured
    BenchCommand bench;
};

/// Returns the path of make_scan, which lies beside vcp.
Result<std::filesystem::path> findMakeScan() {
    std::error_code failed;
    const auto self = std::filesystem::read_symlink("/proc/self/exe", failed);
    auto program = self.parent_path() / "make_scan";
    if (!failed && ::access(program.c_str(), X_OK) == 0) return program;
    return Error{.code = ErrorCode::Usage,
                 .message = "--generated needs the program make_scan beside vcp, and it is not there",
                 .file = program.string()};
}

Result<int> runBuild(const BuildBenchCommand& command) {
    if (command.models.empty() && command.generated.empty())
        return Error{.code = ErrorCode::Usage,
                     .message = "which meshes? name them, or make some with --generated 1M,10M"};
    BenchBuildOptions options;
    takeShared(command, options);
    options.generated = command.generated;
    if (!options.generated.empty()) {
        VCP_TRY_ASSIGN(options.makeScan, findMakeScan());
    }
    VCP_TRY(makeFolder(command.out));
    options.errors = command.errors;
    options.memoryBytes = command.memoryBytes;
    options.temp = command.temp;
    options.samples = command.samples;
    VCP_TRY_ASSIGN(const auto report, runShown(command, benchBuild, options, options.progress));
    if (report.rows.empty() && !report.failures.empty()) return report.failures.front();
    const auto published =
        publish(command, "bench_build",
                {benchBuildJson(report), benchBuildCsv(report), benchBuildMarkdown(report), benchBuildPlots(report)});
    if (!published || report.failures.empty()) return published;
    // What could be measured is published; the first failure is the error.
    return report.failures.front();
}

Result<int> runFrames(const RaysCommand& command) {
    if (command.models.empty())
        return Error{.code = ErrorCode::Usage, .message = "which models? name meshes, or .vcp files beside theirs"};
    BenchFramesOptions options;
    takeShared(command, options);
    if (!command.cameras.empty()) options.cameras = command.cameras;
    options.size = command.size;
    VCP_TRY_ASSIGN(const auto rows, runShown(command, benchFrames, options, options.progress));
    return publish(command, "bench_frames", {benchFramesJson(rows), benchFramesCsv(rows), benchFramesMarkdown(rows)});
}

Result<int> runRays(const RaysCommand& command) {
    VCP_TRY(makeFolder(command.out));
    if (command.frames) return runFrames(command);
    BenchRaysOptions options;
    takeShared(command, options);
    options.methods = command.methods;
    if (!command.cameras.empty()) options.cameras = command.cameras;
    options.size = command.size;
    options.views = command.views;
    options.device = command.device;
    options.judgeEvery = command.judgeEvery;
    options.sweep = command.sweep;
    options.stability = command.stability;
    options.paper = command.paper;
    options.paper.mergeScheme = command.paper.march.scheme;
    VCP_TRY_ASSIGN(const auto report, runShown(command, benchRays, options, options.progress));
    return publish(command, "bench_rays",
                   {benchRaysJson(report), benchRaysCsv(report), benchRaysMarkdown(report), benchRaysPlots(report)});
}

Result<int> runStream(const StreamCommand& command) {
    VCP_TRY(makeFolder(command.bench.out));
    BenchStreamOptions options;
    options.models = command.bench.models;
    options.paths = command.paths;
    options.budgets = command.budgets;
    options.access = command.source;
    options.out = command.bench.out;
    options.run.size = command.size;
    options.run.frames = command.frames;
    options.run.errorPixels = command.errorPixels;
    options.run.renderer.device = command.device;
    options.run.renderer.ramBytes = command.ramBytes;
    VCP_TRY_ASSIGN(const auto rows, runShown(command.bench, benchStream, options, options.run.progress));
    VCP_TRY(publish(command.bench, "bench_stream",
                    {benchStreamJson(rows), benchStreamCsv(rows), benchStreamMarkdown(rows), benchStreamPlots(rows)}));
    return std::ranges::all_of(rows, [](const StressReport& row) { return row.violations.empty(); }) ? 0 : 1;
}

Result<int> runMeso(const MesoCommand& command) {
    VCP_TRY(makeFolder(command.bench.out));
    BenchMesoOptions options = command.options;
    if (!command.device.empty()) options.device = command.device == kBestDevice ? "" : command.device;
    options.remesh = !command.remesh.empty(), options.tessellation = command.remesh == kTessellation;
    VCP_TRY_ASSIGN(const auto report, runShown(command.bench, benchMeso, options, options.progress));
    return publish(command.bench, "bench_meso",
                   {benchMesoJson(report), benchMesoCsv(report), benchMesoMarkdown(report), benchMesoPlots(report)});
}

std::optional<uint64_t> parseScanSize(const std::string& text) {
    const auto count = parseCount(text);
    return count && *count >= 10'000 && *count <= 1'000'000'000 ? count : std::nullopt;
}

RunCommand addBenchBuild(CLI::App& bench) {
    auto command = std::make_shared<BuildBenchCommand>();
    CLI::App* app = bench.add_subcommand("build", "Time the build, beside Embree building its tree");
    addBenchOptions(*app, *command, "Meshes");
    addParsedList(*app, "--generated", command->generated, parseScanSize, "like 500k, 10M or 1G, from 10k to 1G",
                  "Also build scans of so many triangles, made by make_scan: 1M,10M,100M")
        ->type_name("N,N")
        ->delimiter(',');
    app->add_option("--errors", command->errors, "Also build each mesh with these tolerances, in cells: 0.02,0.05,0.1")
        ->type_name("X,X")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->check(CLI::Range(1e-6, 1e3));
    addMemory(*app, command->memoryBytes,
              "Cap on the memory that a build allocates: 512M, 4G, 50% [half of the machine's]");
    app->add_option("--temp", command->temp, "Folder for temporary files and generated scans [that of what is built]")
        ->type_name("DIR")
        ->check(CLI::ExistingDirectory);
    app->add_option("--samples", command->samples, "Samples of the distance between mesh and surface; 0: not measured")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(0, 1'000'000'000));
    return [command] { return runBuild(*command); };
}

RunCommand addBenchRays(CLI::App& bench) {
    auto command = std::make_shared<RaysCommand>();
    CLI::App* app = bench.add_subcommand("rays", "Time and judge ray-casters, beside Embree's packets");
    addBenchOptions(
        *app, *command,
        "Meshes, or .vcp files beside the meshes they were built from [a sphere, a torus and a thin plate]");
    app->add_option("--methods", command->methods,
                    fmt::format("{} [all but paper-rules, paper-subvolumes]", fmt::join(rayMethodNames(), ", ")))
        ->type_name("A,B")
        ->delimiter(',')
        ->allow_extra_args(false);
    app->add_flag("--sweep", command->sweep,
                  "Each method at several values of its knob: error-pixels of certified and host, eps of paper, cell "
                  "of the other octrees");
    app->add_flag("--stability", command->stability,
                  "Also what single precision costs, on the processor and on the device, with cells from 1e-6 to 1e6 "
                  "and origins to 1e7 cells");
    app->add_flag("--frames", command->frames,
                  "Instead, whole frames of the host beside Embree's: hits alone, light, shadows, 8 occlusion rays");
    app->add_option("--cameras", command->cameras,
                    "whole, half, close, cells [these four]; lattice and grazing, which look for holes")
        ->type_name("A,B")
        ->delimiter(',')
        ->allow_extra_args(false);
    app->add_option("--views", command->views, "Directions that each camera looks from")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000));
    addSize(*app, command->size, "1920x1200", "Rays across and down")->default_str(sizeText(command->size));
    app->add_option("--judge-every", command->judgeEvery, "Compare every Nth row and column with the mesh")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(1, 16384));
    app->add_option("--device", command->device,
                    "Vulkan device of the methods certified and paper-...gpu, see `vcp devices` [the best one]")
        ->type_name("DEVICE");
    addPaperMarchOptions(*app, command->paper.march);
    addPaperStructureOptions(*app, command->paper);
    addPaperSubvolumesOption(*app, command->paper.subvolumeCells, "64, of the methods paper-subvolumes");
    return [command] { return runRays(*command); };
}

RunCommand addBenchStream(CLI::App& bench) {
    auto command = std::make_shared<StreamCommand>();
    CLI::App* app =
        bench.add_subcommand("stream", "Stream along camera paths under budgets, beside the same frames without loads");
    app->add_option("MODEL", command->bench.models,
                    ".vcp files, their http(s) addresses, or meshes [a sphere, a torus and a thin plate]")
        ->type_name("");
    addParsedList(*app, "--budgets", command->budgets, parseBudget, "at least 1M, like 64M or 1G",
                  "Memory of the device that detail may take")
        ->type_name("N,N")
        ->delimiter(',')
        ->default_str("64M,256M,1G");
    app->add_option("--paths", command->paths,
                    fmt::format("{}, or a file: a JSON array of cameras", fmt::join(stressPathNames(), ", ")))
        ->type_name("A,B")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->capture_default_str();
    app->add_option("--frames", command->frames, "Frames along a path")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(1, 1'000'000));
    addSize(*app, command->size, "320x200", "Width and height in pixels")->default_str(sizeText(command->size));
    addBudget(*app, "--ram", command->ramBytes,
              "Main memory that detail may take on its way there, and to be kept for later")
        ->default_str("256M");
    app->add_option("--error-pixels", command->errorPixels, "Error that a picture may have, in pixels")
        ->type_name("PIXELS")
        ->capture_default_str()
        ->check(CLI::Range(0.01, 1000.0));
    app->add_option("--device", command->device, "Vulkan device, see `vcp devices` [the best one]")
        ->type_name("DEVICE");
    app->add_option("--out", command->bench.out,
                    "Folder for the report as JSON, CSV, Markdown and plots, and for what is built")
        ->type_name("DIR");
    addOverwriteOption(*app, command->bench.overwrite);
    addSourceSettings(*app, command->source);
    addProgressOption(*app, command->bench.report);
    addJsonOption(*app, command->bench.report);
    app->footer("Exit status 1 when an invariant of streaming breaks (vcp stress).");
    return [command] { return runStream(*command); };
}

RunCommand addBenchMeso(CLI::App& bench) {
    auto command = std::make_shared<MesoCommand>();
    BenchMesoOptions& options = command->options;
    CLI::App* app = bench.add_subcommand("meso", "Time and judge the mesostructure marchers");
    app->add_option("ASSET", options.assets, "Procedural ones by name, or assets (.meso) [eleven procedural ones]")
        ->type_name("");
    app->add_option("--methods", options.methods, fmt::format("{} [all]", fmt::join(mesoMethodNames(), ", ")))
        ->type_name("A,B")
        ->delimiter(',')
        ->allow_extra_args(false);
    app->add_option("--views", options.views, fmt::format("{} [all]", fmt::join(mesoViewNames(), ", ")))
        ->type_name("A,B")
        ->delimiter(',')
        ->allow_extra_args(false);
    app->add_flag("--sweep", options.sweep, "Each method at several values of its knob");
    app->add_flag("--factors", options.factors,
                  "Also compare factors of displacement maps, published and clustered, with the distances");
    app->add_flag("--shadows", options.shadows,
                  "Also compare shadows by displacement maps, asked from several heights, with the surface's own");
    app->add_flag(
        "--light", options.light,
        "Also compare light from everywhere on a tile, and on two bases, in the three skies, with a path tracer");
    app->add_flag("--prisms", options.prisms,
                  "Also measure what maps from prisms to the tile distort: one line, tetrahedra, the curved path");
    app->add_flag("--bases", options.bases,
                  "Also measure view-dependent maps with and without curvatures, on a plane, cylinders, a sphere and "
                  "tori, by the host or on the device");
    app->add_flag("--models", options.models,
                  "Also time frames of six models that the paper prints rates of, a covered pixel and a prism, by the "
                  "host or on the device");
    app->add_flag("--published", options.published,
                  "Beside the ratios of the papers' tables, each method at the knobs that these are of");
    app->add_option("--remesh", command->remesh,
                    "Remeshing of the height fields as well: error in pixels, vertices and time, by cell and filter; "
                    "sweep, or tessellation: beside it, by a device's tessellator [sweep]")
        ->type_name("WAY")
        ->expected(0, 1)
        ->default_str(kSweep)
        ->check(CLI::IsMember({kSweep, kTessellation}));
    app->add_option(
           "--device", command->device,
           "March and remesh on a Vulkan device: an index, or =NAME, a part of its name; without either the best [the "
           "CPU]")
        ->type_name("DEVICE")
        ->expected(0, 1)
        ->default_str(kBestDevice);
    app->add_option("--rays", options.rays, "Rays a view")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(1, 10'000'000));
    app->add_option("--repetitions", options.repetitions, "Runs whose median is reported")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000));
    app->add_option("--check-rays", options.checkRays,
                    "Rays of the test that no distance passes the surface; 0: not made")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(0, 1'000'000'000));
    app->add_option("--out", command->bench.out, "Folder for the report as JSON, CSV, Markdown and plots")
        ->type_name("DIR");
    addOverwriteOption(*app, command->bench.overwrite);
    addProgressOption(*app, command->bench.report);
    addJsonOption(*app, command->bench.report);
    return [command] { return runMeso(*command); };
}

}  // namespace

Command addBench(CLI::App& vcp) {
    CLI::App* app = vcp.add_subcommand("bench", "Measure run time against error, beside a peer");
    app->require_subcommand(1);
    const std::vector<RunCommand> runs{addBenchBuild(*app),  addBenchRays(*app),   addBenchPicture(*app),
                                       addBenchColour(*app), addBenchStream(*app), addBenchMeso(*app)};
    return {app, [=] {
                const auto all = app->get_subcommands([](CLI::App*) { return true; });
                const auto at = std::ranges::find_if(all, [](const CLI::App* each) { return each->parsed(); });
                return runs[size_t(at - all.begin())]();
            }};
}

}  // namespace vcp
