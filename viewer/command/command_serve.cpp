// vcp serve: shows a published folder to browsers on this machine.
#include <fmt/format.h>

#include "viewer/command/commands.h"
#include "viewer/command/manual/help_text.h"
#include "viewer/command/site/file_server.h"
#include "viewer/command/terminal/interrupt.h"

namespace vcp {

namespace {

struct ServeCommand {
    std::string folder, address = "127.0.0.1";
    uint16_t port = 8080;
    ReportOptions report;
};

Result<int> run(const ServeCommand& command) {
    const InterruptScope catching;
    VCP_TRY_ASSIGN(const auto server, FileServer::listen(command.folder, command.address, command.port));
    const std::string address = fmt::format("http://{}:{}/", command.address, server->port());
    if (command.report.json)
        VCP_TRY(printJson({{"address", address}}));
    else
        VCP_TRY(printLine(fmt::format("{} until Ctrl-C", address)));
    VCP_TRY(server->run(interrupted));
    return 0;
}

}  // namespace

Command addServe(CLI::App& vcp) {
    auto command = std::make_shared<ServeCommand>();
    CLI::App* app = vcp.add_subcommand("serve", "Serve a published folder to browsers, for a first look");
    app->add_option("FOLDER", command->folder, "The folder; nothing outside of it is served")
        ->type_name("")
        ->required();
    beginGroup(*app, help_group::kServers);
    app->add_option("--address", command->address, "IPv4 address to listen at; 0.0.0.0: all of this machine's")
        ->type_name("ADDRESS")
        ->capture_default_str();
    app->add_option("--port", command->port, "Port; 0: a free one")->type_name("N")->capture_default_str();
    addJsonOption(*app, command->report);
    return {app, [command] { return run(*command); }};
}

}  // namespace vcp
