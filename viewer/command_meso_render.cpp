// vcp meso render: a picture of mesostructure on a surface.
#include "viewer/command_meso_render.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "viewer/image_files.h"
#include "viewer/meso_scene.h"
#include "viewer/option_values.h"
#include "viewer/render_settings.h"

namespace vcp {

namespace {

constexpr double kFov = 0.6;

struct RenderMeso {
    std::vector<std::string> assets, colours;
    std::vector<double> tiles, heights;
    MesoSurfaceDescription description;
    std::string out, size = "960x640", view = "30,35", camera, light = "0.5,-0.4,0.75", device, depth, cones = "4x1";
    bool shadows = false, heat = false, noBase = false, validation = false;
    int frames = 0;
    ReportOptions report;
};

/// Numbers with commas between; empty when malformed.
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

/// One value for all, or one an asset.
template <class T>
Result<T> valueOf(const std::vector<T>& values, size_t i, size_t count, T otherwise, const char* option) {
    if (values.empty()) return otherwise;
    if (values.size() == 1) return values[0];
    if (values.size() != count) return wrong(fmt::format("{} is given {} times for {} assets; once, or once for each", option, values.size(), count));
    return values[i];
}

Result<std::vector<MesoSurfaceDescription>> descriptionsOf(const RenderMeso& c) {
    constexpr const char* kColours[] = {"0.78,0.76,0.72", "0.95,0.74,0.22", "0.55,0.68,0.8", "0.72,0.45,0.36"};
    std::vector<MesoSurfaceDescription> all;
    for (size_t i = 0; i < c.assets.size(); ++i) {
        MesoSurfaceDescription d = c.description;
        d.asset = c.assets[i];
        const auto tiles = valueOf(c.tiles, i, c.assets.size(), 4.0, "--tiles");
        if (!tiles) return tiles.error();
        const auto height = valueOf(c.heights, i, c.assets.size(), 1.0, "--height");
        if (!height) return height.error();
        const auto colour = valueOf(c.colours, i, c.assets.size(), std::string(kColours[i % std::size(kColours)]), "--colour");
        if (!colour) return colour.error();
        const std::vector<double> rgb = numbersOf(*colour);
        if (rgb.size() != 3) return wrong("--colour must be like 0.8,0.7,0.6, not \"" + *colour + "\"");
        d.tiles = *tiles, d.heightScale = *height, d.colour = {float(rgb[0]), float(rgb[1]), float(rgb[2])};
        const std::vector<double> cones = numbersOf(std::string(c.cones).replace(std::min(c.cones.find('x'), c.cones.size()), 1, ","));
        if (cones.size() != 2) return wrong("--cones must be like 4x2, not \"" + c.cones + "\"");
        d.method.cones = {int(cones[0]), int(cones[1])};
        // A base is drawn once.
        d.withBase = !c.noBase && i == 0;
        all.push_back(std::move(d));
    }
    return all;
}

Result<Camera> cameraOf(const RenderMeso& c, const Box& bounds, glm::ivec2 size) {
    if (!c.camera.empty()) {
        RenderSettings settings;
        settings.camera = c.camera, settings.up = "z";
        const auto camera = settings.cameraFor(bounds, size);
        if (!camera) return camera.error();
        return camera->current();
    }
    const std::vector<double> view = numbersOf(c.view);
    if (view.size() < 2 || view.size() > 3 || std::abs(view[1]) >= 90 || (view.size() == 3 && !(view[2] > 0)))
        return wrong("--view must be an azimuth and an elevation below 90 degrees, like 30,35, or with a magnification, like 30,35,2; not \"" + c.view + "\"");
    const double turn = view[0] * std::numbers::pi / 180, rise = view[1] * std::numbers::pi / 180;
    const glm::dvec3 forward(-std::cos(rise) * std::cos(turn), -std::cos(rise) * std::sin(turn), -std::sin(rise));
    Camera camera = fitCamera(bounds.low, bounds.high, forward, {0, 0, 1}, kFov, double(size.x) / size.y);
    if (view.size() == 3) camera.verticalFov = 2 * std::atan(std::tan(kFov / 2) / view[2]);
    return camera;
}

Result<int> runRender(const RenderMeso& command) {
    const auto size = parseSize(command.size);
    if (!size) return wrong("--size must be like 960x640, not \"" + command.size + "\"");
    const auto descriptions = descriptionsOf(command);
    if (!descriptions) return descriptions.error();
    const auto scene = makeMesoScene(*descriptions);
    if (!scene) return scene.error();
    const auto camera = cameraOf(command, scene->bounds, *size);
    if (!camera) return camera.error();
    const auto light = parseDirection(command.light);
    if (!light) return wrong("--light must be a direction like 0.5,0.4,0.8, not \"" + command.light + "\"");
    auto renderer = MesoRenderer::create({.device = command.device, .validation = command.validation});
    if (!renderer) return renderer.error();
    VCP_TRY((*renderer)->setSurfaces(scene->surfaces));
    MesoRequest request;
    request.look.camera = *camera, request.look.light = *light, request.look.shadows = command.shadows, request.look.heat = command.heat;
    request.width = uint32_t(size->x), request.height = uint32_t(size->y);
    MesoFrameStats stats;
    std::vector<double> times;
    for (int i = 0; i <= command.frames; ++i) {
        const auto drawn = (*renderer)->render(request);
        if (!drawn) return drawn.error();
        stats = *drawn;
        if (i > 0) times.push_back(stats.msFrame);
    }
    std::ranges::sort(times);
    if (!times.empty()) stats.msFrame = times[times.size() / 2];
    const auto picture = (*renderer)->readPicture();
    if (!picture) return picture.error();
    VCP_TRY(writePng(*picture, command.out));
    const auto depth = (*renderer)->readDepth();
    if (!depth) return depth.error();
    if (!command.depth.empty()) VCP_TRY(writeDepth(*depth, request.width, request.height, command.depth));
    const auto iterations = (*renderer)->readIterations();
    if (!iterations) return iterations.error();
    uint64_t covered = 0;
    double sum = 0;
    for (const float d : *depth) covered += std::isfinite(d);
    for (const uint32_t n : *iterations) sum += n;
    const std::vector<std::string> problems = (*renderer)->validationMessages();
    if (!problems.empty()) return Error{.code = ErrorCode::Device, .message = problems.front()};
    if (command.report.json) {
        VCP_TRY(printJson({{"file", command.out}, {"method", command.description.method.name}, {"surface", command.description.base}, {"device", (*renderer)->device().name},
                           {"ms_per_frame", stats.msFrame}, {"hit_pixels", covered}, {"iterations_mean", sum / double(depth->size())}, {"unresolved", stats.unresolved},
                           {"asset_bytes", stats.assetBytes}, {"warnings", scene->warnings}}));
        return 0;
    }
    for (const std::string& warning : scene->warnings) VCP_TRY(printLine("warning: " + warning));
    VCP_TRY(printLine(fmt::format("{}: {} on {}, {:.1f} ms on {}, {:.1f} iterations a pixel, {} unresolved, {}", command.out, command.description.method.name,
                                  command.description.base, stats.msFrame, (*renderer)->device().name, sum / double(depth->size()), stats.unresolved, formatBytes(stats.assetBytes))));
    return 0;
}

}  // namespace

RunCommand addMesoRender(CLI::App& meso) {
    auto command = std::make_shared<RenderMeso>();
    MesoSurfaceDescription& d = command->description;
    CLI::App* app = meso.add_subcommand("render", "A picture of assets on a surface");
    app->add_option("ASSET", command->assets, "Procedural ones by name, or assets (.meso); several lie on the same surface")->type_name("")->required();
    app->add_option("-o,--output", command->out, "The PNG to write")->type_name("FILE")->required();
    app->add_option("--surface", d.base, fmt::format("{}, or a mesh with texture coordinates", fmt::join(meso::baseSurfaceNames(), ", ")))->type_name("BASE")->capture_default_str();
    app->add_option("--method", d.method.name, fmt::format("{}", fmt::join(meso::methodNames(), ", ")))->type_name("NAME")->capture_default_str();
    app->add_option("--grid", d.method.cells, "Cells along x of the method's grid [the asset's, or 64]")->type_name("N")->check(CLI::Range(1, meso::kMaxGridEdge));
    app->add_option("--cones", command->cones, "Of ddm methods: azimuths x elevations")->type_name("MxN")->capture_default_str();
    app->add_option("--steps", d.method.steps, "Of relief methods, from the slab's top to its bottom")->type_name("N")->capture_default_str()->check(CLI::Range(1, 4096));
    app->add_option("--tiles", command->tiles, "Tile edges along the surface, or a unit of a mesh's coordinates; for all assets, or each [4]")->type_name("N")->allow_extra_args(false);
    app->add_option("--height", command->heights, "Times the asset's own height; for all assets, or each [1]")->type_name("X")->allow_extra_args(false);
    app->add_option("--colour", command->colours, "Red, green, blue up to 1, as the screen has them; for all assets, or each")->type_name("R,G,B")->allow_extra_args(false);
    app->add_option("--size", command->size, "Pixels")->type_name("WxH")->capture_default_str();
    app->add_option("--view", command->view, "Azimuth and elevation of the eye in degrees, magnification")->type_name("A,E,M")->capture_default_str();
    app->add_option("--camera", command->camera, "fit, front, ..., isometric, or a camera file, in place of --view")->type_name("CAMERA");
    app->add_option("--light", command->light, "Towards the light, in world space")->type_name("X,Y,Z")->capture_default_str();
    app->add_option("--depth", command->depth, "Distances along the rays, as `vcp render --depth`")->type_name("FILE");
    app->add_option("--frames", command->frames, "Draw so many more frames and report their median")->type_name("N")->check(CLI::Range(0, 10000));
    app->add_option("--device", command->device, "Vulkan device: an index or a part of a name, see `vcp devices` [the best one]")->type_name("DEVICE");
    app->add_flag("--shadows", command->shadows, "A shadow ray from each hit");
    app->add_flag("--heat", command->heat, "Iterations of each pixel's ray, blue to red: 0 to 100");
    app->add_flag("--no-base", command->noBase, "The base itself is not drawn");
    app->add_flag("--validation", command->validation, "With Vulkan's validation layers");
    addJsonOption(*app, command->report);
    return [command] { return runRender(*command); };
}

}  // namespace vcp
