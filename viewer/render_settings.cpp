#include "viewer/render_settings.h"

#include <algorithm>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "viewer/option_values.h"
#include "viewer/paper_settings.h"

namespace vcp {

namespace {

struct NamedShading {
    const char* name;
    ShadingMode mode;
};
constexpr NamedShading kShadings[] = {
    {"lit", ShadingMode::Lit},         {"unlit", ShadingMode::Unlit}, {"clay", ShadingMode::Clay},
    {"normals", ShadingMode::Normals}, {"steps", ShadingMode::Steps}, {"cells", ShadingMode::Cells},
    {"fetches", ShadingMode::Fetches},
    {"level", ShadingMode::Level},     {"error", ShadingMode::Error},
};
constexpr const char* kDefaultOcclusionRays = "8";

// From the left, almost along a surface that faces the camera: relief of a millimetre casts its shade.
constexpr glm::vec3 kRakingLight(-0.97f, 0.17f, 0.17f);

std::vector<std::string> shadingNames() {
    std::vector<std::string> names;
    for (const NamedShading& each : kShadings) names.emplace_back(each.name);
    return names;
}

std::string checkPlane(const std::string& text) {
    return parsePlane(text) ? std::string() : "must be like \"x<0.2\", \"z>50%\" or \"a,b,c,d\", not \"" + text + "\"";
}

std::string checkDirection(const std::string& text) {
    return parseDirection(text) ? std::string() : "must be like 1,0,0.5, not \"" + text + "\"";
}

}  // namespace

RendererOptions RenderSettings::rendererOptions() const {
    RendererOptions options;
    options.device = device;
    options.budgetBytes = parseBytes(budget).value_or(options.budgetBytes);
    options.ramBytes = parseBytes(ram).value_or(options.ramBytes);
    // Colour pages are neither read nor kept when nothing would show them.
    options.colour = shading == "lit" || shading == "unlit";
    return options;
}

Result<void> RenderSettings::checkFor(const Dataset& dataset) const {
    const auto usage = [](const char* message) { return Error{ErrorCode::Usage, message}; };
    const bool isPaper = dataset.header.method == Method::Paper;
    if (!isPaper && march != PaperMarch{}) return usage("the options --paper-... are for files built with --method paper");
    if (isPaper && (shadows || occlusionRays > 0 || caps)) return usage("files built with --method paper have no --shadows, --occlusion or --caps");
    return {};
}

Shading RenderSettings::shadingChosen() const {
    Shading chosen;
    chosen.mode = std::find_if(std::begin(kShadings), std::end(kShadings), [&](const auto& each) { return shading == each.name; })->mode;
    chosen.lightFollowsCamera = light != "fixed";
    if (light == "raking") chosen.lightDirection = kRakingLight;
    if (!lightDirection.empty()) chosen.lightDirection = parseDirection(lightDirection).value();
    chosen.shadows = shadows;
    chosen.occlusionRays = occlusionRays;
    return chosen;
}

std::vector<SectionPlane> RenderSettings::sectionPlanes(const Box& bounds) const {
    std::vector<SectionPlane> planes;
    for (const std::string& text : sections) {
        const PlaneText plane = parsePlane(text).value();
        // An axis' own offset: from the box's lower side on, whichever side is kept.
        const glm::dvec3 axis = glm::abs(plane.normal);
        const double offset = plane.isRelative ? glm::dot(plane.normal, bounds.low) + plane.offset * glm::dot(axis, bounds.high - bounds.low) : plane.offset;
        planes.push_back({plane.normal, offset});
    }
    return planes;
}

Result<OrbitCamera> RenderSettings::cameraFor(const Box& bounds, glm::ivec2 size, const PictureMargins& covered) const {
    const auto view = viewNamed(camera);
    if (!view) return readCamera(camera);
    OrbitCamera fitted;
    fitted.up = upAxis();
    fitted.look(*view, bounds, size, covered);
    return fitted;
}

void addRenderSettings(CLI::App& app, RenderSettings& settings) {
    app.add_option("--camera", settings.camera, "Where from: " + viewNames() + ", or a camera file (JSON)")
        ->type_name("VIEW|FILE")
        ->capture_default_str();
    app.add_option("--up", settings.up, "The axis that points up in the standard views: y or z")
        ->type_name("AXIS")
        ->capture_default_str()
        ->check(CLI::IsMember({"y", "z"}));
    app.add_option("--light", settings.light, "camera: the light follows it; raking: so, and falls from the side; fixed: it stays in the world")
        ->type_name("WHICH")
        ->capture_default_str()
        ->check(CLI::IsMember({"camera", "raking", "fixed"}));
    app.add_option("--shading", settings.shading, "lit or unlit (with colour where there is any), clay, normals; false colours: steps, cells, fetches (work of each ray), level, "
                                               "error (certified, up to a pixel)")
        ->type_name("MODE")
        ->capture_default_str()
        ->check(CLI::IsMember(shadingNames()));
    app.add_option("--light-direction", settings.lightDirection, "Towards the light: right, up, back of the camera; with --light fixed x, y, z of the world")
        ->type_name("X,Y,Z")
        ->check(checkDirection);
    app.add_flag("--shadows", settings.shadows, "Hard shadows: a further ray a pixel");
    app.add_option("--occlusion", settings.occlusionRays, "Ambient occlusion, by so many further rays a pixel [0]")
        ->type_name("N")
        ->expected(0, 1)
        ->default_str(kDefaultOcclusionRays)
        ->check(CLI::Range(0, 64));
    app.add_option("--section", settings.sections, "Keep one side of a plane: x<0.2, z>50% (of the bounding box), or a,b,c,d for ax + by + cz >= d; up to 6 times")
        ->type_name("PLANE")
        ->take_all()
        ->expected(1, static_cast<int>(kMostSections))
        ->allow_extra_args(false)
        ->check(checkPlane);
    app.add_flag("--caps", settings.caps, "Fill what sections cut open (for closed surfaces)");
    app.add_option("--error-pixels", settings.errorPixels, "Error that a picture may have, in pixels: finer levels are loaded until then")
        ->type_name("PIXELS")
        ->capture_default_str()
        ->check(CLI::Range(0.01, 1000.0));
    app.add_option("--budget", settings.budget, "Memory for subvolumes on the device, never exceeded")
        ->type_name("BYTES")
        ->capture_default_str()
        ->check(budgetProblem);
    app.add_option("--ram", settings.ram, "Memory for subvolumes on their way there, and for stored ones kept to be read again; never exceeded")
        ->type_name("BYTES")
        ->capture_default_str()
        ->check(budgetProblem);
    addPaperMarchOptions(app, settings.march);
    addSourceSettings(app, settings.source);
    app.add_option("--device", settings.device, "Vulkan device: an index or a part of a name, see `vcp devices` [the best one]")
        ->type_name("DEVICE");
}

}  // namespace vcp
