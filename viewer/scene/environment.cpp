#include "viewer/scene/environment.h"

#include <algorithm>
#include <filesystem>

#include "viewer/asset/radiance_picture.h"

namespace vcp {

bool isEnvironmentName(const std::string& name) {
    std::string end = std::filesystem::path(name).extension().string();
    std::ranges::transform(end, end.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c; });
    return end == ".hdr" || end == ".exr";
}

Result<EnvironmentLight> openEnvironment(const EnvironmentChoice& choice) {
    auto light = environmentNamed(choice.source);
    if (!light) {
        VCP_TRY_ASSIGN(const auto picture, readRadiancePicture(choice.source));
        light = environmentLight(picture.texels, picture.size);
        if (!light)
            return Error{.code = ErrorCode::InvalidInput,
                         .message = "is black: no light comes from these surroundings",
                         .file = choice.source};
    }
    light->turn = choice.turn;
    light->strength = choice.strength;
    return *light;
}

bool hasOwnLight(const OpenedScene& scene) { return !scene.file.lights.empty() || scene.environment; }

void setSceneLight(Shading& shading, const OpenedScene& scene, const Shading& usual) {
    const bool hasLights = !scene.file.lights.empty();
    setLights(shading, hasLights ? scene.file.lights : lightsOf(usual));
    shading.environment = scene.environment ? scene.environment : usual.environment;
    shading.lightsBeside = hasLights || (!scene.environment && usual.lightsBeside);
}

}  // namespace vcp
