#include "viewer/commands.h"

#include <cerrno>
#include <cstdio>
#include <cstring>

namespace vcp {

void addJsonOption(CLI::App& app, ReportOptions& options) {
    app.add_flag("--json", options.json, "Print one JSON object on stdout at the end");
}

void addProgressOption(CLI::App& app, ReportOptions& options) {
    app.add_option("--progress", options.progress, "Progress on stderr: bar, plain, json or none [a bar on a terminal]")
        ->type_name("STYLE")
        ->check([](const std::string& name) {
            return progressStyleNamed(name) ? std::string() : "must be bar, plain, json or none, not \"" + name + "\"";
        });
}

Result<void> printLine(const std::string& text) {
    if (std::fprintf(stdout, "%s\n", text.c_str()) < 0 || std::fflush(stdout) != 0)
        return Error{ErrorCode::Io, std::string("cannot be written: ") + std::strerror(errno), "standard output"};
    return {};
}

Result<void> printJson(const Json& json) {
    // File names need not be UTF-8; JSON must.
    return printLine(json.dump(2, ' ', false, Json::error_handler_t::replace));
}

}  // namespace vcp
