// vcp publish: a folder that shows a scan in a web page, for any static web server.
#include <fmt/format.h>

#include "octree/dataset_reader.h"
#include "render/host_drawing.h"
#include "streaming/shard/shard_folder.h"
#include "viewer/command/commands.h"
#include "viewer/command/manual/help_text.h"
#include "viewer/command/site/web_folder.h"
#include "viewer/scene/option_values.h"

namespace vcp {

namespace {

struct PublishCommand {
    std::string file, output, viewer;
    bool overwrite = false;
    ReportOptions report;
};

/// Refuses what the page would refuse: files that are not whole, and those that the processor does not draw.
Result<void> checkScan(const std::string& file) {
    VCP_TRY_ASSIGN(const auto reader, openDatasetFile(file));
    VCP_TRY_ASSIGN(const auto dataset, readDataset(*reader));
    return checkHostDraws(dataset, file);
}

Result<int> run(const PublishCommand& command) {
    VCP_TRY_ASSIGN(const auto viewer, findWebViewer(command.viewer));
    VCP_TRY(checkScan(command.file));
    VCP_TRY_ASSIGN(const uint64_t bytes, writeWebFolder(viewer, command.file, command.output, command.overwrite));
    if (command.report.json)
        VCP_TRY(printJson({{"folder", command.output}, {"bytes", bytes}}));
    else
        VCP_TRY(
            printLine(fmt::format("{}: {}; copy it to any web server that knows ranges, or look at it with `vcp "
                                  "serve {}`",
                                  command.output, formatBytes(bytes), command.output)));
    return 0;
}

}  // namespace

Command addPublish(CLI::App& vcp) {
    auto command = std::make_shared<PublishCommand>();
    CLI::App* app = vcp.add_subcommand("publish", "Make a folder that shows a .vcp file in a web page");
    app->add_option("FILE", command->file, "A .vcp file, or a folder of shards")->type_name("")->required();
    app->add_option("-o,--output", command->output, "The folder to make")
        ->type_name("FOLDER")
        ->required()
        ->group(help_group::kOutput);
    app->add_flag("--overwrite", command->overwrite,
                  "Replace a folder that was published before; its index.html is kept")
        ->group(help_group::kOutput);
    app->add_option("--viewer", command->viewer, "Folder of the viewer for browsers [beside the program]")
        ->type_name("FOLDER")
        ->group(help_group::kOutput);
    addJsonOption(*app, command->report);
    return {app, [command] { return run(*command); }};
}

}  // namespace vcp
