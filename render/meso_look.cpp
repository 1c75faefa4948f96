#include "render/meso_look.h"

#include <algorithm>

#include <glm/geometric.hpp>
#include <glm/gtc/packing.hpp>
#include <glm/vec4.hpp>

#include "render/frame_setup.h"

namespace vcp {

namespace {

uint32_t shownIn(ShadingMode mode) {
    switch (mode) {
        case ShadingMode::Normals:
            return frame::kMesoShowNormals;
        case ShadingMode::Unlit:
            return frame::kMesoShowUnlit;
        case ShadingMode::Steps:
            return frame::kMesoShowHeat;
        default:
            return frame::kMesoShowLit;
    }
}

}  // namespace

MesoLook mesoLook(const MesoSurface& surface) {
    MesoLook look{.view = plainView(surface), .looks = {}};
    if (surface.far)
        for (const glm::vec4& texel : surface.far->texels) look.looks.push_back(glm::packHalf4x16(texel));
    const auto add = [&](const MesoTexture* texture, frame::MesoImage& where, uint32_t bit) {
        if (texture == nullptr) return;
        where = {uint32_t(look.looks.size()), texture->size.x, texture->size.y, texture->levels};
        look.looks.insert(look.looks.end(), texture->texels.begin(), texture->texels.end());
        if (texture->levels > 0) look.textures |= bit;
    };
    add(surface.colours.get(), look.view.colours, frame::kMesoColours);
    add(surface.normals.get(), look.view.normals, frame::kMesoNormals);
    if (surface.transfer) {
        const glm::uvec3 cells(surface.transfer->grid.cells);
        look.view.transfer = {uint32_t(look.looks.size()), cells.x, cells.y, cells.z};
        const std::vector<uint64_t> texels = meso::transferTexels(*surface.transfer);
        look.looks.insert(look.looks.end(), texels.begin(), texels.end());
    }
    look.view.hasBaseLight = changesBaseLight(surface) ? 1 : 0;
    // A surface that rays may come through must be marched.
    look.isFarDrawn = surface.far && (surface.withBase || surface.far->isOpaque);
    look.view.meanHeight = look.isFarDrawn ? float(surface.far->height) : 0.0f;
    return look;
}

frame::MesoView plainView(const MesoSurface& surface) {
    frame::MesoView view{};
    view.nodes = surface.shell.nodes;
    view.pieces = surface.shell.pieces;
    view.withBase = surface.withBase ? 1 : 0;
    view.shadowLift = float(surface.lift);
    view.colour = surface.colour;
    return view;
}

void setRays(frame::MesoView& view, glm::dvec3 origin, const PictureRays& rays) {
    view.eye = toVec4(rays.origin - origin), view.eyeX = toVec4(rays.originPerX), view.eyeY = toVec4(rays.originPerY);
    view.forward = toVec4(rays.direction), view.forwardX = toVec4(rays.directionPerX),
    view.forwardY = toVec4(rays.directionPerY);
    view.width = uint32_t(rays.size.x), view.height = uint32_t(rays.size.y);
    view.sectionCount = uint32_t(rays.sections.size());
    for (size_t i = 0; i < rays.sections.size(); ++i) {
        const glm::dvec3 normal(rays.sections[i]);
        view.sections[i] = glm::dvec4(normal, glm::dot(normal, origin) - rays.sections[i].w);
    }
}

void setPicture(frame::MesoView& view, glm::dvec3 origin, const FrameRequest& request) {
    setRays(view, origin, pictureRays(request));
    const PictureTile whole = wholePicture(request);
    const CameraBasis basis = cameraBasis(request.camera, whole.fullWidth, whole.fullHeight);
    view.lightCount = 0;
    const float on = areLightsOn(request.shading) ? 1.0f : 0.0f;
    for (const DirectedLight& light : lightsOf(request.shading))
        view.lights[view.lightCount++] = glm::vec4(glm::vec3(towardsLight(light, basis)), on * light.strength);
    view.up = lightDirections(request, basis).sky;
    view.hasEnvironment = request.shading.environment ? 1 : 0;
    if (request.shading.environment) {
        const auto rows = environmentRows(*request.shading.environment);
        std::copy(rows.begin(), rows.end(), view.environment);
        const auto harmonics = environmentHarmonics(*request.shading.environment);
        std::copy(harmonics.begin(), harmonics.end(), view.harmonics);
    }
    view.strayPixels = float(request.errorPixels), view.farShadows = request.shading.shadows ? 1 : 0;
    view.shows = shownIn(request.shading.mode);
}

bool changesBaseLight(const MesoSurface& surface) {
    return surface.transfer && surface.baseTransfer && !surface.baseTransfer->changes.empty();
}

bool readsTransfer(const Shading& shading) {
    return shading.environment && shownIn(shading.mode) == frame::kMesoShowLit;
}

bool hasMesoShadows(const Shading& shading) {
    return castsShadows(shading) && shownIn(shading.mode) == frame::kMesoShowLit;
}

}  // namespace vcp
