// vcp stress: streaming under budgets, faults and camera paths; a report.
#include <chrono>
#include <filesystem>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "streaming/web_address.h"
#include "viewer/bench/motion_bench.h"
#include "viewer/bench/stress/stress.h"
#include "viewer/bench/stress/stress_path.h"
#include "viewer/command/build_arguments.h"
#include "viewer/command/commands.h"
#include "viewer/command/parsed_option.h"
#include "viewer/command/source_arguments.h"
#include "viewer/command/terminal/interrupt.h"
#include "viewer/scene/render_settings.h"

namespace vcp {

namespace {

struct StressCommand {
    std::string file, out, faults;
    std::string path = "orbit";
    glm::ivec2 size{640, 400};
    uint64_t budgetBytes = 256 << 20, ramBytes = 256 << 20;
    std::vector<LoadOrder> orders{LoadOrder::Feedback};
    std::string device;
    uint64_t seed = 1;
    int frames = 120;
    int views = 1;
    double errorPixels = 0.5;
    double motionSeconds = 0;  // 0: not given
    bool overwrite = false;
    SourceAccess source;
    ReportOptions report;
};

Result<void> writeReport(const StressCommand& command, const StressReport& report) {
    if (command.out.empty()) return {};
    const std::filesystem::path folder = command.out;
    std::error_code failed;
    std::filesystem::create_directories(folder, failed);
    if (failed)
        return Error{
            .code = ErrorCode::Io, .message = "the folder cannot be made: " + failed.message(), .file = command.out};
    const OutputRules rules{.overwrite = command.overwrite, .inputs = {command.file, command.path}};
    VCP_TRY(writeFile(folder / "stress.json", OutputKind::JsonText, stressJson(report), rules));
    VCP_TRY(writeFile(folder / "stress.md", OutputKind::Text, stressMarkdown(report), rules));
    for (const auto& [name, svg] : stressPlots(report))
        VCP_TRY(writeFile(folder / (name + ".svg"), OutputKind::Svg, svg, rules));
    return {};
}

StressOptions optionsFor(const StressCommand& command, const OpenDataset& open) {
    StressOptions options;
    options.name = std::filesystem::path(shownAddress(command.file)).filename().string();
    options.path = command.path;
    options.faults = parseFaults(command.faults).value();
    options.faults.seed = command.seed;
    options.seed = command.seed;
    options.size = command.size;
    options.frames = command.frames;
    options.views = command.views;
    options.errorPixels = command.errorPixels;
    options.renderer.device = command.device;
    options.renderer.budgetBytes = command.budgetBytes;
    options.renderer.ramBytes = command.ramBytes;
    options.orders = command.orders;
    options.renderer.order = options.orders[0];
    // Where reads are made to stall or fail late, more threads wait for them, as for a server.
    const bool isSlow = open.isRemote || options.faults.stallSeconds > 0 || options.faults.latencySeconds > 0;
    options.renderer.loaderThreads = isSlow ? 8 : open.loaderThreads();
    return options;
}

Result<int> runMotion(const StressCommand& command) {
    VCP_TRY_ASSIGN(const auto open,
                   openSceneShown({command.file}, {}, command.source, command.report.progressStyle(), {}));
    MotionOptions options;
    options.viewer.renderer.device = command.device;
    options.viewer.renderer.budgetBytes = command.budgetBytes;
    options.viewer.renderer.ramBytes = command.ramBytes;
    options.viewer.renderer.order = command.orders[0];
    options.viewer.renderer.hostRays = leavesRaysToHost(command.device);  // as in the window
    options.viewer.errorPixels = command.errorPixels;
    options.size = command.size;
    options.seconds = command.motionSeconds;
    options.cancel = interrupted;
    VCP_TRY_ASSIGN(const auto report, measureMotion(open, options));
    VCP_TRY(command.report.json ? printJsonText(motionJson(report)) : printLine(motionText(report)));
    return 0;
}

Result<int> run(const StressCommand& command) {
    const InterruptScope catching;
    if (command.motionSeconds > 0) return runMotion(command);
    const auto start = std::chrono::steady_clock::now();
    VCP_TRY_ASSIGN(const auto open, openDataset(command.file, command.source));
    StressOptions options = optionsFor(command, open);
    options.openSeconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    ProgressDisplay display(command.report.progressStyle(), stderr);
    options.progress = [&](const std::string& what, double fraction) {
        display.update(what, fraction);
        return !interrupted();
    };
    auto report = runStress(open, options);
    display.finish();
    if (!report) return report.error();
    report->faults = command.faults;
    VCP_TRY(writeReport(command, *report));
    VCP_TRY(command.report.json ? printJsonText(stressJson(*report)) : printLine(stressMarkdown(*report)));
    return report->violations.empty() ? 0 : 1;
}

}  // namespace

Command addStress(CLI::App& vcp) {
    auto command = std::make_shared<StressCommand>();
    CLI::App* app =
        vcp.add_subcommand("stress", "Stream under budgets and faults along a camera path, and check every invariant");
    app->add_option("FILE", command->file,
                    "A .vcp file, a folder of shards, or the http(s) address of either; with --motion "
                    "also a scene file (.json) or a mesh")
        ->type_name("")
        ->required();
    app->add_option("--path", command->path,
                    fmt::format("{}, or a file: a JSON array of cameras", fmt::join(stressPathNames(), ", ")))
        ->type_name("PATH")
        ->capture_default_str();
    addBudget(*app, "--budget", command->budgetBytes, "Memory of the device that detail may take")->default_str("256M");
    addBudget(*app, "--ram", command->ramBytes,
              "Main memory that detail may take on its way there, and to be kept for later")
        ->default_str("256M");
    app->add_option("--faults", command->faults,
                    "error=0.1,corrupt=0.01 (rates of reads), stall=500ms,stalls=0.02, latency=50ms,spread=20ms, "
                    "bandwidth=2.5M (bytes a second)")
        ->type_name("A=X,B=Y")
        ->check([](const std::string& text) {
            return parseFaults(text) ? std::string() : "must be like error=0.1,stall=500ms, not \"" + text + "\"";
        });
    addParsed(*app, "--order", command->orders, parseOrders, "like feedback,nearest",
              "Which pages are read first: feedback (what the picture misses), error, nearest, breadth, random; of "
              "several, the first is used and all are compared on the path's last view")
        ->type_name("A,B")
        ->default_str("feedback");
    app->add_option("--seed", command->seed, "Of the faults and of the paths teleport and jitter")
        ->type_name("N")
        ->capture_default_str();
    app->add_option("--frames", command->frames, "Frames along the path")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(1, 1'000'000));
    app->add_option("--views", command->views,
                    "More than one: so many views then fly along the path together, with one pool and one budget")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(1, 100));
    addSize(*app, command->size, "640x400", "Width and height in pixels")->default_str(sizeText(command->size));
    app->add_option("--error-pixels", command->errorPixels, "Error that a picture may have, in pixels")
        ->type_name("PIXELS")
        ->capture_default_str()
        ->check(CLI::Range(0.01, 1000.0));
    CLI::Option* motion = app->add_option("--motion", command->motionSeconds,
                                          "Instead: turn once about what is shown in so many seconds, as the window "
                                          "draws it (smaller while it is slow), and count frames by size")
                              ->type_name("SECONDS")
                              ->check(CLI::Range(0.1, 3600.0));
    app->add_option("--device", command->device, "Vulkan device, see `vcp devices` [the best one]")
        ->type_name("DEVICE");
    app->add_option("--out", command->out, "Folder for the report as JSON and Markdown, and for its plots")
        ->type_name("DIR")
        ->excludes(motion);
    addOverwriteOption(*app, command->overwrite);
    addSourceSettings(*app, command->source);
    addProgressOption(*app, command->report);
    addJsonOption(*app, command->report);
    app->footer(
        "Exit status 1 when an invariant breaks: a budget exceeded, a view that does not settle or is called settled\n"
        "and is not, a page loaded twice in a still view, a picture that faults have changed.");
    return {app, [command] { return run(*command); }};
}

}  // namespace vcp
