#include "viewer/scene/environment.h"

#include "viewer/asset/radiance_picture.h"

namespace vcp {

bool isEnvironmentName(const std::string& name) {
    for (const char* end : {".hdr", ".exr", ".HDR", ".EXR"})
        if (name.ends_with(end)) return true;
    return false;
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
    shading.environment = scene.environment ? scene.environment : usual.environment;
    if (!scene.file.lights.empty()) return setLights(shading, scene.file.lights);
    setLights(shading, lightsOf(usual));
    if (scene.environment) setLights(shading, {{usual.lightFollowsCamera, usual.lightDirection, 0}});
}

}  // namespace vcp
