// vcp shard and vcp pack: a .vcp file as a folder of files that are uploaded and cached each by itself, and back.
#include <fmt/format.h>

#include "streaming/shard/shard_folder.h"
#include "viewer/command/build_arguments.h"
#include "viewer/command/commands.h"
#include "viewer/command/manual/help_text.h"
#include "viewer/command/parsed_option.h"
#include "viewer/command/shard_arguments.h"
#include "viewer/command/source_arguments.h"
#include "viewer/command/terminal/interrupt.h"
#include "viewer/scene/option_values.h"

namespace vcp {

namespace {

struct ShardCommand {
    std::string file, output;
    uint64_t shardBytes = ShardOptions().shardBytes;
    ReportOptions report;
};

struct PackCommand {
    std::string file, output;
    bool overwrite = false;
    SourceAccess source;
    ReportOptions report;
};

Result<int> run(const ShardCommand& command) {
    const InterruptScope catching;
    VCP_TRY_ASSIGN(const auto reader, openDatasetFile(command.file));
    VCP_TRY_ASSIGN(const auto report, shardWithProgress(*reader, command.output, command.shardBytes, {command.file},
                                                        command.report.progressStyle()));
    if (command.report.json)
        VCP_TRY(printJson(toJson(report)));
    else
        VCP_TRY(printLine(fmt::format("{}: {}", command.output, summary(report))));
    return 0;
}

Result<int> run(const PackCommand& command) {
    const InterruptScope catching;
    VCP_TRY_ASSIGN(const auto reader, openReader(command.file, command.source));
    OutputRules rules{.overwrite = command.overwrite, .inputs = {command.file, reader->name()}};
    ProgressDisplay display(command.report.progressStyle(), stderr);
    VCP_TRY(packShards(*reader, command.output, rules, [&](double share) {
        display.update("packing", share);
        return !interrupted();
    }));
    display.finish();
    if (command.report.json)
        VCP_TRY(printJson({{"file", command.output}, {"bytes", reader->size()}}));
    else
        VCP_TRY(printLine(fmt::format("{}: {}", command.output, formatBytes(reader->size()))));
    return 0;
}

}  // namespace

Result<ShardReport> shardWithProgress(const ByteReader& file, const std::string& folder, uint64_t shardBytes,
                                      std::vector<std::filesystem::path> inputs, ProgressStyle style) {
    ProgressDisplay display(style, stderr);
    auto report = writeShards(
        file, {.folder = folder, .shardBytes = shardBytes, .inputs = std::move(inputs), .progress = [&](double share) {
                   display.update("cutting into shards", share);
                   return !interrupted();
               }});
    display.finish();
    return report;
}

Json toJson(const ShardReport& report) {
    return {{"shards", report.shards}, {"shards_kept", report.shardsKept}, {"folder_bytes", report.bytes}};
}

std::string summary(const ShardReport& report) {
    std::string text =
        fmt::format("{} in {} and {}", formatBytes(report.bytes), formatCount(report.shards, "shard"), kManifestName);
    if (report.shardsKept > 0) text += fmt::format("; {} stayed as they were", formatCount(report.shardsKept));
    return text;
}

void addShardBytes(CLI::App& app, const std::string& name, uint64_t& bytes) {
    const auto parse = [](std::string_view text) {
        const auto size = parseBytes(text);
        return size && *size >= kLeastShardBytes ? size : std::nullopt;
    };
    addParsed(app, name, bytes, parse, "64K or more, like 512M",
              "Cut the output into files of about so many bytes, in a folder with a manifest; each is a .vcp file of a "
              "part, named by its content")
        ->type_name("SIZE");
}

Command addShard(CLI::App& vcp) {
    auto command = std::make_shared<ShardCommand>();
    CLI::App* app = vcp.add_subcommand("shard", "Cut a .vcp file into a folder of shards");
    app->add_option("FILE", command->file, "A .vcp file, or a folder of shards that is to be cut anew")
        ->type_name("")
        ->required();
    const ScopedGroup scope(*app, help_group::kOutput);
    app->add_option("-o,--output", command->output,
                    "The folder to write; one of shards is replaced, and keeps the files that stay the same")
        ->type_name("FOLDER")
        ->required();
    addShardBytes(*app, "--size", command->shardBytes);
    app->get_option("--size")->default_str("512M");
    addProgressOption(*app, command->report);
    addJsonOption(*app, command->report);
    return {app, [command] { return run(*command); }};
}

Command addPack(CLI::App& vcp) {
    auto command = std::make_shared<PackCommand>();
    CLI::App* app = vcp.add_subcommand("pack", "Make one .vcp file of a folder of shards");
    app->add_option("FOLDER", command->file, "A folder of shards, its manifest, or the http(s) address of that")
        ->type_name("")
        ->required();
    addBuildOutput(*app, command->output);
    app->get_option("--output")->required();
    {
        const ScopedGroup scope(*app, help_group::kOutput);
        addOverwriteOption(*app, command->overwrite);
    }
    addSourceSettings(*app, command->source);
    addProgressOption(*app, command->report);
    addJsonOption(*app, command->report);
    return {app, [command] { return run(*command); }};
}

}  // namespace vcp
