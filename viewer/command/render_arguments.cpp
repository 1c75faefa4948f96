#include "viewer/command/render_arguments.h"

#include "viewer/command/paper_arguments.h"
#include "viewer/command/parsed_option.h"
#include "viewer/command/source_arguments.h"
#include "viewer/scene/option_values.h"

namespace vcp {

namespace {

std::string checkPlane(const std::string& text) {
    return parsePlane(text) ? std::string() : "must be like \"x<0.2\", \"z>50%\" or \"a,b,c,d\", not \"" + text + "\"";
}

std::string checkDirection(const std::string& text) {
    return parseDirection(text) ? std::string() : "must be like 1,0,0.5, not \"" + text + "\"";
}

}  // namespace

void addRenderSettings(CLI::App& app, RenderSettings& settings) {
    addParsed(
        app, "--camera", settings.camera, parseCamera,
        "a view, a camera file, or an azimuth and an elevation below 90 degrees, like 30,35, and a magnification, "
        "like 30,35,2",
        "Where from: " + viewNames() +
            ", a camera file (JSON), or azimuth and elevation in degrees and a magnification: 30,35 or 30,35,2")
        ->type_name("VIEW|FILE")
        ->default_str("fit");
    app.add_option("--up", settings.up, "The axis that points up in the standard views: y or z")
        ->type_name("AXIS")
        ->capture_default_str()
        ->check(CLI::IsMember({"y", "z"}));
    app.add_option("--light", settings.light,
                   "camera: the light follows it; raking: so, and falls from the side; fixed: it stays in the world")
        ->type_name("WHICH")
        ->capture_default_str()
        ->check(CLI::IsMember({"camera", "raking", "fixed"}));
    app.add_option("--shading", settings.shading,
                   "lit or unlit (with colour where there is any), clay, normals; false colours: steps, cells, fetches "
                   "(work of each ray), level, "
                   "error (certified, up to a pixel)")
        ->type_name("MODE")
        ->capture_default_str()
        ->check(CLI::IsMember(std::vector<std::string>(kShadingNames.begin(), kShadingNames.end())));
    app.add_option("--light-direction", settings.lightDirection,
                   "Towards the light: right, up, back of the camera; with --light fixed x, y, z of the world")
        ->type_name("X,Y,Z")
        ->check(checkDirection);
    app.add_flag("--shadows", settings.shadows, "Hard shadows: a further ray a pixel");
    app.add_option("--occlusion", settings.occlusionRays, "Ambient occlusion, by so many further rays a pixel [0]")
        ->type_name("N")
        ->expected(0, 1)
        ->default_str(std::to_string(kUsualOcclusionRays))
        ->check(CLI::Range(0, int(kMostOcclusionRays)));
    app.add_option("--section", settings.sections,
                   "Keep one side of a plane: x<0.2, z>50% (of the bounding box), or a,b,c,d for ax + by + cz >= d; up "
                   "to 6 times")
        ->type_name("PLANE")
        ->take_all()
        ->expected(1, int(kMostSections))
        ->allow_extra_args(false)
        ->check(checkPlane);
    app.add_flag("--caps", settings.caps, "Fill what sections cut open (for closed surfaces)");
    app.add_option("--error-pixels", settings.errorPixels,
                   "Error that a picture may have, in pixels: finer levels are loaded until then")
        ->type_name("PIXELS")
        ->capture_default_str()
        ->check(CLI::Range(0.01, 1000.0));
    app.add_option("--budget", settings.budget, "Memory for subvolumes on the device, never exceeded")
        ->type_name("BYTES")
        ->capture_default_str()
        ->check(budgetProblem);
    app.add_option(
           "--ram", settings.ram,
           "Memory for subvolumes on their way there, and for stored ones kept to be read again; never exceeded")
        ->type_name("BYTES")
        ->capture_default_str()
        ->check(budgetProblem);
    addPaperMarchOptions(app, settings.march);
    addSourceSettings(app, settings.source);
    app.add_option("--device", settings.device,
                   "Vulkan device: an index or a part of a name, see `vcp devices` [the best one]")
        ->type_name("DEVICE");
}

}  // namespace vcp
