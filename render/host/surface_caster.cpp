#include "render/host/surface_caster.h"

#include <algorithm>

#include <glm/geometric.hpp>

#include "render/host/hit_light.h"
#include "render/host/shell_caster.h"

namespace vcp {

using namespace meso::f32::shell;

struct SurfaceCaster::Cast : ShellCast {
    explicit Cast(const HostSurface& s)
        : ShellCast(s.arrays, s.view, s.shell.texels.data(), s.looks.data(), s.baseLight.data(), s.textures,
                    s.isFarDrawn) {}

    struct Ray {
        glm::vec3 origin, towards;
    };
    [[nodiscard]] Ray rayOf(glm::ivec2 pixel) const {
        const glm::vec2 at = glm::vec2(pixel) + 0.5f;
        return {glm::vec3(view.eye) + at.x * glm::vec3(view.eyeX) + at.y * glm::vec3(view.eyeY),
                glm::vec3(view.forward) + at.x * glm::vec3(view.forwardX) + at.y * glm::vec3(view.forwardY)};
    }
};

SurfaceCaster::SurfaceCaster(const HostSurface& surface) : surface_(surface), cast_(std::make_unique<Cast>(surface)) {}
SurfaceCaster::SurfaceCaster(const SurfaceCaster& other) : SurfaceCaster(other.surface_) {}
SurfaceCaster::~SurfaceCaster() = default;

bool SurfaceCaster::castPixel(glm::ivec2 pixel, MesoHit& hit, uint32_t& iterations, SurfaceWork& work) {
    Cast& cast = *cast_;
    const auto [origin, towards] = cast.rayOf(pixel);
    const glm::vec3 d = glm::normalize(towards);
    const ShellKept kept = cast.keptPart(origin, d);
    const float reach = std::min(std::min(hit.depth, frame::kMesoNoHit), kept.last) - kept.first;
    if (reach <= 0) return false;
    const glm::vec3 eye = origin + kept.first * d;
    cast.kShadow = 0;
    cast.widthGrowth = glm::length(glm::vec3(cast.view.forwardX)) / glm::length(towards);
    cast.widthAtStart = glm::length(glm::vec3(cast.view.eyeX)) + cast.widthGrowth * kept.first;
    const ShellHit found = cast.castShell(eye, d, reach);
    iterations += found.iterations;
    work.unresolvedRays += found.unresolved ? 1 : 0;
    if (!(found.t < reach)) return false;
    work.farHits += found.far ? 1 : 0;
    glm::vec3 n = glm::normalize(found.normal);
    const float width = cast.pixelWidth(found.t);
    const ShellLook look = cast.lookOf(found, eye + found.t * d, d, width, n);
    uint32_t arrives = 0;
    if (cast.view.transfer.up != 0 && cast.view.hasEnvironment != 0 && !found.far && !found.cut)
        arrives = f32::packedLight(cast.transferredLight(found, eye + found.t * d, n));
    if (glm::dot(n, d) > 0) n -= glm::dot(n, d) * d;
    hit = {.depth = kept.first + found.t,
           .normal = glm::normalize(n),
           .colour = look.colour,
           .width = width,
           .piece = found.piece,
           .isFar = found.far,
           .sky = look.sky / kMesoMostSky,
           .arrives = arrives,
           .light = look.light};
    return true;
}

float SurfaceCaster::castLight(const Start& start, glm::vec3 direction, float reach, bool any, SurfaceWork& work) {
    Cast& cast = *cast_;
    const auto [origin, towards] = cast.rayOf(start.pixel);
    const glm::vec3 from = origin + start.depth * glm::normalize(towards) + start.lift * start.normal;
    const ShellKept kept = cast.keptPart(from, direction);
    const float left = std::min(reach, kept.last) - kept.first;
    if (left <= 0) return reach;
    cast.kShadow = any ? 1 : 0;
    cast.widthAtStart = start.width;
    cast.widthGrowth = 0;
    const ShellHit found = cast.castShell(from + kept.first * direction, direction, left);
    work.unresolvedRays += found.unresolved ? 1 : 0;
    return found.t < left ? kept.first + found.t : reach;
}

}  // namespace vcp
