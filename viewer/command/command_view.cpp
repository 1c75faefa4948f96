// vcp view: the window.
#include <cstdio>
#include <optional>
#include <system_error>

#include <fmt/format.h>

#include "streaming/http_reader.h"
#include "viewer/command/build_arguments.h"
#include "viewer/command/commands.h"
#include "viewer/command/manual/help_text.h"
#include "viewer/command/parsed_option.h"
#include "viewer/command/render_arguments.h"
#include "viewer/command/terminal/interrupt.h"
#include "viewer/key_map.h"
#include "viewer/scene/mesh_cache.h"
#include "viewer/window/window.h"

namespace vcp {

namespace {

struct ViewCommand {
    std::vector<std::string> inputs;
    glm::ivec2 size{0};  // 0: not given
    uint32_t samples = kMostSamples;
    BuildOptions build;
    RenderSettings render;
    ReportOptions report;
};

Json secondsOrNull(const std::optional<double>& seconds) { return seconds ? Json(*seconds) : Json(nullptr); }

Json toJson(const WindowReport& report) {
    const ViewerStatus& status = report.status;
    return {{"window_seconds", secondsOrNull(report.windowSeconds)},
            {"preview_seconds", secondsOrNull(report.previewSeconds)},
            {"first_picture_seconds", secondsOrNull(report.firstPictureSeconds)},
            {"settled_seconds", secondsOrNull(report.settledSeconds)},
            {"frames", report.framesDrawn},
            {"samples", status.samples},
            {"ms_per_frame", status.frame.msFrame},
            {"device", status.device},
            {"software", status.software},
            {"settled", status.update.settled},
            {"detail", nameOf(status.detail)},
            {"error_pixels", status.update.errorPixels},
            {"colour_pixels", status.update.colourPixels},
            {"limited_by", nameOf(detailLimitOf(status.update))},
            {"resident_bytes", status.update.residentBytes},
            {"bytes_read", status.update.bytesRead},
            {"hit_pixels", status.frame.hitPixels},
            {"problem", report.problem}};
}

/// Finds errors of an input before a window is opened.
Result<void> checkInput(const std::string& input, const RenderSettings& render, bool isAlone) {
    if (isHttpUrl(input)) return {};
    if (looksLikeDataset(input)) {
        VCP_TRY_ASSIGN(const auto open, openDataset(input, render.source));
        return isAlone ? render.checkFor(*open.dataset) : Result<void>();
    }
    if (std::error_code failed; !std::filesystem::exists(input, failed))
        return Error{.code = ErrorCode::Io, .message = "cannot be opened: there is no such file", .file = input};
    return {};
}

/// Finds errors that leave nothing to show: a missing mesh, a .vcp that is none. Of several .vcp files one is enough,
/// and the window says what is wrong with the others.
Result<void> checkInputs(const ViewCommand& command) {
    std::vector<std::string> inputs = command.inputs;
    VCP_TRY_ASSIGN(const auto kind, kindOf(inputs));
    if (kind == InputKind::Scene) {
        VCP_TRY_ASSIGN(const auto scene, readScene(inputs.front()));
        inputs.clear();
        for (const SceneDataset& each : scene.datasets) inputs.push_back(each.file);
    }
    std::optional<Error> first;
    for (const std::string& input : inputs) {
        const auto checked = checkInput(input, command.render, inputs.size() == 1);
        if (checked && kind == InputKind::Datasets) return {};
        if (!checked && !first) first = checked.error();
    }
    return first ? Result<void>(*first) : Result<void>();
}

void warn(const std::string& line) { fmt::print(stderr, "warning: {}\n", line); }

Result<int> run(ViewCommand command, const CLI::App& app) {
    if (isHostName(command.render.device))
        return Error{.code = ErrorCode::Usage,
                     .message = "the host draws no window, only pictures (vcp render); choose a Vulkan device"};
    VCP_TRY(checkInputs(command));
    VCP_TRY(command.render.takeEnvironment());
    const auto settingsPath = userSettingsPath();
    WindowOptions options;
    // Where the settings cannot be read, the defaults are used.
    if (settingsPath) {
        const auto user = readUserSettings(*settingsPath);
        if (user)
            options.session.user = *user;
        else
            warn(user.error().line());
    }
    const auto isGiven = [&](const char* option) { return app.count(option) > 0; };
    applyRemembered(command.render, options.session.user,
                    {.shadows = isGiven("--shadows"),
                     .occlusion = isGiven("--occlusion"),
                     .errorPixels = isGiven("--error-pixels"),
                     .budget = isGiven("--budget")});
    options.session.inputs = command.inputs;
    options.session.build = command.build;
    options.session.render = command.render;
    options.session.samples = command.samples;
    options.session.makeProgress = [style = command.report.progressStyle()] { return shownProgress(style); };
    options.catchInterrupts = [] { return std::make_shared<InterruptScope>(); };
    options.interrupted = interrupted;
    if (command.size.x > 0) options.size = command.size;
    VCP_TRY_ASSIGN(const auto report, showWindow(options));
    if (settingsPath) {
        // The session itself worked: that it cannot be remembered is no failure.
        const auto saved = saveChanges(report.changes, *settingsPath);
        if (!saved || !saved->empty()) warn(saved ? *saved : saved.error().line());
    }
    if (command.report.json) VCP_TRY(printJson(toJson(report)));
    if (!report.firstPictureSeconds && interrupted()) return Error::cancelled();
    if (!report.firstPictureSeconds && !report.problem.empty())
        return Error{.code = ErrorCode::InvalidInput, .message = report.problem};
    return 0;
}

}  // namespace

Command addView(CLI::App& vcp) {
    auto command = std::make_shared<ViewCommand>();
    CLI::App* app = vcp.add_subcommand("view", "Open a window, on .vcp files, a scene or meshes");
    app->add_option("IN", command->inputs,
                    ".vcp files or folders of shards, their http(s) addresses, a scene file (.json), or meshes, which "
                    "are built into the "
                    "cache first")
        ->type_name("");
    beginGroup(*app, help_group::kCamera);
    addSize(*app, command->size, "1280x800", "Width and height of the window [1280x800, then as it was left]");
    addRenderSettings(*app, command->render);
    beginGroup(*app, help_group::kLook);
    addSamples(*app, command->samples,
               "Rays a pixel of a picture that stays, whose light is averaged: smooth edges; 1: none");
    addBuildSettings(*app, command->build, help_group::kMeshes);
    addProgressOption(*app, command->report);
    addJsonOption(*app, command->report);
    app->footer(
        "Files may also be dropped into the window. Looks, limits, bookmarks and recent files are remembered as they "
        "are changed in the window; options hold for one run.\n\n" +
        keyMapText());
    return {app, [command, app] { return run(*command, *app); }};
}

}  // namespace vcp
