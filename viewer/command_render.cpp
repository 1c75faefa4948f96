// vcp render: a picture without a window.
#include <algorithm>
#include <thread>

#include <fmt/format.h>

#include "render/renderer.h"
#include "viewer/build_settings.h"
#include "viewer/commands.h"
#include "viewer/image_files.h"
#include "viewer/interrupt.h"
#include "viewer/option_values.h"
#include "viewer/render_settings.h"

namespace vcp {

namespace {

struct RenderCommand {
    std::vector<std::string> inputs;
    std::string output;
    std::string size = "1920x1200";
    std::string depth, normals;
    int frames = 0;  // 0: not given
    bool settle = true;
    BuildSettings build;
    RenderSettings render;
    ReportOptions report;

    /// With --json somebody wants figures, and the first frame, which compiles, would not be one.
    [[nodiscard]] int framesToTime() const { return frames > 0 ? frames : report.json ? 5 : 0; }
};

/// What the frames cost and showed.
struct Drawing {
    UpdateResult update;
    FrameStats stats;         ///< of the last frame
    double firstFrameMs = 0;  ///< with what is compiled on first use
    std::vector<double> frameMs;

    /// Of the timed frames; of the first when none was timed.
    [[nodiscard]] double medianMs() const {
        if (frameMs.empty()) return firstFrameMs;
        std::vector<double> sorted = frameMs;
        std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
        return sorted[sorted.size() / 2];
    }
    [[nodiscard]] double raysPerSecond() const { return static_cast<double>(stats.rays) / std::max(1e-3 * medianMs(), 1e-9); }
};

/// Without --settle: what is there as soon as the coarsest page is.
Result<UpdateResult> updateUntilDrawable(Renderer& renderer, const FrameRequest& request) {
    for (;;) {
        auto update = renderer.update(request);
        if (!update || update->drawable || !update->problems.empty() || update->settled) return update;
        if (interrupted()) return Error{ErrorCode::Cancelled, "cancelled"};
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
}

Result<Drawing> draw(Renderer& renderer, const FrameRequest& request, const RenderCommand& command) {
    auto update = command.settle ? renderer.settle(request, interrupted) : updateUntilDrawable(renderer, request);
    if (!update) return update.error();
    if (!update->problems.empty()) return update->problems.front();
    Drawing drawing;
    drawing.update = *std::move(update);
    for (int i = 0; i <= command.framesToTime(); ++i) {
        if (interrupted()) return Error{ErrorCode::Cancelled, "cancelled"};
        auto stats = renderer.render(request);
        if (!stats) return stats.error();
        drawing.stats = *stats;
        if (i == 0) drawing.firstFrameMs = stats->msFrame;
        else drawing.frameMs.push_back(stats->msFrame);
    }
    return drawing;
}

Result<void> writeFiles(Renderer& renderer, const FrameRequest& request, const RenderCommand& command) {
    if (!command.depth.empty()) {
        const auto depth = renderer.readDepth();
        if (!depth) return depth.error();
        VCP_TRY(writeDepth(*depth, request.width, request.height, command.depth));
    }
    if (!command.normals.empty()) {
        const auto normals = renderer.readNormals();
        if (!normals) return normals.error();
        VCP_TRY(writeNormals(*normals, request.width, request.height, command.normals));
    }
    const auto picture = renderer.readPicture();
    if (!picture) return picture.error();
    return writePng(*picture, command.output);
}

Json toJson(const Drawing& drawing, const DeviceInfo& device, const FrameRequest& request, const OrbitCamera& camera) {
    const FrameStats& stats = drawing.stats;
    return {{"width", request.width},
            {"height", request.height},
            {"frames", std::max<size_t>(drawing.frameMs.size(), 1)},
            {"ms_per_frame", drawing.medianMs()},
            {"first_frame_ms", drawing.firstFrameMs},
            {"ms_beam", stats.msBeam},
            {"ms_trace", stats.msTrace},
            {"ms_light", stats.msLight},
            {"ms_shade", stats.msShade},
            {"rays_per_second", drawing.raysPerSecond()},
            {"rays", stats.rays},
            {"traced_rays", stats.tracedRays},
            {"hit_pixels", stats.hitPixels},
            {"device", device.name},
            {"software", device.software},
            {"settled", drawing.update.settled},
            {"error_pixels", drawing.update.errorPixels},
            {"subvolumes_in_cut", stats.pagesInCut},
            {"resident_bytes", drawing.update.residentBytes},
            {"bytes_read", drawing.update.bytesRead},
            {"pipelines", stats.pipelines},
            {"camera", Json::parse(cameraToJson(camera))}};
}

std::string summary(const RenderCommand& command, const Drawing& drawing, const DeviceInfo& device) {
    const UpdateResult& update = drawing.update;
    return fmt::format("{}: {}, {} in {:.1f} ms ({:.1f} M rays/s) on {}{}\n  {} subvolumes, {} resident, error {:.2g} pixels, {}",
                       command.output, command.size, drawing.frameMs.empty() ? "first frame" : "a frame",
                       drawing.medianMs(), 1e-6 * drawing.raysPerSecond(), device.name,
                       device.software ? " (software)" : "", update.pagesInCut, formatBytes(update.residentBytes),
                       update.errorPixels, update.settled ? "settled" : "not settled");
}

Result<int> run(const RenderCommand& command) {
    const glm::ivec2 size = parseSize(command.size).value();
    const auto path = datasetFor(command.inputs, command.build, command.report.progressStyle());
    if (!path) return path.error();
    const auto open = openDataset(path->string(), command.render.source);
    if (!open) return open.error();
    const auto camera = command.render.cameraFor(open->bounds(), size);
    if (!camera) return camera.error();
    RendererOptions options = command.render.rendererOptions();
    options.loaderThreads = open->loaderThreads();
    auto renderer = Renderer::create(options);
    if (!renderer) return renderer.error();
    VCP_TRY((*renderer)->open(open->dataset, open->source));

    FrameRequest request;
    request.camera = camera->current();
    request.width = static_cast<uint32_t>(size.x);
    request.height = static_cast<uint32_t>(size.y);
    request.errorPixels = command.render.errorPixels;
    request.shading = command.render.shadingChosen();
    request.sections = command.render.sectionPlanes(open->bounds());
    request.sectionCaps = command.render.caps;
    const InterruptScope catching;
    const auto drawing = draw(**renderer, request, command);
    if (!drawing) return drawing.error();
    VCP_TRY(writeFiles(**renderer, request, command));
    if (command.report.json)
        VCP_TRY(printJson(toJson(*drawing, (*renderer)->device(), request, *camera)));
    else
        VCP_TRY(printLine(summary(command, *drawing, (*renderer)->device())));
    return 0;
}

std::string checkSize(const std::string& text) {
    return parseSize(text) ? std::string() : "must be like 1920x1200, at most 16384 each way, not \"" + text + "\"";
}

std::string checkPlane(const std::string& text) {
    return isImagePlanePath(text) ? std::string() : "must end in .pfm or .png, not \"" + text + "\"";
}

}  // namespace

Command addRender(CLI::App& vcp) {
    auto command = std::make_shared<RenderCommand>();
    CLI::App* app = vcp.add_subcommand("render", "Render a .vcp file or meshes into a picture, without a window");
    app->add_option("IN", command->inputs, "A .vcp file or its http(s) address, or meshes, which are built into the cache first")
        ->type_name("")
        ->required();
    app->add_option("-o,--output", command->output, "The PNG file to write")->type_name("OUT.png")->required();
    app->add_option("--size", command->size, "Width and height in pixels")->type_name("WxH")->capture_default_str()->check(checkSize);
    addRenderSettings(*app, command->render);
    app->add_option("--depth", command->depth, "Write also the distance along each ray: .pfm (float, world units) or .png "
                                               "(16-bit, 0 no hit, 1 nearest to 65535 farthest)")
        ->type_name("FILE")
        ->check(checkPlane);
    app->add_option("--normals", command->normals, "Write also the normals, world axes: .pfm or .png (128 + 127 n)")
        ->type_name("FILE")
        ->check(checkPlane);
    app->add_option("--frames", command->frames, "Draw so many frames after the first and report their median time [0; 5 with --json]")
        ->type_name("N")
        ->check(CLI::Range(1, 1'000'000));
    app->add_flag("--settle,!--no-settle", command->settle, "Wait until all that the view wants is loaded [on]");
    addBuildSettings(*app, command->build);
    addProgressOption(*app, command->report);
    addJsonOption(*app, command->report);
    return {app, [command] { return run(*command); }};
}

}  // namespace vcp
