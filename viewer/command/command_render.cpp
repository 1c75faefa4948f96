// vcp render: pictures without a window: one, one larger than the device draws at once, or a sequence.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "builder/measure/quantile.h"
#include "mesostructure/base/subdivision.h"
#include "mesostructure/method.h"
#include "render/host_renderer.h"
#include "render/pixel_samples.h"
#include "viewer/camera/camera_path.h"
#include "viewer/command/build_arguments.h"
#include "viewer/command/commands.h"
#include "viewer/command/interrupt.h"
#include "viewer/command/method_panels.h"
#include "viewer/command/parsed_option.h"
#include "viewer/command/render_arguments.h"
#include "viewer/picture/image_files.h"
#include "viewer/picture/picture_sequence.h"
#include "viewer/scene/option_values.h"
#include "viewer/scene/scene_opening.h"

namespace vcp {

namespace {

// Pictures of more pixels are drawn in tiles: devices limit how many a buffer may hold.
constexpr uint64_t kMostPixelsAtOnce = 8 << 20;
constexpr uint32_t kTile = 2048;
constexpr int kPathFrames = 120;
constexpr std::chrono::milliseconds kWait(100);

struct RenderCommand {
    std::vector<std::string> inputs;
    std::string output;
    glm::ivec2 size{1920, 1200};
    std::string depth, normals;
    bool overwrite = false;
    int frames = 0;  // 0: not given
    bool settle = true;
    uint32_t tile = 0;  // 0: not given
    uint32_t samples = kUsualSamples;
    bool transparent = false;
    int turntable = 0;
    std::string path;
    std::vector<std::string> methods;  // empty: those of the scene
    std::optional<int> subdivide;
    bool validation = false;
    BuildOptions build;
    RenderSettings render;
    ReportOptions report;

    /// Figures are wanted with --json, and the first frame, which compiles, would not be one.
    [[nodiscard]] int framesToTime() const { return frames > 0 ? frames : report.json ? 5 : 0; }
    [[nodiscard]] bool isSequence() const { return turntable > 0 || !path.empty(); }
    [[nodiscard]] bool isTiled(const FrameRequest& request) const {
        return tile > 0 || isSequence() || uint64_t{request.width} * request.height > kMostPixelsAtOnce;
    }
};

/// What the frames cost and showed.
struct Drawing {
    UpdateResult update;
    FrameStats stats;         ///< statistics of the last frame
    double firstFrameMs = 0;  ///< time of the frame before those, with what is compiled on first use
    std::vector<double> frameMs;
    uint32_t samples = 1;
    double samplesMs = 0;  ///< time of all samples of the picture together

    /// Returns the median of the timed frames, or the time of the first where none was timed.
    [[nodiscard]] double medianMs() const { return frameMs.empty() ? firstFrameMs : upperQuantile(frameMs, 0.5); }
    [[nodiscard]] double raysPerSecond() const { return double(stats.rays) / std::max(1e-3 * medianMs(), 1e-9); }
};

/// Without --settle: updates until the coarsest page is there, and draws what there is.
Result<SettledFrame> drawWhenDrawable(PictureRenderer& renderer, const FrameRequest& request) {
    for (;;) {
        VCP_TRY_ASSIGN(auto update, renderer.update(request));
        if (update.drawable || !update.problems.empty() || update.settled) {
            VCP_TRY_ASSIGN(const auto stats, renderer.render(request, interrupted));
            return SettledFrame{std::move(update), stats};
        }
        if (interrupted()) return Error::cancelled();
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
}

/// Adds the other samples to the last frame, with progress.
Result<void> refine(PictureRenderer& renderer, const FrameRequest& request, const RenderCommand& command,
                    Drawing& drawing) {
    const auto began = std::chrono::steady_clock::now();
    drawing.samples = samplesOf(request, command.samples);
    ProgressDisplay display(command.report.progressStyle(), stderr);
    VCP_TRY(renderer.refineTo(drawing.samples, request, interrupted, [&](uint32_t samples) {
        display.update("drawing samples", double(samples) / drawing.samples);
    }));
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - began;
    drawing.samplesMs = drawing.medianMs() + took.count();
    return {};
}

Result<Drawing> draw(PictureRenderer& renderer, const FrameRequest& request, const RenderCommand& command) {
    VCP_TRY_ASSIGN(auto first,
                   command.settle ? renderer.drawSettled(request, interrupted) : drawWhenDrawable(renderer, request));
    if (!first.update.problems.empty()) return first.update.problems.front();
    Drawing drawing;
    drawing.update = std::move(first.update);
    drawing.stats = first.stats;
    drawing.firstFrameMs = first.stats.msFrame;
    for (int i = 0; i < command.framesToTime(); ++i) {
        if (interrupted()) return Error::cancelled();
        VCP_TRY_ASSIGN(drawing.stats, renderer.render(request, interrupted));
        drawing.frameMs.push_back(drawing.stats.msFrame);
    }
    VCP_TRY(refine(renderer, request, command, drawing));
    return drawing;
}

/// Writes depth and normals of the last frame, where they are asked for.
Result<void> writePlanes(PictureRenderer& renderer, const FrameRequest& request, const RenderCommand& command,
                         const OutputRules& rules) {
    if (!command.depth.empty()) {
        VCP_TRY_ASSIGN(const auto depth, renderer.readDepth());
        VCP_TRY(writeDepth(depth, request.width, request.height, command.depth, rules));
    }
    if (!command.normals.empty()) {
        VCP_TRY_ASSIGN(const auto normals, renderer.readNormals());
        VCP_TRY(writeNormals(normals, request.width, request.height, command.normals, rules));
    }
    return {};
}

Json toJson(const Drawing& drawing, const DeviceInfo& device, const FrameRequest& request, const OrbitCamera& camera) {
    const FrameStats& stats = drawing.stats;
    return {{"width", request.width},
            {"height", request.height},
            {"frames", std::max<size_t>(drawing.frameMs.size(), 1)},
            {"ms_per_frame", drawing.medianMs()},
            {"first_frame_ms", drawing.firstFrameMs},
            {"samples", drawing.samples},
            {"ms_samples", drawing.samplesMs},
            {"ms_beam", stats.msBeam},
            {"ms_trace", stats.msTrace},
            {"ms_light", stats.msLight},
            {"ms_shade", stats.msShade},
            {"ms_surfaces", stats.msSurfaces},
            {"rays_per_second", drawing.raysPerSecond()},
            {"rays", stats.rays},
            {"traced_rays", stats.tracedRays},
            {"hit_pixels", stats.hitPixels},
            {"unresolved_rays", stats.unresolvedRays},
            {"far_hits", stats.farHits},
            {"surface_bytes", stats.surfaceBytes},
            {"device", castBy(device, stats.onHost)},
            {"software", device.software},
            {"settled", drawing.update.settled},
            {"detail", nameOf(detailOf(drawing.update, request.errorPixels))},
            {"error_pixels", drawing.update.errorPixels},
            {"subvolumes_in_cut", stats.pagesInCut},
            {"resident_bytes", drawing.update.residentBytes},
            {"bytes_read", drawing.update.bytesRead},
            {"pipelines", stats.pipelines},
            {"camera", Json::parse(cameraToJson(camera))}};
}

std::string summary(const RenderCommand& command, const Drawing& drawing, const DeviceInfo& device,
                    double askedPixels) {
    const UpdateResult& update = drawing.update;
    const std::string error = std::isfinite(update.errorPixels) ? fmt::format("error {:.2g} pixels", update.errorPixels)
                                                                : "no certified error";
    const std::string samples = drawing.samples > 1 ? fmt::format(", {} samples in {}", drawing.samples,
                                                                  formatSeconds(1e-3 * drawing.samplesMs))
                                                    : "";
    return fmt::format("{}: {}, {} in {:.1f} ms ({:.1f} M rays/s){} on {}{}\n  {} subvolumes, {} resident, {}, {}",
                       command.output, sizeText(command.size), drawing.frameMs.empty() ? "first frame" : "a frame",
                       drawing.medianMs(), 1e-6 * drawing.raysPerSecond(), samples,
                       castBy(device, drawing.stats.onHost), device.software ? " (software)" : "", update.pagesInCut,
                       formatBytes(update.residentBytes), error, textOf(detailOf(update, askedPixels)));
}

Result<void> report(const RenderCommand& command, const Drawing& drawing, const std::vector<MethodPanel>& panels,
                    const DeviceInfo& device, const FrameRequest& request, const OrbitCamera& camera) {
    if (command.report.json) {
        Json json = toJson(drawing, device, request, camera);
        if (panels.front().iterationsMean) json["iterations_mean"] = *panels.front().iterationsMean;
        for (const MethodPanel& panel : panels)
            if (!command.methods.empty()) json["methods"].push_back(toJson(panel));
        return printJson(json);
    }
    std::string text = summary(command, drawing, device, request.errorPixels);
    for (const MethodPanel& panel : panels)
        if (!command.methods.empty()) text += "\n  " + summary(panel);
    return printLineAbout(command.output, text);
}

/// Returns the cameras of a sequence, or the one camera.
Result<std::vector<Camera>> camerasOf(const RenderCommand& command, const OrbitCamera& camera, const Box& bounds) {
    std::vector<OrbitCamera> cameras{camera};
    if (command.turntable > 0) {
        cameras = turntable(camera, bounds.centre(), command.turntable);
    } else if (!command.path.empty()) {
        VCP_TRY_ASSIGN(const auto keys, readCameras(command.path));
        cameras = cameraPath(keys, command.frames > 0 ? command.frames : kPathFrames);
    }
    std::vector<Camera> current;
    for (const OrbitCamera& each : cameras) current.push_back(each.current());
    return current;
}

Json toJson(const TiledPictureStats& total, size_t pictures, uint32_t samples, const DeviceInfo& device,
            const FrameRequest& request) {
    return {{"width", request.width},
            {"height", request.height},
            {"pictures", pictures},
            {"tiles", total.tiles},
            {"ms_per_frame", total.ms / double(pictures)},
            {"rays_per_second", double(total.rays) / std::max(1e-3 * total.ms, 1e-9)},
            {"samples", samples},
            {"rays", total.rays},
            {"hit_pixels", total.hitPixels},
            {"device", castBy(device, total.onHost)},
            {"software", device.software},
            {"settled", total.update.settled},
            {"detail", nameOf(detailOf(total.update, request.errorPixels))},
            {"error_pixels", total.errorPixels},
            {"resident_bytes", total.update.residentBytes},
            {"bytes_read", total.update.bytesRead}};
}

/// Makes pictures in tiles and sequences, with progress; when it is cancelled, finished pictures stay.
Result<void> makeTiled(PictureRenderer& renderer, const FrameRequest& request, const std::vector<Camera>& cameras,
                       const RenderCommand& command, const OutputRules& rules) {
    ProgressDisplay display(command.report.progressStyle(), stderr);
    PictureSequence sequence(renderer, {.request = request,
                                        .cameras = cameras,
                                        .files = {command.output, command.depth, command.normals},
                                        .isNumbered = command.isSequence(),
                                        .tile = command.tile > 0 ? command.tile : kTile,
                                        .samples = command.samples,
                                        .rules = rules,
                                        .cancel = interrupted});
    for (bool isDone = false; !isDone;) {
        VCP_TRY_ASSIGN(isDone, sequence.step());
        display.update("drawing", sequence.fraction());
        if (!isDone && interrupted()) return Error::cancelled();
        if (sequence.isWaiting()) renderer.waitForPage(kWait);
    }
    display.finish();
    const TiledPictureStats& total = sequence.stats();
    if (command.report.json)
        return printJson(
            toJson(total, cameras.size(), samplesOf(request, command.samples), renderer.device(), request));
    const std::string name = command.isSequence() ? fmt::format("{} to {}", numbered(command.output, 1).string(),
                                                                numbered(command.output, cameras.size()).string())
                                                  : command.output;
    return printLineAbout(command.output, fmt::format("{}: {}, {} tiles in {}", name, sizeText(command.size),
                                                      total.tiles, formatSeconds(1e-3 * total.ms)));
}

/// Refuses options of the output that do not go together.
Result<void> checkOptions(const RenderCommand& command) {
    const auto usage = [](const char* message) { return Error{.code = ErrorCode::Usage, .message = message}; };
    if (command.output == kStandardOutput && command.isSequence())
        return usage("several pictures cannot go to standard output; give a file name");
    if (command.output == kStandardOutput && command.report.json)
        return usage("--json and -o - both want standard output");
    const std::filesystem::path output = command.output, depth = command.depth, normals = command.normals;
    if (depth == output || normals == output || (!command.depth.empty() && depth == normals))
        return usage("picture, --depth and --normals must be different files");
    if (command.methods.empty()) return {};
    if (command.tile > 0 || command.isSequence())
        return usage("--methods goes with one picture, without --tile, --turntable and --path");
    if (command.methods.size() > 1 && !(command.depth.empty() && command.normals.empty()))
        return usage("--depth and --normals are of one method, not of several");
    return {};
}

/// Returns what the files may replace: no file that is read, and not each other.
OutputRules rulesOf(const RenderCommand& command, const std::vector<std::filesystem::path>& filesRead) {
    OutputRules rules{.overwrite = command.overwrite, .inputs = filesRead};
    for (const std::string& name : command.inputs) rules.inputs.emplace_back(name);
    for (const std::string& name : {command.path, command.render.source.caFile})
        if (!name.empty()) rules.inputs.emplace_back(name);
    if (const auto* file = std::get_if<std::filesystem::path>(&command.render.camera)) rules.inputs.push_back(*file);
    return rules;
}

/// Finds what would be refused, before anything is built or drawn.
Result<void> checkOutputs(const RenderCommand& command, const OutputRules& rules, size_t pictures) {
    for (const std::string& name : {command.output, command.depth, command.normals}) {
        if (name.empty()) continue;
        const OutputKind kind = outputKindOf(name).value_or(OutputKind::Png);
        for (size_t i = 1; i <= pictures; ++i)
            VCP_TRY(checkOutput(command.isSequence() ? numbered(name, i) : std::filesystem::path(name), kind, rules));
    }
    return {};
}

Result<void> checkValidation(const PictureRenderer& renderer) {
    const std::vector<std::string> problems = renderer.validationMessages();
    return problems.empty() ? Result<void>() : Error{.code = ErrorCode::Device, .message = problems.front()};
}

/// Draws one picture, or one a method, side by side.
Result<void> drawOne(PictureRenderer& renderer, const FrameRequest& request, const OrbitCamera& camera,
                     const RenderCommand& command, const SceneFile& scene, const OutputRules& rules) {
    std::vector<std::string> methods = command.methods;
    if (methods.empty()) methods.emplace_back();
    std::optional<Drawing> first;
    std::vector<MethodPanel> panels;
    for (const std::string& method : methods) {
        if (first) {
            VCP_TRY_ASSIGN(auto surfaces, surfacesBy(method, scene));
            VCP_TRY(renderer.setSurfaces(surfaces.surfaces));
        }
        VCP_TRY_ASSIGN(auto drawing, draw(renderer, request, command));
        VCP_TRY_ASSIGN(auto panel,
                       readPanel(renderer, method, !scene.surfaces.empty(), drawing.stats, drawing.medianMs()));
        if (drawing.stats.unresolvedRays > 0)
            warnOnTerminal(fmt::format(
                "{} rays of mesostructure were given up: too many pieces of a base, or of its map, along them",
                drawing.stats.unresolvedRays));
        panels.push_back(std::move(panel));
        if (!first) first = std::move(drawing);
    }
    VCP_TRY(checkValidation(renderer));
    VCP_TRY(writePlanes(renderer, request, command, rules));
    VCP_TRY(writePng(sideBySide(panels), command.output, rules));
    return report(command, *first, panels, renderer.device(), request, camera);
}

/// Returns the request for the picture: options go before what the scene says, but for the light.
FrameRequest requestFor(const RenderCommand& command, const SceneFile& scene, const OrbitCamera& camera,
                        const Box& bounds) {
    FrameRequest request;
    request.camera = camera.current();
    request.width = uint32_t(command.size.x);
    request.height = uint32_t(command.size.y);
    request.errorPixels = command.render.errorPixels;
    request.shading = command.render.shading;
    request.shading.transparent = command.transparent;
    request.sections = command.render.sectionPlanes(bounds);
    request.sectionCaps = command.render.caps;
    if (request.sections.empty()) {
        request.sections = scene.sections;
        request.sectionCaps = command.render.caps || scene.sectionCaps;
    }
    if (scene.light) {
        request.shading.lightFollowsCamera = scene.light->followsCamera;
        request.shading.lightDirection = scene.light->direction;
    }
    request.march = command.render.march;
    return request;
}

/// Refuses what the host does not draw before a mesh is built for it.
Result<void> checkHost(const RenderCommand& command) {
    FrameRequest request;
    request.shading = command.render.shading;
    return checkHostDraws(request);
}

Result<int> run(const RenderCommand& command) {
    VCP_TRY(checkOptions(command));
    if (isHostName(command.render.device)) VCP_TRY(checkHost(command));
    VCP_TRY(checkOutputs(command, rulesOf(command, {}), 1));
    VCP_TRY_ASSIGN(const auto open,
                   openSceneShown(command.inputs, command.build, command.render.source, command.report.progressStyle(),
                                  {command.methods.empty() ? "" : command.methods[0], command.subdivide}));
    if ((!command.methods.empty() || command.subdivide) && open.file.surfaces.empty())
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("{} goes with a scene that has mesostructure",
                                            command.subdivide ? "--subdivide" : "--methods")};
    if (open.parts.size() == 1) VCP_TRY(command.render.checkFor(*open.parts.front().open.dataset));
    const SceneFile& scene = open.file;
    for (const std::string& warning : open.surfaces.warnings) warnOnTerminal(warning);
    const Box bounds = open.bounds();
    VCP_TRY_ASSIGN(const auto camera, command.render.isFit() && scene.camera
                                          ? *scene.camera
                                          : command.render.cameraFor(bounds, command.size));
    VCP_TRY_ASSIGN(const auto cameras, camerasOf(command, camera, bounds));
    const OutputRules rules = rulesOf(command, open.filesRead);
    VCP_TRY(checkOutputs(command, rules, cameras.size()));
    RendererOptions options = command.render.rendererOptions();
    options.validation = command.validation;
    VCP_TRY_ASSIGN(auto renderer, createPictureRenderer(options));
    VCP_TRY(renderer->open(open.placed(), open.surfaces.surfaces));

    const FrameRequest request = requestFor(command, scene, camera, bounds);
    const InterruptScope catching;
    if (!command.isTiled(request)) {
        VCP_TRY(drawOne(*renderer, request, camera, command, scene, rules));
        return 0;
    }
    if (!command.methods.empty())
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("--methods goes with at most {} M pixels", kMostPixelsAtOnce >> 20)};
    VCP_TRY(makeTiled(*renderer, request, cameras, command, rules));
    VCP_TRY(checkValidation(*renderer));
    return 0;
}

std::string checkPlane(const std::string& text) {
    return isImagePlanePath(text) ? std::string() : "must end in .pfm or .png, not \"" + text + "\"";
}

}  // namespace

Command addRender(CLI::App& vcp) {
    auto command = std::make_shared<RenderCommand>();
    CLI::App* app =
        vcp.add_subcommand("render", "Render .vcp files, a scene or meshes into a picture, without a window");
    app->add_option("IN", command->inputs,
                    ".vcp files or their http(s) addresses, a scene file (.json), or meshes, which are built into the "
                    "cache first")
        ->type_name("")
        ->required();
    app->add_option("-o,--output", command->output, "The PNG file to write; - for standard output")
        ->type_name("OUT.png")
        ->required()
        ->check([](const std::string& name) { return extensionProblem(name, ".png", true); });
    addOverwriteOption(*app, command->overwrite);
    addSize(*app, command->size, "1920x1200", "Width and height in pixels")->default_str(sizeText(command->size));
    addRenderSettings(*app, command->render);
    addSamples(*app, command->samples, "Rays a pixel, whose light is averaged: smooth edges; 1: none");
    app->add_flag("--transparent", command->transparent,
                  "No background: alpha is the part of a pixel where something is hit");
    CLI::Option* turntable = app->add_option("--turntable", command->turntable,
                                             "So many pictures once around the up axis: OUT-0001.png and so on")
                                 ->type_name("N")
                                 ->check(CLI::Range(1, 9999));
    app->add_option("--path", command->path,
                    "Pictures along a smooth path through the cameras of a JSON array, --frames of them [120]: "
                    "OUT-0001.png and so on")
        ->type_name("FILE")
        ->excludes(turntable);
    app->add_option(
           "--tile", command->tile,
           fmt::format("Draw in tiles of so many pixels a side [{} above {} M pixels]", kTile, kMostPixelsAtOnce >> 20))
        ->type_name("PIXELS")
        ->check(CLI::Range(16, 8192));
    app->add_option("--depth", command->depth,
                    "Write also the distance along each ray: .pfm (float, world units) or .png "
                    "(16-bit, 0 no hit, 1 nearest to 65535 farthest)")
        ->type_name("FILE")
        ->check(checkPlane);
    app->add_option("--normals", command->normals, "Write also the normals, world axes: .pfm or .png (128 + 127 n)")
        ->type_name("FILE")
        ->check(checkPlane);
    app->add_option("--frames", command->frames,
                    "Draw so many frames after the first and report their median time [0; 5 with --json]")
        ->type_name("N")
        ->check(CLI::Range(1, 1'000'000));
    app->add_option("--methods", command->methods,
                    fmt::format("Mesostructure by these methods in place of the scene's, side by side: {}",
                                fmt::join(meso::methodNames(), ", ")))
        ->type_name("A,B")
        ->delimiter(',')
        ->check(CLI::IsMember(std::vector<std::string>(meso::methodNames().begin(), meso::methodNames().end())))
        ->allow_extra_args(false);
    app->add_option("--subdivide", command->subdivide,
                    "Smooth all surfaces of the scene by Loop subdivision, so many times, in place of what it says")
        ->type_name("N")
        ->check(CLI::Range(0, meso::kMostSubdivisions));
    app->add_flag("--validation", command->validation, "With Vulkan's validation layers: what they say is an error");
    app->add_flag("--settle,!--no-settle", command->settle, "Wait until all that the view wants is loaded [on]");
    addBuildSettings(*app, command->build);
    addProgressOption(*app, command->report);
    addJsonOption(*app, command->report);
    return {app, [command] { return run(*command); }};
}

}  // namespace vcp
