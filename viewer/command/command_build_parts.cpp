// vcp build-plan and vcp build-step: a build in parts, for engines that run many processes.
#include <sys/resource.h>

#include <fmt/format.h>

#include "builder/parts/build_parts.h"
#include "viewer/command/build_arguments.h"
#include "viewer/command/commands.h"
#include "viewer/command/manual/help_text.h"
#include "viewer/command/parsed_option.h"
#include "viewer/command/terminal/interrupt.h"
#include "viewer/scene/option_values.h"

namespace vcp {

namespace {

struct PlanCommand {
    std::vector<std::string> inputs;
    std::string output;
    unsigned parts = 0;
    BuildOptions settings;
    ReportOptions report;
};

struct StepCommand {
    std::string plan = ".", stage;
    unsigned number = 0, threads = 0;
    uint64_t memoryBytes = 0;
    ReportOptions report;
};

/// Returns a word as a shell reads it back.
std::string shellWord(const std::string& text) {
    constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./-+:,@%";
    if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
    std::string word = "'";
    for (const char c : text) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return word + "'";
}

std::string summary(const std::string& folder, unsigned parts) {
    std::string text = fmt::format("{}: a build in {} parts; each line once the lines before are done:", folder, parts);
    for (const PartStage& stage : stagesOf(parts))
        text += fmt::format("\n  vcp build-step {} {} --plan {}", stage.name,
                            stage.parts == 1 ? "0" : fmt::format("{{0..{}}}", stage.parts - 1), shellWord(folder));
    return text;
}

Result<int> run(const PlanCommand& command) {
    BuildOptions options = command.settings;
    options.inputs.assign(command.inputs.begin(), command.inputs.end());
    options.output = command.output;
    VCP_TRY_ASSIGN(const auto folder, planParts(options, command.parts));
    if (!command.report.json) {
        VCP_TRY(printLine(summary(folder.string(), command.parts)));
        return 0;
    }
    Json stages = Json::array();
    for (const PartStage& stage : stagesOf(command.parts))
        stages.push_back({{"stage", stage.name}, {"parts", stage.parts}});
    VCP_TRY(printJson({{"folder", folder.string()}, {"parts", command.parts}, {"stages", stages}}));
    return 0;
}

/// A part may read files of all parts of the stage before, more than most systems allow unless they are asked.
void allowManyFiles() {
    rlimit files{};
    if (::getrlimit(RLIMIT_NOFILE, &files) != 0) return;
    files.rlim_cur = files.rlim_max;
    ::setrlimit(RLIMIT_NOFILE, &files);
}

Result<int> run(const StepCommand& command) {
    const InterruptScope catching;
    allowManyFiles();
    const auto ran = runPart(PartStep{.folder = command.plan,
                                      .stage = command.stage,
                                      .number = command.number,
                                      .threads = command.threads,
                                      .memoryBytes = command.memoryBytes,
                                      .progress = shownProgress(command.report.progressStyle())});
    if (!ran) return ran.error();
    const PartReport& done = *ran;
    if (command.report.json) {
        Json json{{"stage", command.stage}, {"part", command.number}, {"was_done", done.wasDone}};
        if (done.dataset) json.update(toJson(*done.dataset));
        if (done.dataset) json["warnings"] = done.warnings;
        VCP_TRY(printJson(json));
        return 0;
    }
    std::string text = fmt::format("{} {}: {}", command.stage, command.number, done.wasDone ? "was done" : "done");
    if (done.dataset)
        text += fmt::format("; {} in {}", formatCount(done.dataset->triangles, "triangle"),
                            formatBytes(done.dataset->fileBytes));
    for (const std::string& warning : done.warnings) text += fmt::format("\n  {}", warning);
    VCP_TRY(printLine(text));
    return 0;
}

}  // namespace

Command addBuildPlan(CLI::App& vcp) {
    auto command = std::make_shared<PlanCommand>();
    CLI::App* app = vcp.add_subcommand("build-plan", "Plan a build in parts, for clusters");
    addBuildInputs(*app, command->inputs,
                   "Meshes, as `vcp build` takes them, but no standard input; all machines must see them under these "
                   "names");
    addBuildOutput(*app, command->output);
    app->get_option("--output")->required();
    {
        const ScopedGroup scope(*app, help_group::kOutput);
        addOverwriteOption(*app, command->settings.overwrite);
    }
    const ScopedGroup scope(*app, help_group::kBuilding);
    app->add_option("--parts", command->parts, "Parts that the stages in the middle have")
        ->type_name("P")
        ->required()
        ->check(CLI::Range(1u, kMostParts));
    addCell(*app, command->settings.cell);
    addOrigin(*app, command->settings);
    addColourChoice(*app, command->settings);
    addImages(*app, command->settings);
    addVertexNormals(*app, command->settings);
    addMasks(*app, command->settings.masks);
    addAllowOutside(*app, command->settings.allowOutside);
    addFormat(*app, command->settings);
    addMemory(*app, command->settings.memoryBytes,
              "Memory that each part may take: 512M, 4G, 50% [half of its machine's]");
    addTempFolder(*app, command->settings,
                  "Folder that all machines see, for the plan OUT.vcp.parts [that of the output]");
    addJsonOption(*app, command->report);
    return {app, [command] { return run(*command); }};
}

Command addBuildStep(CLI::App& vcp) {
    auto command = std::make_shared<StepCommand>();
    CLI::App* app = vcp.add_subcommand("build-step", "Run one part of a planned build");
    app->add_option("STAGE", command->stage, "read, count, deal, vertices, pages or merge")->type_name("")->required();
    app->add_option("I", command->number, "Number of the part, from 0; count and merge have part 0 only")
        ->type_name("")
        ->required();
    const ScopedGroup scope(*app, help_group::kBuilding);
    app->add_option("--plan", command->plan, "The folder that vcp build-plan made")
        ->type_name("FOLDER")
        ->capture_default_str();
    app->add_option("--threads", command->threads, "Threads of the part [one a processor]")
        ->type_name("N")
        ->check(CLI::Range(1, 1024));
    addMemory(*app, command->memoryBytes, "Memory that the part may take: 512M, 4G, 50% [as planned]");
    addProgressOption(*app, command->report);
    addJsonOption(*app, command->report);
    return {app, [command] { return run(*command); }};
}

}  // namespace vcp
