// The commands of `vcp`: each adds its subcommand and options to the command line and hands back what runs it.
//
// A command prints its result on stdout (a summary, or with --json one object) and its progress on stderr.
// An Error goes back to main, which prints its one line and ends with status 1, or 2 for Usage.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "octree/io/result.h"
#include "viewer/command/terminal/progress_display.h"

namespace vcp {

using Json = nlohmann::ordered_json;

/// Runs a command whose options have been parsed. The value is the exit status: 0, or 1 when the command
/// worked and its finding is bad (`vcp verify`).
using RunCommand = std::function<Result<int>()>;

struct Command {
    CLI::App* app = nullptr;
    RunCommand run;
};

Command addBuild(CLI::App& vcp);
Command addBuildPlan(CLI::App& vcp);
Command addBuildStep(CLI::App& vcp);
Command addShard(CLI::App& vcp);
Command addPack(CLI::App& vcp);
Command addInfo(CLI::App& vcp);
Command addVerify(CLI::App& vcp);
Command addRender(CLI::App& vcp);
Command addView(CLI::App& vcp);
Command addExport(CLI::App& vcp);
Command addCompare(CLI::App& vcp);
Command addStress(CLI::App& vcp);
Command addBench(CLI::App& vcp);
Command addDevices(CLI::App& vcp);
Command addMeso(CLI::App& vcp);
Command addPublish(CLI::App& vcp);
Command addServe(CLI::App& vcp);
/// Hidden commands, for the build and for packages.
Command addManual(CLI::App& vcp);
Command addCompletions(CLI::App& vcp);

/// The name of an output that stands for standard output.
inline constexpr const char* kStandardOutput = "-";

/// Options that many commands have.
struct ReportOptions {
    bool json = false;
    std::string progress;  ///< empty: a bar when stderr is a terminal

    [[nodiscard]] ProgressStyle progressStyle() const {
        return progressStyleNamed(progress).value_or(defaultProgressStyle());
    }
};
void addJsonOption(CLI::App& app, ReportOptions& options);
void addProgressOption(CLI::App& app, ReportOptions& options);

/// Adds --overwrite: files that are there may be replaced even if they are of another kind, or write-protected.
void addOverwriteOption(CLI::App& app, bool& overwrite);

/// Returns nothing where `name` ends in `extension`, or is "-" and `mayBePipe`; else what to write instead.
std::string extensionProblem(const std::string& name, const std::string& extension, bool mayBePipe);

/// Writes lines of text to stdout, shown as terminal_text.h says, with a newline behind. Errors: Io (stdout is closed
/// or full).
Result<void> printLine(const std::string& text);
/// Does so with a line about an output: on stderr when the output itself goes to stdout.
Result<void> printLineAbout(const std::string& output, const std::string& text);
Result<void> printJson(const Json& json);
/// Writes `json`, which is valid JSON, to stdout.
Result<void> printJsonText(const std::string& json);

/// Writes a line on stderr that begins with "warning: ".
void warnOnTerminal(const std::string& warning);

}  // namespace vcp
