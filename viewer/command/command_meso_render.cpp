// vcp meso render: pictures of mesostructure on surfaces, one a method, side by side.
#include "viewer/command/command_meso_render.h"
#include "viewer/command/build_arguments.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <memory>
#include <numbers>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <glm/common.hpp>

#include "builder/measure/quantile.h"
#include "mesostructure/base/subdivision.h"
#include "viewer/command/interrupt.h"
#include "viewer/picture/image_files.h"
#include "viewer/scene/meso_scene.h"
#include "viewer/scene/option_values.h"
#include "viewer/scene/render_settings.h"
#include "viewer/scene/scene_opening.h"

namespace vcp {

namespace {

constexpr double kFov = 0.6;

struct RenderMeso {
    std::vector<std::string> assets, surfaces, colours, textures, normalTextures, places, methods{"boxes"};
    std::vector<double> tiles, heights, scales;
    MesoSurfaceDescription description;
    std::string out, size = "960x640", view = "30,35", camera, light, up = "z", scan, device, depth, cones = "4x1";
    bool overwrite = false, shadows = false, heat = false, noBase = false, validation = false;
    double errorPixels = 0.5;
    int frames = 0;
    ReportOptions report;
};

/// Parses numbers with commas between; returns none when malformed.
std::vector<double> numbersOf(const std::string& text) {
    std::vector<double> numbers;
    for (size_t at = 0; at <= text.size();) {
        const size_t comma = std::min(text.find(',', at), text.size());
        char* stop = nullptr;
        const std::string word = text.substr(at, comma - at);
        const double number = std::strtod(word.c_str(), &stop);
        if (word.empty() || *stop != 0 || !std::isfinite(number)) return {};
        numbers.push_back(number);
        at = comma + 1;
    }
    return numbers;
}

Error wrong(std::string message) { return {.code = ErrorCode::Usage, .message = std::move(message)}; }

/// Returns an asset's value: one value serves all assets, or there is one for each.
template <class T>
Result<T> valueOf(const std::vector<T>& values, size_t i, size_t count, T otherwise, const char* option) {
    if (values.empty()) return otherwise;
    if (values.size() == 1) return values[0];
    if (values.size() != count)
        return wrong(
            fmt::format("{} is given {} times for {} assets; once, or once for each", option, values.size(), count));
    return values[i];
}

Result<glm::dvec3> threeOf(const std::string& text, const char* option, const char* example) {
    const std::vector<double> numbers = numbersOf(text);
    if (numbers.size() != 3) return wrong(fmt::format("{} must be like {}, not \"{}\"", option, example, text));
    return glm::dvec3(numbers[0], numbers[1], numbers[2]);
}

UpAxis upOf(const RenderMeso& c) { return c.up == "y" ? UpAxis::Y : UpAxis::Z; }

Result<MesoSurfaceDescription> descriptionOf(const RenderMeso& c, size_t i) {
    constexpr const char* kColours[] = {"0.78,0.76,0.72", "0.95,0.74,0.22", "0.55,0.68,0.8", "0.72,0.45,0.36"};
    MesoSurfaceDescription d = c.description;
    const size_t count = c.assets.size();
    VCP_TRY_ASSIGN(const auto surface, valueOf(c.surfaces, i, count, std::string("quad"), "--surface"));
    const auto tiles = valueOf(c.tiles, i, count, 4.0, "--tiles"),
               height = valueOf(c.heights, i, count, 1.0, "--height"),
               scale = valueOf(c.scales, i, count, 1.0, "--scale");
    for (const auto* value : {&tiles, &height, &scale})
        if (!*value) return value->error();
    if (!(*scale > 0) || !std::isfinite(*scale)) return wrong("--scale must be above 0");
    if (!(*tiles > 0) || *tiles > 4096) return wrong("--tiles must be above 0 and at most 4096");
    if (!(*height > 0) || !std::isfinite(*height)) return wrong("--height must be above 0");
    const auto place = valueOf(c.places, i, count, std::string("0,0,0"), "--at"),
               colour = valueOf(c.colours, i, count, std::string(kColours[i % std::size(kColours)]), "--colour");
    for (const auto* value : {&place, &colour})
        if (!*value) return value->error();
    const auto at = threeOf(*place, "--at", "0,0.5,0"), rgb = threeOf(*colour, "--colour", "0.8,0.7,0.6");
    for (const auto* value : {&at, &rgb})
        if (!*value) return value->error();
    if (glm::clamp(*rgb, 0.0, 1.0) != *rgb)
        return wrong("--colour must be three numbers from 0 to 1, not \"" + *colour + "\"");
    const auto cones = parseSize(c.cones);
    if (!cones || cones->x > 32 || cones->y > 16)
        return wrong("--cones must be whole numbers from 1x1 to 32x16, like 4x2, not \"" + c.cones + "\"");
    const auto texture = valueOf(c.textures, i, count, std::string(), "--texture"),
               normals = valueOf(c.normalTextures, i, count, std::string(), "--normal-texture");
    for (const auto* value : {&texture, &normals})
        if (!*value) return value->error();
    d.withFar = c.errorPixels > 0;
    d.colourTexture = *texture, d.normalTexture = *normals;
    d.asset = c.assets[i], d.base = surface, d.tiles = *tiles, d.heightScale = *height, d.scale = *scale, d.place = *at,
    d.colour = glm::vec3(*rgb), d.up = upOf(c);
    d.method.cones = {cones->x, cones->y};
    return d;
}

Result<std::vector<MesoSurfaceDescription>> descriptionsOf(const RenderMeso& c) {
    std::vector<MesoSurfaceDescription> all;
    for (size_t i = 0; i < c.assets.size(); ++i) {
        VCP_TRY_ASSIGN(auto d, descriptionOf(c, i));
        // A base is drawn once: with its first asset, and not beside a quad where that lies a little lower.
        const auto hides = [&](const MesoSurfaceDescription& other) {
            if (other.base != d.base) return false;
            if (other.place == d.place && other.scale == d.scale) return true;
            const glm::dvec3 off = glm::abs(other.place - d.place);
            return d.base == "quad" && std::max(off.x, d.up == UpAxis::Y ? off.z : off.y) < other.scale;
        };
        d.withBase = !c.noBase && std::ranges::none_of(all, hides);
        all.push_back(std::move(d));
    }
    return all;
}

Result<Camera> cameraOf(const RenderMeso& c, const Box& bounds, glm::ivec2 size) {
    if (!c.camera.empty()) {
        RenderSettings settings;
        settings.camera = c.camera, settings.up = c.up;
        VCP_TRY_ASSIGN(const auto camera, settings.cameraFor(bounds, size));
        return camera.current();
    }
    const std::vector<double> view = numbersOf(c.view);
    if (view.size() < 2 || view.size() > 3 || std::abs(view[1]) >= 90 || (view.size() == 3 && !(view[2] > 0)))
        return wrong(
            "--view must be an azimuth and an elevation below 90 degrees, like 30,35, or with a magnification, like "
            "30,35,2; not \"" +
            c.view + "\"");
    const double turn = view[0] * std::numbers::pi / 180, rise = view[1] * std::numbers::pi / 180;
    const glm::dvec3 forward =
        turnedUp({-std::cos(rise) * std::cos(turn), -std::cos(rise) * std::sin(turn), -std::sin(rise)}, upOf(c));
    Camera camera =
        fitCamera(bounds.low, bounds.high, forward, turnedUp({0, 0, 1}, upOf(c)), kFov, double(size.x) / size.y);
    if (view.size() == 3) camera.verticalFov = 2 * std::atan(std::tan(kFov / 2) / view[2]);
    return camera;
}

/// The picture of one method.
struct Panel {
    Picture picture;
    Json json;
    std::string line;
};

Picture besideEachOther(const std::vector<Panel>& panels) {
    if (panels.size() == 1) return panels.front().picture;
    const uint32_t width = panels.front().picture.width, height = panels.front().picture.height;
    Picture all{uint32_t(width * panels.size()), height, {}};
    all.rgba.reserve(size_t{4} * all.width * height);
    for (uint32_t y = 0; y < height; ++y)
        for (const Panel& panel : panels) {
            const auto row = panel.picture.rgba.begin() + std::ptrdiff_t(size_t{4} * y * width);
            all.rgba.insert(all.rgba.end(), row, row + std::ptrdiff_t(size_t{4} * width));
        }
    return all;
}

Result<FrameStats> drawFrames(Renderer& renderer, const FrameRequest& request, int frames) {
    VCP_TRY_ASSIGN(const auto update, renderer.settle(request, interrupted));
    if (!update.problems.empty()) return update.problems.front();
    FrameStats stats;
    std::vector<double> times;
    for (int i = 0; i <= frames; ++i) {
        VCP_TRY_ASSIGN(stats, renderer.render(request));
        if (i > 0) times.push_back(stats.msFrame);
    }
    if (!times.empty()) stats.msFrame = upperQuantile(times, 0.5);
    return stats;
}

Result<Panel> drawPanel(Renderer& renderer, const FrameRequest& request, const RenderMeso& command,
                        const OutputRules& rules, const std::string& method) {
    VCP_TRY_ASSIGN(const auto stats, drawFrames(renderer, request, command.frames));
    VCP_TRY_ASSIGN(auto picture, renderer.readPicture());
    if (!command.depth.empty()) {
        VCP_TRY_ASSIGN(const auto depth, renderer.readDepth());
        VCP_TRY(writeDepth(depth, request.width, request.height, command.depth, rules));
    }
    VCP_TRY_ASSIGN(const auto iterations, renderer.readIterations());
    const std::vector<std::string> problems = renderer.validationMessages();
    if (!problems.empty()) return Error{.code = ErrorCode::Device, .message = problems.front()};
    const double mean = std::accumulate(iterations.begin(), iterations.end(), 0.0) / double(iterations.size());
    return Panel{std::move(picture),
                 {{"method", method},
                  {"ms_per_frame", stats.msFrame},
                  {"hit_pixels", stats.hitPixels},
                  {"iterations_mean", mean},
                  {"unresolved", stats.unresolvedRays},
                  {"far_hits", stats.farHits},
                  {"asset_bytes", stats.surfaceBytes}},
                 fmt::format("{}: {:.1f} ms, {:.1f} iterations a pixel, {} unresolved, {}", method, stats.msFrame, mean,
                             stats.unresolvedRays, formatBytes(stats.surfaceBytes))};
}

Result<FrameRequest> requestOf(const RenderMeso& command, const Box& bounds) {
    const auto size = parseSize(command.size);
    if (!size) return wrong("--size must be like 960x640, not \"" + command.size + "\"");
    VCP_TRY_ASSIGN(const auto camera, cameraOf(command, bounds, *size));
    const auto light =
        command.light.empty() ? turnedUp({0.5, -0.4, 0.75}, upOf(command)) : parseDirection(command.light);
    if (!light) return wrong("--light must be a direction like 0.5,0.4,0.8, not \"" + command.light + "\"");
    FrameRequest request;
    request.camera = camera;
    if (command.errorPixels > 0) request.errorPixels = command.errorPixels;  // else surfaces are always marched
    request.width = uint32_t(size->x), request.height = uint32_t(size->y);
    request.shading.mode = command.heat ? ShadingMode::Steps : ShadingMode::Lit;
    request.shading.lightFollowsCamera = false, request.shading.lightDirection = glm::vec3(*light);
    request.shading.shadows = command.shadows;
    request.shading.backgroundTop = {0.85f, 0.89f, 0.93f}, request.shading.backgroundBottom = {0.57f, 0.62f, 0.69f};
    return request;
}

Result<int> report(const RenderMeso& command, const std::vector<Panel>& panels,
                   const std::vector<std::string>& warnings, const DeviceInfo& device) {
    if (command.report.json) {
        Json json = {{"file", command.out}, {"device", device.name}, {"warnings", warnings}, {"panels", Json::array()}};
        for (const Panel& panel : panels) json["panels"].push_back(panel.json);
        VCP_TRY(printJson(json));
        return 0;
    }
    for (const std::string& warning : warnings) VCP_TRY(printLine("warning: " + warning));
    VCP_TRY(printLine(fmt::format("{} on {}", command.out, device.name)));
    for (const Panel& panel : panels) VCP_TRY(printLine("  " + panel.line));
    return 0;
}

/// Returns what the picture may replace: no file that is read.
OutputRules rulesOf(const RenderMeso& command, const std::vector<MesoSurfaceDescription>& descriptions) {
    SceneFile scene;
    scene.datasets.push_back({command.scan, {}});
    scene.surfaces = descriptions;
    OutputRules rules{.overwrite = command.overwrite, .inputs = filesOf(scene)};
    rules.inputs.emplace_back(command.camera);
    return rules;
}

Result<int> runRender(const RenderMeso& command) {
    if (command.methods.size() > 1 && !command.depth.empty()) return wrong("--depth is of one method");
    VCP_TRY_ASSIGN(auto descriptions, descriptionsOf(command));
    // Errors are reported before anything is made.
    const OutputRules rules = rulesOf(command, descriptions);
    VCP_TRY(checkOutput(command.out, OutputKind::Png, rules));
    if (const auto request = requestOf(command, {glm::dvec3(-1), glm::dvec3(1)}); !request) return request.error();
    OpenedScene behind;
    if (!command.scan.empty()) {
        SourceSettings source;
        source.cancelled = interrupted;
        VCP_TRY_ASSIGN(behind, openSceneShown({command.scan}, BuildSettings{}, source, ProgressStyle::None));
    }
    const InterruptScope catching;
    RendererOptions options;
    options.device = command.device, options.validation = command.validation;
    VCP_TRY_ASSIGN(auto renderer, Renderer::create(options));
    VCP_TRY(renderer->open(behind.placed()));
    std::vector<std::string> warnings = behind.surfaces.warnings;
    std::vector<Panel> panels;
    for (const std::string& method : command.methods) {
        for (MesoSurfaceDescription& d : descriptions) d.method.name = method;
        VCP_TRY_ASSIGN(auto scene, makeMesoScene(descriptions));
        if (panels.empty()) warnings.insert(warnings.end(), scene.warnings.begin(), scene.warnings.end());
        VCP_TRY_ASSIGN(const auto request, requestOf(command, scene.bounds.joined(behind.bounds())));
        std::vector<MesoSurface> surfaces = behind.surfaces.surfaces;
        std::ranges::move(scene.surfaces, std::back_inserter(surfaces));
        VCP_TRY(renderer->setSurfaces(surfaces));
        VCP_TRY_ASSIGN(auto panel, drawPanel(*renderer, request, command, rules, method));
        panels.push_back(std::move(panel));
    }
    VCP_TRY(writePng(besideEachOther(panels), command.out, rules));
    return report(command, panels, warnings, renderer->device());
}

}  // namespace

RunCommand addMesoRender(CLI::App& meso) {
    auto command = std::make_shared<RenderMeso>();
    MesoSurfaceDescription& d = command->description;
    CLI::App* app = meso.add_subcommand("render", "A picture of assets on surfaces");
    app->add_option("ASSET", command->assets, "Procedural ones by name, or assets (.meso)")->type_name("")->required();
    app->add_option("-o,--output", command->out, "The PNG to write")
        ->type_name("FILE")
        ->required()
        ->check([](const std::string& name) { return extensionProblem(name, ".png", false); });
    addOverwriteOption(*app, command->overwrite);
    app->add_option("--surface", command->surfaces,
                    fmt::format("{}, or a mesh with texture coordinates; for all assets, or each [quad]",
                                fmt::join(meso::baseSurfaceNames(), ", ")))
        ->type_name("BASE")
        ->allow_extra_args(false);
    app->add_option("--at", command->places,
                    "Where the surface's origin is, world units; for all assets, or each [0,0,0]")
        ->type_name("X,Y,Z")
        ->allow_extra_args(false);
    app->add_option("--scale", command->scales, "Times the surface's own size; for all assets, or each [1]")
        ->type_name("X")
        ->allow_extra_args(false);
    app->add_option("--scan", command->scan,
                    "In the same picture: an octree (.vcp), a mesh, which is built into the cache first, or a scene of "
                    "several (.json)")
        ->type_name("FILE");
    app->add_option("--up", command->up, "Which way is up, for surfaces and view")
        ->capture_default_str()
        ->check(CLI::IsMember({"y", "z"}));
    app->add_option("--method", command->methods,
                    fmt::format("{}; several are drawn side by side [boxes]", fmt::join(meso::methodNames(), ", ")))
        ->type_name("A,B")
        ->delimiter(',')
        ->allow_extra_args(false);
    app->add_option("--grid", d.method.cells, "Cells along x of the method's grid [the asset's, or 64]")
        ->type_name("N")
        ->check(CLI::Range(1, meso::kMaxGridEdge));
    app->add_option("--cones", command->cones, "Of ddm methods: azimuths x elevations")
        ->type_name("MxN")
        ->capture_default_str();
    app->add_option("--steps", d.method.steps, "Of relief methods, from the slab's top to its bottom")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(1, 4096));
    app->add_option("--tiles", command->tiles,
                    "Tile edges along the surface, or a unit of a mesh's coordinates; for all assets, or each [4]")
        ->type_name("N")
        ->allow_extra_args(false);
    app->add_option("--subdivide", d.subdivide, "Times that all surfaces are smoothed by Loop subdivision")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(0, meso::kMostSubdivisions));
    app->add_option("--height", command->heights, "Times the asset's own height; for all assets, or each [1]")
        ->type_name("X")
        ->allow_extra_args(false);
    app->add_option("--colour", command->colours,
                    "Red, green, blue up to 1, as the screen has them; for all assets, or each")
        ->type_name("R,G,B")
        ->allow_extra_args(false);
    app->add_option("--texture", command->textures,
                    "A picture (PNG, JPEG) over the tile, in place of --colour; for all assets, or each")
        ->type_name("FILE")
        ->allow_extra_args(false);
    app->add_option("--normal-texture", command->normalTextures,
                    "A picture of normals over the tile (OpenGL: green is up) that bends those of the asset; for all "
                    "assets, or each")
        ->type_name("FILE")
        ->allow_extra_args(false);
    app->add_option("--size", command->size, "Pixels")->type_name("WxH")->capture_default_str();
    app->add_option("--view", command->view, "Azimuth and elevation of the eye in degrees, magnification")
        ->type_name("A,E,M")
        ->capture_default_str();
    app->add_option("--camera", command->camera, "fit, front, ..., isometric, or a camera file, in place of --view")
        ->type_name("CAMERA");
    app->add_option("--light", command->light, "Towards the light, in world space [0.5,-0.4,0.75 where z is up]")
        ->type_name("X,Y,Z");
    app->add_option("--depth", command->depth, "Distances along the rays, as `vcp render --depth`")->type_name("FILE");
    app->add_option("--frames", command->frames, "Draw so many more frames and report their median")
        ->type_name("N")
        ->check(CLI::Range(0, 10000));
    app->add_option("--device", command->device,
                    "Vulkan device: an index or a part of a name, see `vcp devices` [the best one]")
        ->type_name("DEVICE");
    app->add_option("--error-pixels", command->errorPixels,
                    "Mesostructure that strays less than that from its mean height, with tiles of at most eight times "
                    "that, is not marched; 0: all is")
        ->type_name("X")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 64.0));
    app->add_flag("--shadows", command->shadows, "A shadow ray from each hit");
    app->add_flag("--heat", command->heat, "Iterations of each pixel's ray, blue to red: 0 to 100");
    app->add_flag("--no-base", command->noBase, "The base itself is not drawn");
    app->add_flag("--validation", command->validation, "With Vulkan's validation layers");
    addJsonOption(*app, command->report);
    return [command] { return runRender(*command); };
}

}  // namespace vcp
