// vcp render: pictures without a window: one, one larger than the device draws at once, or a sequence.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <glm/geometric.hpp>

#include "mesostructure/base/subdivision.h"
#include "render/false_colours.h"
#include "viewer/annotation/picture_canvas.h"
#include "viewer/camera/camera_path.h"
#include "viewer/command/build_arguments.h"
#include "viewer/command/manual/help_text.h"
#include "viewer/command/parsed_option.h"
#include "viewer/command/render_arguments.h"
#include "viewer/command/render_command.h"
#include "viewer/command/render_outputs.h"
#include "viewer/command/terminal/interrupt.h"
#include "viewer/picture/image_files.h"
#include "viewer/scene/environment.h"
#include "viewer/scene/meso_scene.h"
#include "viewer/scene/option_values.h"
#include "viewer/scene/scene_opening.h"
#include "viewer/window/measurement.h"

namespace vcp {

namespace {

constexpr int kPathFrames = 120;

/// Whether the middle of the background is nearer to black than to white, as people see it.
bool hasDarkBackground(const Shading& shading) {
    constexpr float kMiddleGrey = 0.18f;
    const glm::vec3 middle = 0.5f * (shading.backgroundTop + shading.backgroundBottom);
    return glm::dot(middle, glm::vec3(0.2126f, 0.7152f, 0.0722f)) < kMiddleGrey;
}

/// Returns what writes legend, scale bar and the scene's annotations over pictures from the cameras; empty where there
/// is none. Errors: Usage, where there is nothing that a legend says.
Result<PaintRows> paintOverOf(const RenderCommand& command, const OpenedScene& open,
                              const std::vector<OrbitCamera>& cameras) {
    Annotations annotations{.legends = {}, .hasScaleBar = command.scaleBar, .lines = {}, .unit = command.render.unit};
    if (command.annotations) annotations.points = open.file.annotations;
    if (!command.measurement.empty()) {
        VCP_TRY_ASSIGN(const auto measured, readMeasurement(command.measurement));
        if (!annotations.unit) annotations.unit = measured.unit;
        annotations.lines = annotatedLines(measured.measurement, annotations.unit);
    }
    const Shading& shading = command.render.shading;
    if (command.legend) {
        annotations.legends = legendsOf(shading.mode, open.legendSubject());
        if (annotations.legends.empty())
            return Error{.code = ErrorCode::Usage,
                         .message =
                             "--legend goes with --shading steps, cells, fetches, level or error, on files that "
                             "have such numbers"};
    }
    if (!command.legend && !command.scaleBar && annotations.points.empty() && annotations.lines.empty())
        return PaintRows();
    std::vector<AnnotatedView> views;
    for (const OrbitCamera& camera : cameras)
        views.push_back(annotatedPicture(camera.current(), camera.viewHeight(), glm::uvec2(command.size)));
    return annotationPainter(std::move(annotations), std::move(views), hasDarkBackground(shading));
}

/// Returns the course of a sequence, or of the one picture. `isFitted`: the camera was chosen so that all is seen, and
/// so is each camera of a turntable. Errors: Usage, where nothing can be animated; those of readCameras.
Result<PictureCourse> courseOf(const RenderCommand& command, OrbitCamera camera, const OpenedScene& open,
                               bool isFitted) {
    const std::vector<SurfacePath>& paths = open.surfaces.paths;
    const double period = periodOf(paths);
    if (command.animate && period == 0)
        return Error{.code = ErrorCode::Usage,
                     .message = "--animate goes with a scene in which a surface has a \"path\""};
    PictureCourse course{.cameras = {camera}, .surfacesMoved = {}};
    if (command.turntable > 0) {
        const Box bounds = open.bounds();
        if (isFitted) camera.fitAround(bounds, command.size, command.turntable);
        course.cameras = turntable(camera, bounds.centre(), command.turntable);
    } else if (!command.path.empty()) {
        VCP_TRY_ASSIGN(const auto keys, readCameras(command.path));
        course.cameras = cameraPath(keys, command.frames > 0 ? command.frames : kPathFrames);
    } else if (command.animate) {
        const double all = std::clamp(std::round(period * command.framesPerSecond), 2.0, 1e6);
        course.cameras.assign(command.frames > 0 ? size_t(command.frames) : size_t(all), camera);
    }
    for (size_t i = 0; command.animate && i < course.cameras.size(); ++i)
        course.surfacesMoved.push_back(surfacesMovedAt(paths, period * double(i) / double(course.cameras.size())));
    return course;
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
    if (command.isVideo() && !command.isSequence())
        return usage("a video needs --turntable, --path or --animate, which say what it shows");
    if (command.isVideo() && command.transparent) return usage("a video has no transparency; leave out --transparent");
    if (command.isVideo() && !hasVideoEncoder()) return usage(kNoVideoEncoder);
    if (command.legend && !isFalseColour(command.render.shading.mode))
        return usage("--legend goes with --shading steps, cells, fetches, level or error");
    if (command.methods.empty()) return {};
    if (command.tile > 0 || command.isSequence())
        return usage("--methods goes with one picture, without --tile, --turntable, --path and --animate");
    if (command.methods.size() > 1 && !(command.depth.empty() && command.normals.empty()))
        return usage("--depth and --normals are of one method, not of several");
    return {};
}

/// Returns what the files may replace: no file that is read, and not each other.
OutputRules rulesOf(const RenderCommand& command, const std::vector<std::filesystem::path>& filesRead) {
    OutputRules rules{.overwrite = command.overwrite, .inputs = filesRead};
    for (const std::string& name : command.inputs) rules.inputs.emplace_back(name);
    for (const std::string& name : {command.path, command.measurement, command.render.source.caFile})
        if (!name.empty()) rules.inputs.emplace_back(name);
    if (const auto* file = std::get_if<std::filesystem::path>(&command.render.camera)) rules.inputs.push_back(*file);
    const EnvironmentChoice& environment = command.render.environment;
    if (!environment.source.empty() && environment.isFile()) rules.inputs.emplace_back(environment.source);
    return rules;
}

/// Finds what would be refused, before anything is built or drawn.
Result<void> checkOutputs(const RenderCommand& command, const OutputRules& rules, size_t pictures) {
    for (const std::string& name : {command.output, command.depth, command.normals}) {
        if (name.empty()) continue;
        const OutputKind kind = outputKindOf(name).value_or(OutputKind::Png);
        for (size_t i = 1; i <= pictures; ++i) VCP_TRY(checkOutput(command.fileOf(name, i), kind, rules));
    }
    return {};
}

/// Returns the request for the picture: options go before what the scene says, but for the light.
FrameRequest requestFor(const RenderCommand& command, const OpenedScene& open, const OrbitCamera& camera,
                        const Box& bounds) {
    const SceneFile& scene = open.file;
    FrameRequest request;
    request.camera = camera.current();
    request.width = uint32_t(command.size.x);
    request.height = uint32_t(command.size.y);
    request.errorPixels = command.render.errorPixels;
    request.shading = command.render.shading;
    request.colourError = colourErrorIn(request.shading.mode, command.render.colourError);
    request.shading.transparent = command.transparent;
    request.sections = command.render.sectionPlanes(bounds);
    request.sectionCaps = command.render.caps;
    if (request.sections.empty()) {
        request.sections = scene.sections;
        request.sectionCaps = std::max(command.render.caps, scene.sectionCaps);
    }
    setSceneLight(request.shading, open, command.render.shading);
    if (request.shading.environment) request.shading.environment->up = directionOf(camera.up);
    request.looks = looksOf(scene);
    request.march = command.render.march;
    return request;
}

/// Draws all inputs together, into one picture or a sequence. Returns its figures, for --json.
Result<Json> render(const RenderCommand& command) {
    const SurfaceChoices choices{
        .method = command.methods.empty() ? "" : command.methods[0],
        .subdivide = command.subdivide,
        .withLightRays = command.render.shading.shadows || command.render.shading.occlusionRays > 0};
    VCP_TRY_ASSIGN(auto open, openSceneShown(command.inputs, command.build, command.render.source,
                                             command.report.progressStyle(), choices));
    if ((!command.methods.empty() || command.subdivide) && open.file.surfaces.empty())
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("{} goes with a scene that has mesostructure",
                                            command.subdivide ? "--subdivide" : "--methods")};
    if (open.parts.size() == 1) VCP_TRY(command.render.checkFor(*open.parts.front().open.dataset));
    const SceneFile& scene = open.file;
    for (const std::string& warning : open.surfaces.warnings) warnOnTerminal(warning);
    const Box bounds = open.bounds();
    const bool isScenes = command.render.isFit() && scene.camera;
    VCP_TRY_ASSIGN(const auto camera, isScenes
                                          ? *scene.camera
                                          : command.render.cameraFor(bounds, command.render.upFor(open), command.size));
    const bool isFitted = !isScenes && std::holds_alternative<View>(command.render.camera);
    VCP_TRY_ASSIGN(const auto course, courseOf(command, camera, open, isFitted));
    VCP_TRY_ASSIGN(const auto paintOver, paintOverOf(command, open, course.cameras));
    const OutputRules rules = rulesOf(command, open.filesRead);
    VCP_TRY(checkOutputs(command, rules, course.cameras.size()));
    RendererOptions options = command.render.rendererOptions();
    options.validation = command.validation;
    VCP_TRY_ASSIGN(auto renderer, createPictureRenderer(options));
    reportMeasuring(open.surfaces.surfaces, command.report.progressStyle());
    VCP_TRY(renderer->open(open.placed(), open.surfaces.surfaces));

    const FrameRequest request = requestFor(command, open, camera, bounds);
    const InterruptScope catching;
    if (!command.isTiled(request)) return drawOne(*renderer, request, camera, paintOver, command, scene, rules);
    if (!command.methods.empty())
        return Error{.code = ErrorCode::Usage,
                     .message = fmt::format("--methods goes with at most {} M pixels", kMostPixelsAtOnce >> 20)};
    VCP_TRY_ASSIGN(auto figures, makeTiled(*renderer, request, course, paintOver, command, rules));
    VCP_TRY(checkValidation(*renderer));
    return figures;
}

/// Returns a command for each input, where the output names a picture of each. Errors: Usage.
Result<std::vector<RenderCommand>> oneByOne(const RenderCommand& command) {
    VCP_TRY_ASSIGN(const auto outputs, outputsFor(command.output, command.inputs));
    std::vector<RenderCommand> commands(command.inputs.size(), command);
    for (size_t i = 0; i < commands.size(); ++i) {
        commands[i].inputs = {command.inputs[i]};
        commands[i].output = outputs[i];
        for (std::string* plane : {&commands[i].depth, &commands[i].normals}) {
            if (plane->empty()) continue;
            if (!isForEachInput(*plane) && commands.size() > 1)
                return Error{
                    .code = ErrorCode::Usage,
                    .message = "--depth and --normals of several inputs need names like the pictures', with {}"};
            *plane = outputFor(*plane, command.inputs[i]);
        }
    }
    return commands;
}

/// Says which pictures are there already, and makes the folder of those to come. Errors: Io.
Result<void> prepareOutputs(const std::vector<RenderCommand>& commands) {
    std::vector<std::string> replaced;
    std::error_code failed;
    for (const RenderCommand& each : commands) {
        const std::filesystem::path picture = each.output;
        if (std::filesystem::exists(picture, failed)) replaced.push_back(each.output);
        if (picture.has_parent_path() && !std::filesystem::create_directories(picture.parent_path(), failed) && failed)
            return Error{.code = ErrorCode::Io,
                         .message = "no such folder can be made: " + failed.message(),
                         .file = picture.parent_path().string()};
    }
    if (!replaced.empty())
        warnOnTerminal(fmt::format("{} of {} pictures are there already and are replaced: {}", replaced.size(),
                                   commands.size(), fmt::join(replaced, ", ")));
    return {};
}

Result<int> run(RenderCommand command) {
    VCP_TRY(command.render.takeEnvironment());
    const bool isForEach = isForEachInput(command.output);
    std::vector<RenderCommand> commands{command};
    if (isForEach) {
        VCP_TRY_ASSIGN(commands, oneByOne(command));
    }
    for (const RenderCommand& each : commands) VCP_TRY(checkOptions(each));
    if (isForEach) VCP_TRY(prepareOutputs(commands));
    for (const RenderCommand& each : commands) VCP_TRY(checkOutputs(each, rulesOf(command, {}), 1));
    Json pictures = Json::array();
    std::vector<std::string> failed;
    for (const RenderCommand& each : commands) {
        auto figures = render(each);
        if (!figures) {
            // An input that cannot be drawn does not keep the others from it.
            if (commands.size() == 1 || figures.error().code == ErrorCode::Cancelled) return figures.error();
            warnOnTerminal(figures.error().line());
            failed.push_back(each.inputs.front());
            figures = Json{{"error", figures.error().line()}};
        }
        if (isForEach) (*figures)["output"] = each.output;
        pictures.push_back(*std::move(figures));
    }
    if (command.report.json) VCP_TRY(printJson(isForEach ? Json{{"pictures", pictures}} : pictures.front()));
    if (failed.empty()) return 0;
    return Error{.code = ErrorCode::InvalidInput,
                 .message = fmt::format("{} of {} inputs could not be drawn: {}", failed.size(), commands.size(),
                                        fmt::join(failed, ", "))};
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
                    ".vcp files or folders of shards, their http(s) addresses, a scene file (.json), or meshes, which "
                    "are built into the "
                    "cache first")
        ->type_name("")
        ->required();
    beginGroup(*app, help_group::kOutput);
    app->add_option(
           "-o,--output", command->output,
           "The PNG file to write, with all inputs in it, or - for standard output; a folder, or a name with {} "
           "like \"pictures/{}-front.png\": a picture of each input, with its name; OUT.mp4 or OUT.webm: a video of "
           "--turntable or --path, where ffmpeg is installed")
        ->type_name("OUT.png")
        ->required()
        ->check([](const std::string& name) {
            const bool isFolder = isForEachInput(name) && name.find("{}") == std::string::npos;
            return isFolder || isVideoPath(name) ? std::string() : extensionProblem(name, ".png", true);
        });
    addOverwriteOption(*app, command->overwrite);
    addSize(*app, command->size, "1920x1200", "Width and height in pixels")->default_str(sizeText(command->size));
    app->add_option("--depth", command->depth,
                    "Write also the distance along each ray: .pfm (float, world units) or .png "
                    "(16-bit, 0 no hit, 1 nearest to 65535 farthest)")
        ->type_name("FILE")
        ->check(checkPlane);
    app->add_option("--normals", command->normals, "Write also the normals, world axes: .pfm or .png (128 + 127 n)")
        ->type_name("FILE")
        ->check(checkPlane);
    addRenderSettings(*app, command->render);
    beginGroup(*app, help_group::kWritten);
    app->add_flag("!--no-annotations", command->annotations, "Leave out the annotations of a scene file");
    app->add_option("--measurement", command->measurement,
                    "Write into the picture what was measured in the window: its measurement-N.json")
        ->type_name("FILE");
    app->add_flag("--legend", command->legend, "Write into the picture what its false colours mean");
    app->add_flag("--scale-bar", command->scaleBar, "Write into the picture how long a length is in it");
    beginGroup(*app, help_group::kLook);
    addSamples(*app, command->samples, "Rays a pixel, whose light is averaged: smooth edges; 1: none");
    app->add_flag("--transparent", command->transparent,
                  "No background: alpha is the part of a pixel where something is hit");
    app->add_option("--subdivide", command->subdivide,
                    "Smooth all surfaces of the scene by Loop subdivision, so many times, in place of what it says")
        ->type_name("N")
        ->check(CLI::Range(0, meso::kMostSubdivisions));
    beginGroup(*app, help_group::kPictures);
    CLI::Option* turntable = app->add_option("--turntable", command->turntable,
                                             "So many pictures once around the up axis: OUT-0001.png and so on, or a "
                                             "video")
                                 ->type_name("N")
                                 ->check(CLI::Range(1, 9999));
    app->add_option("--path", command->path,
                    "Pictures along a smooth path through the cameras of a JSON array: OUT-0001.png and so on, or a "
                    "video")
        ->type_name("FILE")
        ->excludes(turntable);
    app->add_flag(
        "--animate", command->animate,
        "What moves in a scene, once from beginning to end: OUT-0001.png and so on, or a video; with --path or "
        "--turntable in their pictures");
    app->add_option("--fps", command->framesPerSecond, "Pictures of a video that are shown in a second")
        ->type_name("N")
        ->check(CLI::Range(1, 240))
        ->capture_default_str();
    app->add_option("--frames", command->frames,
                    "Pictures along --path [120] or of --animate [all of its time]; of one picture: draw it so often "
                    "again, and report the median time [0; 5 with "
                    "--json]")
        ->type_name("N")
        ->check(CLI::Range(1, 1'000'000));
    beginGroup(*app, help_group::kLimits);
    app->add_option("--tile", command->tile,
                    fmt::format("Draw in tiles of so many pixels a side [{} above {} M pixels]", kUsualTile,
                                kMostPixelsAtOnce >> 20))
        ->type_name("PIXELS")
        ->check(CLI::Range(16, 8192));
    app->add_flag("--settle,!--no-settle", command->settle,
                  "Wait until all detail that the picture wants is loaded [on]");
    beginGroup(*app, help_group::kMeasuring);
    app->add_option("--methods", command->methods,
                    fmt::format("Mesostructure by these methods in place of the scene's, side by side: {}",
                                fmt::join(surfaceMethodNames(), ", ")))
        ->type_name("A,B")
        ->delimiter(',')
        ->check(CLI::IsMember(std::vector<std::string>(surfaceMethodNames().begin(), surfaceMethodNames().end())))
        ->allow_extra_args(false);
    app->add_flag("--validation", command->validation, "With Vulkan's validation layers: what they say is an error");
    addBuildSettings(*app, command->build, help_group::kMeshes);
    addProgressOption(*app, command->report);
    addJsonOption(*app, command->report);
    return {app, [command] { return run(*command); }};
}

}  // namespace vcp
