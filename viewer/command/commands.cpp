#include "viewer/command/commands.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "octree/io/output_file.h"
#include "viewer/command/manual/help_text.h"
#include "viewer/command/terminal/terminal_text.h"

namespace vcp {

namespace {

Result<void> print(const std::string& text) {
    if (std::fprintf(stdout, "%s\n", text.c_str()) < 0 || std::fflush(stdout) != 0)
        return Error{.code = ErrorCode::Io,
                     .message = std::string("cannot be written: ") + std::strerror(errno),
                     .file = "standard output"};
    return {};
}

}  // namespace

void addJsonOption(CLI::App& app, ReportOptions& options) {
    app.add_flag("--json", options.json, "Print one JSON object on stdout at the end")->group(help_group::kReport);
}

void addProgressOption(CLI::App& app, ReportOptions& options) {
    app.add_option("--progress", options.progress, "Progress on stderr: bar, plain, json or none [a bar on a terminal]")
        ->type_name("STYLE:{bar,plain,json,none}")
        ->group(help_group::kReport)
        ->check([](const std::string& name) {
            return progressStyleNamed(name) ? std::string() : "must be bar, plain, json or none, not \"" + name + "\"";
        });
}

void addOverwriteOption(CLI::App& app, bool& overwrite) {
    app.add_flag("--overwrite", overwrite,
                 "Replace also an output that is of another kind or write-protected; never an input")
        ->group(help_group::kOutput);
}

std::string extensionProblem(const std::string& name, const std::string& extension, bool mayBePipe) {
    const auto wanted = outputKindOf("x" + extension);
    if (name != kStandardOutput && !std::filesystem::path(name).has_extension()) return {};
    if (outputKindOf(name) == wanted || (mayBePipe && name == kStandardOutput)) return {};
    return "must end in " + extension + (mayBePipe ? ", or be - for standard output" : "") + ", not \"" + name + "\"";
}

Result<void> printLineAbout(const std::string& output, const std::string& text) {
    if (output != kStandardOutput) return printLine(text);
    std::fprintf(stderr, "%s\n", terminalLines(text).c_str());
    return {};
}

Result<void> printLine(const std::string& text) { return print(terminalLines(text)); }

Result<void> printJsonText(const std::string& json) { return print(terminalJson(json)); }

void warnOnTerminal(const std::string& warning) {
    std::fprintf(stderr, "warning: %s\n", terminalText(warning).c_str());
}

Result<void> printJson(const Json& json) {
    // File names need not be UTF-8; JSON must.
    return printJsonText(json.dump(2, ' ', false, Json::error_handler_t::replace));
}

}  // namespace vcp
