#include "builder/parts/build_parts.h"

#include <sys/stat.h>
#include <cerrno>

#include <fmt/format.h>

#include "builder/mesh/open_mesh.h"
#include "builder/parts/part_dealing.h"
#include "builder/work_arena.h"
#include "octree/io/caught.h"
#include "octree/io/durable_file.h"
#include "octree/io/output_file.h"

namespace vcp {

namespace {

Error usage(std::string message, const std::filesystem::path& file) {
    return {.code = ErrorCode::Usage, .message = std::move(message), .file = file.string()};
}

Result<void> checkOptions(const BuildOptions& options, unsigned parts) {
    if (parts == 0 || parts > kMostParts)
        return usage(fmt::format("a build has 1 to {} parts", kMostParts), options.output);
    if (options.error > 0 || options.coarseLeaves != CoarseLeaves::Slabs)
        return usage(
            "a build in parts has no tolerance and no coarser leaves of the mesh: their levels come one after "
            "the other",
            options.output);
    for (const auto& input : options.inputs)
        if (input == "-") return usage("standard input cannot be built in parts: machines read files", options.output);
    return checkOutput(options.output, OutputKind::Dataset, {.overwrite = options.overwrite, .inputs = options.inputs});
}

/// Makes the folder of a plan; one that is there is left as it is.
Result<void> makeFolder(const std::filesystem::path& folder) {
    if (::mkdir(folder.c_str(), 0777) == 0) return {};
    if (errno != EEXIST) return systemError(folder, "cannot be made", errno);
    return usage("is there already: run its parts, or delete it to plan the build again", folder);
}

/// Names the part whose files are damaged or gone, where the error is of one.
Error named(Error error, const std::filesystem::path& folder) {
    const std::filesystem::path part = std::filesystem::path(error.file).parent_path();
    const std::string name = part.filename().string();
    const size_t dash = name.rfind('-');
    if (error.code != ErrorCode::InvalidInput || part.parent_path() != folder || dash == std::string::npos)
        return error;
    error.message = fmt::format("is damaged, cut off or lost: delete {} and run the step \"{} {}\" of this plan again",
                                part.string(), name.substr(0, dash), name.substr(dash + 1));
    return error;
}

Result<void> checkStep(const PartStep& step, const PartPlan& plan) {
    VCP_TRY_ASSIGN(const auto program, programId());
    if (program != plan.program)
        return usage(fmt::format("was planned by another build of vcp ({}, this is {}): run that one, or plan again",
                                 plan.program, program),
                     step.folder / kPlanName);
    for (const PartStage& stage : stagesOf(plan.parts)) {
        if (stage.name != step.stage) continue;
        if (step.number < stage.parts) return {};
        return usage(fmt::format("stage {} has parts 0 to {}", stage.name, stage.parts - 1), step.folder);
    }
    return usage(
        fmt::format("there is no stage \"{}\"; they are read, count, deal, vertices, pages, merge", step.stage),
        step.folder);
}

/// Checks a part that is done: another memory, or another machine's, may have dealt into other bins since.
Result<void> checkDone(const PartStep& step, const PartPlan& plan) {
    if (step.stage == "read" || step.stage == "count" || !isDone({step.folder, "count", 0})) return {};
    VCP_TRY_ASSIGN(const auto context, openCounted({step.folder, plan}));
    const auto opened = context.open(step.stage, step.number);
    return opened ? Result<void>() : opened.error();
}

/// Runs a part in the calling arena.
Result<PartReport> runStage(const PartStep& step, const PartSetting& setting) {
    PartReport report;
    NewPart made(setting.part(step.stage, step.number));
    if (step.stage == "read") {
        VCP_TRY(runRead(setting, step.number, made));
        return report;
    }
    if (step.stage == "count") {
        VCP_TRY(runCount(setting, made));
        return report;
    }
    VCP_TRY_ASSIGN(const auto context, openContext(setting));
    if (step.stage == "deal") {
        VCP_TRY(runDeal(context, step.number, made));
    } else if (step.stage == "vertices") {
        VCP_TRY(runVertices(context, step.number, made));
    } else if (step.stage == "pages") {
        VCP_TRY(runPages(context, step.number, made));
    } else {
        VCP_TRY_ASSIGN(report.warnings, warningsOf(context));
        VCP_TRY_ASSIGN(report.dataset, runMerge(context, made));
    }
    return report;
}

Result<PartReport> run(const PartStep& step, const PartPlan& plan, const std::function<bool(double)>& progress) {
    WorkArena arena(threadsOf(plan.options));
    return arena.execute([&] { return runStage(step, {step.folder, plan, &progress}); });
}

}  // namespace

std::vector<PartStage> stagesOf(unsigned parts) {
    return {{"read", parts}, {"count", 1}, {"deal", parts}, {"vertices", parts}, {"pages", parts}, {"merge", 1}};
}

Result<std::filesystem::path> planParts(const BuildOptions& options, unsigned parts) {
    VCP_TRY(checkOptions(options, parts));
    PartPlan plan{.options = options, .parts = parts, .program = {}, .inputs = {}};
    VCP_TRY_ASSIGN(auto inputs, expandInputs(options.inputs));
    for (auto& input : inputs) input = std::filesystem::absolute(input);
    plan.options.output = std::filesystem::absolute(options.output);
    VCP_TRY_ASSIGN(plan.program, programId());
    VCP_TRY_ASSIGN(plan.inputs, describeInputs(inputs));
    std::filesystem::path name = plan.options.output.filename();
    name += ".parts";
    const std::filesystem::path folder =
        (options.temp.empty() ? plan.options.output.parent_path() : std::filesystem::absolute(options.temp)) / name;
    VCP_TRY(makeFolder(folder));
    const auto written = writePlan(plan, folder);
    if (!written) ::rmdir(folder.c_str());
    VCP_TRY(written);
    return folder;
}

Result<PartReport> runPart(const PartStep& given) {
    PartStep step = given;
    step.folder = std::filesystem::absolute(given.folder).lexically_normal();
    if (!step.folder.has_filename()) step.folder = step.folder.parent_path();
    VCP_TRY_ASSIGN(auto plan, readPlan(step.folder));
    VCP_TRY(checkStep(step, plan));
    if (step.threads > 0) plan.options.threads = step.threads;
    if (step.memoryBytes > 0) plan.options.memoryBytes = step.memoryBytes;
    if (isDone({step.folder, step.stage, step.number})) {
        const auto checked = caught([&] { return checkDone(step, plan); }, step.folder.string());
        if (!checked) return named(checked.error(), step.folder);
        return PartReport{.wasDone = true};
    }
    plan.options.progress = step.progress;
    ProgressMeter meter(step.progress);
    const std::function<bool(double)> progress = [&](double part) {
        return meter.report(step.stage, {.fraction = part});
    };
    auto report = caught([&] { return run(step, plan, progress); }, step.folder.string());
    if (!report) return named(report.error(), step.folder);
    if (report->dataset) {
        report->dataset->seconds = meter.seconds();
        report->dataset->peakRssBytes = peakRssBytes();
    }
    return report;
}

}  // namespace vcp
