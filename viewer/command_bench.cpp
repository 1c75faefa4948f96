// vcp bench: run time against error, beside Embree measured in the same run.
#include <fstream>

#include "viewer/bench_build.h"
#include "viewer/bench_rays.h"
#include "viewer/commands.h"
#include "viewer/interrupt.h"
#include "viewer/option_values.h"

namespace vcp {

namespace {

/// A report in its three forms.
struct BenchTexts {
    std::string json, csv, markdown;
};

struct BenchCommand {
    std::vector<std::string> models;
    std::string out;
    int repetitions = 0;  // 0: the bench's own default
    unsigned threads = 0;
    std::string cell;
    ReportOptions report;

    [[nodiscard]] std::vector<std::filesystem::path> modelPaths() const { return {models.begin(), models.end()}; }
    [[nodiscard]] double cellLength() const { return cell.empty() ? 0 : parseLength(cell)->value; }
};

struct RaysCommand : BenchCommand {
    std::vector<std::string> methods, cameras;
    std::string size = "1920x1200";
    std::string device;
    int views = 1;
    int judgeEvery = 1;
};

Result<void> writeText(const std::filesystem::path& path, const std::string& text) {
    std::ofstream file(path, std::ios::binary | std::ios::trunc);
    file << text;
    if (!text.ends_with('\n')) file << '\n';
    file.close();
    if (!file) return Error{ErrorCode::Io, "cannot be written", path.string()};
    return {};
}

Result<void> makeFolder(const std::string& folder) {
    std::error_code failed;
    if (!folder.empty()) std::filesystem::create_directories(folder, failed);
    if (failed) return Error{ErrorCode::Io, "the folder cannot be made: " + failed.message(), folder};
    return {};
}

/// Files into --out, and JSON or the table on stdout.
Result<int> publish(const BenchCommand& command, const std::string& name, const BenchTexts& texts) {
    if (!command.out.empty()) {
        const std::filesystem::path folder = command.out;
        VCP_TRY(writeText(folder / (name + ".json"), texts.json));
        VCP_TRY(writeText(folder / (name + ".csv"), texts.csv));
        VCP_TRY(writeText(folder / (name + ".md"), texts.markdown));
    }
    VCP_TRY(printLine(command.report.json ? texts.json : texts.markdown));
    return 0;
}

auto progressTo(ProgressDisplay& display) {
    return [&display](const std::string& what, double fraction) {
        display.update(what, fraction);
        return !interrupted();
    };
}

Result<int> runBuild(const BenchCommand& command) {
    VCP_TRY(makeFolder(command.out));
    BenchBuildOptions options;
    options.models = command.modelPaths();
    if (command.repetitions > 0) options.repetitions = command.repetitions;
    options.threads = command.threads;
    options.out = command.out;
    options.cell = command.cellLength();
    const InterruptScope catching;
    ProgressDisplay display(command.report.progressStyle(), stderr);
    options.progress = progressTo(display);
    const auto report = benchBuild(options);
    display.finish();
    if (!report) return report.error();
    return publish(command, "bench_build", {benchBuildJson(*report), benchBuildCsv(*report), benchBuildMarkdown(*report)});
}

Result<int> runRays(const RaysCommand& command) {
    VCP_TRY(makeFolder(command.out));
    BenchRaysOptions options;
    options.models = command.modelPaths();
    options.methods = command.methods;
    if (!command.cameras.empty()) options.cameras = command.cameras;
    options.size = parseSize(command.size).value();
    options.views = command.views;
    if (command.repetitions > 0) options.repetitions = command.repetitions;
    options.threads = command.threads;
    options.device = command.device;
    options.out = command.out;
    options.cell = command.cellLength();
    options.judgeEvery = command.judgeEvery;
    const InterruptScope catching;
    ProgressDisplay display(command.report.progressStyle(), stderr);
    options.progress = progressTo(display);
    const auto report = benchRays(options);
    display.finish();
    if (!report) return report.error();
    return publish(command, "bench_rays", {benchRaysJson(*report), benchRaysCsv(*report), benchRaysMarkdown(*report)});
}

void addBenchOptions(CLI::App& app, BenchCommand& command, const std::string& models) {
    app.add_option("MODEL", command.models, models)->type_name("")->required();
    app.add_option("--out", command.out, "Folder for the report as JSON, CSV and Markdown, and for what is built")->type_name("DIR");
    app.add_option("--repetitions", command.repetitions, "Runs whose median is reported")->type_name("N")->check(CLI::Range(1, 1000));
    app.add_option("--cell", command.cell, "Edge of the finest cells, world units [chosen from the mesh]")
        ->type_name("LENGTH")
        ->check([](const std::string& text) {
            const auto length = parseLength(text);
            return length && !length->isRelative ? std::string() : "must be a length in world units like 0.25, not \"" + text + "\"";
        });
    app.add_option("--threads", command.threads, "Threads [one a processor]")->type_name("N")->check(CLI::Range(1, 1024));
    addProgressOption(app, command.report);
    addJsonOption(app, command.report);
}

RunCommand addBenchBuild(CLI::App& bench) {
    auto command = std::make_shared<BenchCommand>();
    CLI::App* app = bench.add_subcommand("build", "Time the build, beside Embree building its tree");
    addBenchOptions(*app, *command, "Meshes");
    return [command] { return runBuild(*command); };
}

RunCommand addBenchRays(CLI::App& bench) {
    auto command = std::make_shared<RaysCommand>();
    CLI::App* app = bench.add_subcommand("rays", "Time and judge ray-casters, beside Embree's packets");
    addBenchOptions(*app, *command, "Meshes, or .vcp files beside the meshes they were built from");
    app->add_option("--methods", command->methods, "certified, reference, embree, embree-single [all]")->type_name("A,B")->delimiter(',');
    app->add_option("--cameras", command->cameras, "whole, half, close, cells [all]")->type_name("A,B")->delimiter(',');
    app->add_option("--views", command->views, "Directions that each camera looks from")->type_name("N")->capture_default_str()->check(
        CLI::Range(1, 1000));
    app->add_option("--size", command->size, "Rays across and down")->type_name("WxH")->capture_default_str()->check([](const std::string& text) {
        return parseSize(text) ? std::string() : "must be like 1920x1200, not \"" + text + "\"";
    });
    app->add_option("--judge-every", command->judgeEvery, "Compare every Nth row and column with the mesh")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(1, 16384));
    app->add_option("--device", command->device, "Vulkan device of the method certified, see `vcp devices` [the best one]")->type_name("DEVICE");
    return [command] { return runRays(*command); };
}

}  // namespace

Command addBench(CLI::App& vcp) {
    CLI::App* app = vcp.add_subcommand("bench", "Measure run time against error, beside Embree");
    app->require_subcommand(1);
    const RunCommand build = addBenchBuild(*app), rays = addBenchRays(*app);
    const CLI::App* buildApp = app->get_subcommand("build");
    return {app, [=] { return buildApp->parsed() ? build() : rays(); }};
}

}  // namespace vcp
