#include "render/surface_pick.h"

#include <cmath>
#include <limits>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "mesostructure/known_error.h"
#include "render/frame_setup.h"
#include "render/host/surface_caster.h"
#include "render/meso_look.h"

namespace vcp {

namespace {

// What single precision and the margins of pieces take from a hit, in parts of its depth and of the shell's size. A
// third of it was measured (tests/render/surface_pick_test.cpp).
constexpr double kRounding = 1e-5;

/// Returns how many world units one unit of the tile is at most, in a piece of the shell.
double stretchOf(const meso::Shell& shell, int piece) {
    const auto row = [&](int i) { return glm::dvec3(shell.texels[size_t(piece + 4 + i)]); };
    const glm::dmat3 worldFromTile = glm::inverse(glm::transpose(glm::dmat3(row(0), row(1), row(2))));
    double sum = 0;
    for (int i = 0; i < 3; ++i) sum += glm::dot(worldFromTile[i], worldFromTile[i]);
    return std::sqrt(sum);
}

std::optional<double> errorAt(const MesoSurface& surface, const MesoHit& hit) {
    const auto known = knownError(*surface.arrays);
    if (!known) return {};
    const meso::Shell& shell = surface.shell;
    return *known * stretchOf(shell, hit.piece) +
           kRounding * (double(hit.depth) + glm::distance(shell.low, shell.high));
}

}  // namespace

std::optional<SurfacePoint> pickOnSurfaces(std::span<const MesoSurface> surfaces, glm::dvec3 origin,
                                           glm::dvec3 direction, std::span<const SectionPlane> sections,
                                           std::span<const glm::dvec3> moved) {
    std::optional<SurfacePoint> nearest;
    const PictureRays rays{.origin = origin, .direction = direction, .size = {1, 1}, .sections = sectionCuts(sections)};
    MesoHit hit;
    hit.depth = std::numeric_limits<float>::infinity();
    for (size_t i = 0; i < surfaces.size(); ++i) {
        const MesoSurface& surface = surfaces[i];
        if (surface.remeshed.surface) continue;
        HostSurface cast{*surface.arrays, surface.shell, plainView(surface), {}, 0, false, {}};
        setRays(cast.view, surface.shell.origin + (i < moved.size() ? moved[i] : glm::dvec3(0)), rays);
        uint32_t iterations = 0;
        SurfaceWork work;
        if (SurfaceCaster(cast).castPixel({0, 0}, hit, iterations, work))
            nearest = {origin + double(hit.depth) * direction, hit.normal, double(hit.depth), errorAt(surface, hit)};
    }
    return nearest;
}

}  // namespace vcp
