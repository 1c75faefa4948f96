// vcp view: the window.
#include <fmt/format.h>

#include "viewer/build_settings.h"
#include "viewer/commands.h"
#include "viewer/option_values.h"
#include "viewer/render_settings.h"
#include "viewer/window.h"

namespace vcp {

namespace {

struct ViewCommand {
    std::vector<std::string> inputs;
    std::string size = "1280x800";
    BuildSettings build;
    RenderSettings render;
    ReportOptions report;
};

std::string titleFor(const std::vector<std::string>& inputs) {
    const std::string first = std::filesystem::path(inputs.front()).filename().string();
    return inputs.size() == 1 ? first : fmt::format("{} and {} more", first, inputs.size() - 1);
}

Json secondsOrNull(const std::optional<double>& seconds) { return seconds ? Json(*seconds) : Json(nullptr); }

Json toJson(const WindowReport& report) {
    const ViewerStatus& status = report.status;
    return {{"first_picture_seconds", secondsOrNull(report.firstPictureSeconds)},
            {"settled_seconds", secondsOrNull(report.settledSeconds)},
            {"frames", report.framesDrawn},
            {"ms_per_frame", status.frame.msFrame},
            {"device", status.device},
            {"software", status.software},
            {"settled", status.update.settled},
            {"error_pixels", status.update.errorPixels},
            {"resident_bytes", status.update.residentBytes},
            {"bytes_read", status.update.bytesRead},
            {"hit_pixels", status.frame.hitPixels}};
}

Result<int> run(const ViewCommand& command) {
    const auto path = datasetFor(command.inputs, command.build, command.report.progressStyle());
    if (!path) return path.error();
    const auto open = openDataset(path->string(), command.render.source);
    if (!open) return open.error();
    VCP_TRY(command.render.checkFor(*open->dataset));
    WindowOptions options;
    options.size = parseSize(command.size).value();
    options.title = titleFor(command.inputs);
    const auto report = showWindow(*open, command.render, options);
    if (!report) return report.error();
    if (command.report.json) VCP_TRY(printJson(toJson(*report)));
    return 0;
}

}  // namespace

Command addView(CLI::App& vcp) {
    auto command = std::make_shared<ViewCommand>();
    CLI::App* app = vcp.add_subcommand("view", "Open a window on a .vcp file or on meshes");
    app->add_option("IN", command->inputs, "A .vcp file or its http(s) address, or meshes, which are built into the cache first")
        ->type_name("")
        ->required();
    app->add_option("--size", command->size, "Width and height of the window")
        ->type_name("WxH")
        ->capture_default_str()
        ->check([](const std::string& text) {
            return parseSize(text) ? std::string() : "must be like 1280x800, not \"" + text + "\"";
        });
    addRenderSettings(*app, command->render);
    addBuildSettings(*app, command->build);
    addProgressOption(*app, command->report);
    addJsonOption(*app, command->report);
    app->footer("Mouse: left drag orbits about the point under the cursor; right or middle drag, or shift and left, pans;\n"
                "the wheel zooms to the cursor. Keys: F fit; R or Home reset; L light follows the camera or stays;\n"
                "M shading mode; S shadows; O ambient occlusion; X section through the middle, shift and wheel move it;\n"
                "P perspective or orthographic; 1 3 7 9 front, right, top, isometric; Esc or Q quit.");
    return {app, [command] { return run(*command); }};
}

}  // namespace vcp
