// Shadows by a displacement map against those that the shape casts: what is lit that should be dark (leak), what is
// dark that should be lit (acne), by how far above the surface the map is asked (Wang et al. 2004, 3.4).
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include <glm/geometric.hpp>

#include "mesostructure/method.h"
#include "render/meso_surface.h"
#include "viewer/asset/share_out.h"
#include "viewer/bench/bench_meso.h"

namespace vcp {

namespace {

using namespace meso;
using glm::dvec3;

constexpr std::array<double, 9> kOffsets = {0, 0.25, 0.5, 0.75, 1, 1.5, 2, 3, 4};  // points of the map
constexpr double kLeastCosine = 0.05;  // what turns away more is dark by itself
constexpr double kFromSurface = 1e-6;  // tiles, for the shape's own shadow

/// A place that faces a light: where the shape is, and where the map says that it is.
struct LitPlace {
    dvec3 at, normal, light;
    bool isDark = false;
    std::optional<MarchResult> mapped;  ///< of the map, where it hits
    dvec3 origin, direction;            ///< of the ray that saw it
};

dvec3 directionOf(double elevationDegrees, double turn) {
    const double e = elevationDegrees * std::numbers::pi / 180;
    return {std::cos(e) * std::cos(turn), std::cos(e) * std::sin(turn), std::sin(e)};
}

/// Finds places that are seen from 45 degrees and face lights 15 to 75 degrees high.
std::vector<LitPlace> litPlaces(const Shape& shape, const Marcher& map, uint64_t rays) {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> unit(0, 1);
    std::vector<LitPlace> places;
    for (uint64_t i = 0; i < rays; ++i) {
        LitPlace place;
        place.origin = {unit(random), unit(random) * shape.extent().y, shape.extent().z};
        place.direction = -directionOf(45, 2 * std::numbers::pi * unit(random));
        place.light = directionOf(15 + 60 * unit(random), 2 * std::numbers::pi * unit(random));
        const TruthHit seen = shape.trace(place.origin, place.direction, 64);
        if (!seen.hit || !seen.resolved || glm::dot(seen.normal, place.light) < kLeastCosine) continue;
        place.at = place.origin + seen.t * place.direction, place.normal = seen.normal;
        const TruthHit shadow = shape.trace(place.at + kFromSurface * seen.normal, place.light, 64);
        if (!shadow.resolved) continue;
        place.isDark = shadow.hit;
        if (const MarchResult found = map.march({place.origin, place.direction}); found.state == MarchState::Hit)
            place.mapped = found;
        places.push_back(place);
    }
    return places;
}

/// Counts what a marcher makes of shadows from so far above the places.
MesoShadows counted(const std::vector<LitPlace>& places, const Marcher& marcher, double offset, bool ownHits) {
    MesoShadows made;
    double dark = 0, lit = 0;
    for (const LitPlace& place : places) {
        dvec3 at = place.at, normal = place.normal;
        if (ownHits) {
            if (!place.mapped || place.mapped->normal == glm::vec3(0)) continue;
            at = place.origin + double(place.mapped->t) * place.direction, normal = place.mapped->normal;
        }
        const bool isDark = marcher.march({at + offset * normal, place.light}).state == MarchState::Hit;
        (place.isDark ? dark : lit) += 1;
        made.leak += place.isDark && !isDark, made.acne += !place.isDark && isDark;
    }
    made.places = uint64_t(dark + lit), made.dark = made.places > 0 ? dark / (dark + lit) : 0;
    for (double* part : {&made.leak, &made.acne}) *part /= std::max(1.0, dark + lit);
    return made;
}

}  // namespace

Result<std::vector<MesoShadows>> compareMesoShadows(const Asset& asset, const Shape& shape, uint64_t rays,
                                                    const std::function<bool(double)>& progress) {
    std::vector<MesoShadows> all;
    const auto shared = [&](size_t count, const std::function<void(size_t, size_t)>& fill) {
        return shareOut(count, fill, [&](double part) { return !progress || progress(part); });
    };
    // Both maps are of the same distances.
    VCP_TRY_ASSIGN(const auto table, traceTable(asset, shape, tracedBy(shape, {.name = "gdm", .shareOut = shared})));
    for (const char* name : {"gdm", "gdm-visibility"}) {
        VCP_TRY_ASSIGN(const auto method, buildMethod(asset, shape, {.name = name, .table = &table}));
        VCP_TRY_ASSIGN(const auto marcher, method.marcher());
        const std::vector<LitPlace> places = litPlaces(shape, *marcher, rays);
        const double point = shape.extent().x / method.gdm->properties.points.x;
        for (const bool ownHits : {false, true})
            for (const double offset : kOffsets) {
                MesoShadows made = counted(places, *marcher, offset * point, ownHits);
                made.asset = asset.name, made.method = name, made.offsetPoints = offset, made.ownHits = ownHits;
                all.push_back(made);
            }
    }
    // Octant boxes, from as far above as they are drawn: what any marcher of samples leaves.
    VCP_TRY_ASSIGN(const auto method, buildMethod(asset, shape, {.name = "boxes"}));
    VCP_TRY_ASSIGN(const auto marcher, method.marcher());
    const std::vector<LitPlace> places = litPlaces(shape, *marcher, rays);
    VCP_TRY_ASSIGN(const auto arrays, method.arrays());
    for (const bool ownHits : {false, true}) {
        MesoShadows made = counted(places, *marcher, shadowLift(arrays, 1), ownHits);
        made.asset = asset.name, made.method = "boxes", made.ownHits = ownHits;
        made.offsetPoints = shadowLift(arrays, 1) * arrays.record.fine.x;
        all.push_back(made);
    }
    return all;
}

}  // namespace vcp
