// What the subcommands of vcp bench share: their options, progress and reports.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "viewer/command/commands.h"
#include "viewer/command/terminal/interrupt.h"

namespace vcp {

/// A report in its forms; plots are by file name without extension.
struct BenchTexts {
    std::string json, csv, markdown;
    std::vector<std::pair<std::string, std::string>> plots = {};
};

struct BenchCommand {
    std::vector<std::string> models;
    std::string out;
    int repetitions = 0;  // 0: the bench's own default
    unsigned threads = 0;
    double cell = 0;  // 0: chosen from the mesh
    bool overwrite = false;
    ReportOptions report;

    [[nodiscard]] std::vector<std::filesystem::path> modelPaths() const { return {models.begin(), models.end()}; }
};

/// Makes the folder of --out, unless there is none. Errors: Io.
Result<void> makeFolder(const std::string& folder);

/// Writes files into --out, and JSON or the table on stdout.
Result<int> publish(const BenchCommand& command, const std::string& name, const BenchTexts& texts);

/// Adds the options of all benches with models. `models`: which ones, for the help.
void addBenchOptions(CLI::App& app, BenchCommand& command, const std::string& models);

/// Hands on what all benches with models are asked.
template <class Options>
void takeShared(const BenchCommand& command, Options& options) {
    options.models = command.modelPaths();
    if (command.repetitions > 0) options.repetitions = command.repetitions;
    options.threads = command.threads;
    options.out = command.out;
    options.cell = command.cell;
}

/// Runs bench(options) with its progress on stderr until Ctrl-C. `progress`: where `options` has the function that is
/// told it.
template <class Bench, class Options, class Progress>
auto runShown(const BenchCommand& command, Bench bench, Options& options, Progress& progress) {
    const InterruptScope catching;
    ProgressDisplay display(command.report.progressStyle(), stderr);
    progress = [&display](const std::string& what, double fraction) {
        display.update(what, fraction);
        return !interrupted();
    };
    auto report = bench(options);
    display.finish();
    return report;
}

/// vcp bench picture and vcp bench colour.
RunCommand addBenchPicture(CLI::App& bench);
RunCommand addBenchColour(CLI::App& bench);

}  // namespace vcp
