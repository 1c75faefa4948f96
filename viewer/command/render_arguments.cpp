#include "viewer/command/render_arguments.h"

#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "viewer/command/manual/help_text.h"
#include "viewer/command/paper_arguments.h"
#include "viewer/command/parsed_option.h"
#include "viewer/command/source_arguments.h"
#include "viewer/scene/option_values.h"

namespace vcp {

namespace {

// This light comes from the left, almost along a surface that faces the camera: relief of a millimetre casts shade.
constexpr glm::vec3 kRakingLight(-0.97f, 0.17f, 0.17f);

/// Adds --light and then --light-direction, which are taken in this order.
void addLight(CLI::App& app, RenderSettings& settings) {
    const auto take = [&settings, &shading = settings.shading](const std::string& which) {
        settings.hasLight = true;
        shading.lightFollowsCamera = which != "fixed";
        if (which == "raking") shading.lightDirection = kRakingLight;
    };
    app.add_option_function<std::string>(
           "--light", take,
           "camera: the light follows it; raking: so, and falls from the side; fixed: it stays in the world")
        ->type_name("WHICH")
        ->default_str("camera")
        ->check(CLI::IsMember({"camera", "raking", "fixed"}));
    const auto parse = [&settings](std::string_view text) {
        settings.hasLight = true;
        return parseDirection(text);
    };
    addParsed(app, "--light-direction", settings.shading.lightDirection, parse, "like 1,0,0.5",
              "Towards the light: right, up, back of the camera; with --light fixed x, y, z of the world")
        ->type_name("X,Y,Z");
}

void addEnvironment(CLI::App& app, EnvironmentChoice& environment) {
    CLI::Option* source =
        app.add_option("--environment", environment.source,
                       fmt::format("Light from everywhere, in place of the light where none is asked for: {}, or a "
                                   "picture of the surroundings (.hdr, .exr; equirectangular)",
                                   fmt::join(kEnvironmentNames, ", ")))
            ->type_name("NAME|FILE")
            ->check([](const std::string& text) { return text.empty() ? "must not be empty" : std::string(); });
    app.add_option("--environment-turn", environment.turn, "Degrees that the surroundings are turned to the left")
        ->type_name("DEGREES")
        ->needs(source)
        ->check(CLI::Range(-360.0, 360.0));
    app.add_option("--environment-strength", environment.strength, "Times the usual light of the surroundings")
        ->type_name("TIMES")
        ->needs(source)
        ->check(CLI::Range(0.0, double(kStrongestEnvironment)));
}

void addUp(CLI::App& app, std::optional<UpAxis>& up) {
    const auto take = [&up](const std::string& axis) { up = axis == "z" ? UpAxis::Z : UpAxis::Y; };
    app.add_option_function<std::string>(
           "--up", take,
           "The axis that points up in the standard views: y or z [as the shape of the scan says, else y]")
        ->type_name("AXIS")
        ->check(CLI::IsMember({"y", "z"}));
}

}  // namespace

void addSamples(CLI::App& app, uint32_t& samples, const std::string& description) {
    app.add_option("--samples", samples, description)
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(1, int(kMostSamples)));
}

void addCameraSettings(CLI::App& app, RenderSettings& settings) {
    const ScopedGroup camera(app, help_group::kCamera);
    addParsed(
        app, "--camera", settings.camera, parseCamera,
        "a view, a camera file, or an azimuth and an elevation below 90 degrees, like 30,35, and a magnification, "
        "like 30,35,2",
        "Where from: " + viewNames() +
            ", a camera file (JSON), or azimuth (from x on, as seen from above) and elevation in degrees and a "
            "magnification: 30,35 or 30,35,2")
        ->type_name("VIEW|FILE")
        ->default_str("fit");
    addUp(app, settings.up);
}

void addRenderSettings(CLI::App& app, RenderSettings& settings) {
    addCameraSettings(app, settings);
    const ScopedGroup scope(app, help_group::kLook);
    addLight(app, settings);
    addEnvironment(app, settings.environment);
    addParsed(app, "--shading", settings.shading.mode, shadingNamed,
              fmt::format("one of {}", fmt::join(kShadingNames, ", ")),
              "lit or unlit (with colour where there is any), clay, normals, wireframe (edges of triangles and "
              "leaves); false "
              "colours: level (of detail), error (up to a pixel), steps, cells, fetches (work of each ray)")
        ->type_name(fmt::format("MODE:{{{}}}", fmt::join(kShadingNames, ",")))
        ->default_str("lit");
    app.add_flag("!--plain", settings.shading.channels,
                 "Plain light on all colours, where materials have normals, roughness, metalness or emission, too");
    app.add_flag("--shadows", settings.shading.shadows, "Light casts hard shadows");
    app.add_option(
           "--occlusion", settings.shading.occlusionRays,
           fmt::format("Corners and folds are darker (ambient occlusion), by so many rays a pixel and sample; {} "
                       "without N [off]",
                       kUsualOcclusionRays))
        ->type_name("N")
        ->expected(0, 1)
        ->default_str(std::to_string(kUsualOcclusionRays))
        ->check(CLI::Range(0, int(kMostOcclusionRays)));
    // What is parsed so far is in the list.
    const auto parse = [&sections = settings.sections](std::string_view text) {
        return sections.size() < kMostSections ? parsePlane(text) : std::nullopt;
    };
    addParsedList(app, "--section", settings.sections, parse,
                  "like \"x<0.2\", \"z>50%\" or \"a,b,c,d\", at most 6 times",
                  "Keep one side of a plane: x<0.2, z>50% (of the bounding box), or a,b,c,d for ax + by + cz >= d; up "
                  "to 6 times")
        ->type_name("PLANE");
    app.add_flag("--caps{closed}", settings.caps,
                 "Fill what sections cut open of closed parts, and draw the rest as lines; --caps=all: fill as if all "
                 "were closed")
        ->type_name("[=all]")
        ->transform(CLI::Transformer(std::map<std::string, Caps>{{"closed", Caps::Closed}, {"all", Caps::All}})
                        .description("{closed,all}"));
    beginGroup(app, help_group::kLimits);
    app.add_option("--error-pixels", settings.errorPixels,
                   "Error that may be seen, in pixels: detail is loaded until the picture errs by no more")
        ->type_name("PIXELS")
        ->capture_default_str()
        ->check(CLI::Range(0.01, 1000.0));
    app.add_option(
           "--colour-error", settings.colourError,
           "Difference of colours that may be seen, as \u0394E (black and white differ by 100): detail is loaded "
           "until what is coarser than that has no more than the pixels of --error-pixels; 100: any")
        ->type_name("DELTA_E")
        ->capture_default_str()
        ->check(CLI::Range(0.0, kMostColourError));
    addBudget(app, "--budget", settings.budgetBytes, "Memory of the device that detail may take, never exceeded")
        ->default_str("512M");
    addBudget(app, "--ram", settings.ramBytes,
              "Main memory that detail may take on its way there, and to be kept for later; never exceeded")
        ->default_str("256M");
    app.add_option(
           "--device", settings.device,
           "Device that draws: an index or a part of a name, see `vcp devices` [the best one]; host: the processor, "
           "without Vulkan")
        ->type_name("DEVICE");
    addSourceSettings(app, settings.source);
    addPaperMarchOptions(app, settings.march);
    beginGroup(app, help_group::kWritten);
    addUnit(app, settings.unit,
            "What one unit of the files is, for lengths that are shown: um, mm, cm, m, km, in or ft");
}

}  // namespace vcp
