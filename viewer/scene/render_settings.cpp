#include "viewer/scene/render_settings.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "viewer/scene/environment.h"
#include "viewer/scene/option_values.h"

namespace vcp {

std::optional<ShadingMode> shadingNamed(std::string_view name) {
    const auto found = std::ranges::find(kShadingNames, name);
    if (found == kShadingNames.end()) return std::nullopt;
    return static_cast<ShadingMode>(found - kShadingNames.begin());
}

std::optional<CameraChoice> parseCamera(std::string_view text) {
    if (const auto view = viewNamed(text)) return *view;
    const std::vector<double> numbers = parseNumbers(text);
    if (numbers.empty()) return std::filesystem::path(text);
    if (numbers.size() < 2 || numbers.size() > 3 || std::abs(numbers[1]) >= 90) return std::nullopt;
    const ViewAngles angles{numbers[0], numbers[1], numbers.size() == 3 ? numbers[2] : 1};
    return angles.magnification > 0 ? std::optional<CameraChoice>(angles) : std::nullopt;
}

RendererOptions RenderSettings::rendererOptions() const {
    RendererOptions options;
    options.device = device;
    options.hostRays = leavesRaysToHost(device);
    options.budgetBytes = budgetBytes;
    options.ramBytes = ramBytes;
    // Colour pages are neither read nor kept when nothing would show them.
    options.colour = shading.mode == ShadingMode::Lit || shading.mode == ShadingMode::Unlit;
    return options;
}

Result<void> RenderSettings::takeEnvironment() {
    if (environment.source.empty()) return {};
    VCP_TRY_ASSIGN(shading.environment, openEnvironment(environment));
    shading.lightsBeside = hasLight;
    return {};
}

Result<void> RenderSettings::checkFor(const Dataset& dataset) const {
    const auto usage = [](const char* message) { return Error{.code = ErrorCode::Usage, .message = message}; };
    const bool isPaper = dataset.header.method == Method::Paper;
    if (!isPaper && march != PaperMarch{}) return usage("the paper's march is for files built by the paper's method");
    if (isPaper && (shading.shadows || shading.occlusionRays > 0 || caps != Caps::None))
        return usage("files built by the paper's method are drawn without shadows, ambient occlusion and caps");
    return {};
}

std::vector<SectionPlane> RenderSettings::sectionPlanes(const Box& bounds) const {
    std::vector<SectionPlane> planes;
    for (const PlaneChoice& plane : sections) planes.push_back({plane.normal, offsetIn(plane, bounds)});
    return planes;
}

UpAxis RenderSettings::upFor(const OpenedScene& scene) const {
    return scene.surfaces.surfaces.empty() ? upFor(scene.bounds()) : up.value_or(usualUp);
}

Result<OrbitCamera> RenderSettings::cameraFor(const Box& bounds, UpAxis upward, glm::ivec2 size,
                                              const PictureMargins& covered) const {
    if (const auto* file = std::get_if<std::filesystem::path>(&camera)) return readCamera(*file);
    OrbitCamera fitted;
    fitted.up = upward;
    if (const auto* view = std::get_if<View>(&camera)) fitted.look(*view, bounds, size, covered);
    if (const auto* angles = std::get_if<ViewAngles>(&camera)) fitted.look(*angles, bounds, size, covered);
    return fitted;
}

}  // namespace vcp
