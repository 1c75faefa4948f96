#include "viewer/render_settings.h"

#include "viewer/option_values.h"

namespace vcp {

namespace {

std::string checkBudget(const std::string& text) {
    constexpr uint64_t kLeast = 1 << 20;
    const auto bytes = parseBytes(text);
    return bytes && *bytes >= kLeast ? std::string() : "must be at least 1M, like 512M or 4G, not \"" + text + "\"";
}

}  // namespace

RendererOptions RenderSettings::rendererOptions(const OpenDataset& open) const {
    RendererOptions options;
    options.device = device;
    options.budgetBytes = parseBytes(budget).value_or(options.budgetBytes);
    options.ramBytes = parseBytes(ram).value_or(options.ramBytes);
    options.loaderThreads = open.loaderThreads();
    // Colour pages are neither read nor kept when nothing would show them.
    options.colour = shading == "lit";
    return options;
}

Shading RenderSettings::shadingChosen() const {
    Shading chosen;
    chosen.mode = shading == "clay"      ? ShadingMode::Clay
                  : shading == "normals" ? ShadingMode::Normals
                  : shading == "steps"   ? ShadingMode::Steps
                                         : ShadingMode::Lit;
    chosen.lightFollowsCamera = light == "camera";
    return chosen;
}

Result<OrbitCamera> RenderSettings::cameraFor(const Box& bounds, glm::ivec2 size) const {
    const auto view = viewNamed(camera);
    if (!view) return readCamera(camera);
    OrbitCamera fitted;
    fitted.up = upAxis();
    fitted.look(*view, bounds, size);
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
    app.add_option("--light", settings.light, "camera: the light follows it; fixed: it stays in the world")
        ->type_name("WHICH")
        ->capture_default_str()
        ->check(CLI::IsMember({"camera", "fixed"}));
    app.add_option("--shading", settings.shading, "lit (with colour where there is any), clay, normals, or steps (work of each ray)")
        ->type_name("MODE")
        ->capture_default_str()
        ->check(CLI::IsMember({"lit", "clay", "normals", "steps"}));
    app.add_option("--error-pixels", settings.errorPixels, "Error that a picture may have, in pixels: finer levels are loaded until then")
        ->type_name("PIXELS")
        ->capture_default_str()
        ->check(CLI::Range(0.01, 1000.0));
    app.add_option("--budget", settings.budget, "Memory for subvolumes on the device, never exceeded")
        ->type_name("BYTES")
        ->capture_default_str()
        ->check(checkBudget);
    app.add_option("--ram", settings.ram, "Memory for subvolumes on their way there, never exceeded")
        ->type_name("BYTES")
        ->capture_default_str()
        ->check(checkBudget);
    addSourceSettings(app, settings.source);
    app.add_option("--device", settings.device, "Vulkan device: an index or a part of a name, see `vcp devices` [the best one]")
        ->type_name("DEVICE");
}

}  // namespace vcp
