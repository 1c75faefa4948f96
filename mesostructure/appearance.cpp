#include "mesostructure/appearance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "mesostructure/tile_paths.h"

namespace vcp::meso {

namespace {

using glm::dvec2, glm::dvec3, std::numbers::pi;

constexpr int kShadowRays = 2;
constexpr double kShadowLift = 1e-4;  // by which shadow rays start above a hit, tile units
using NineHarmonics = std::array<double, 9>;

/// Real spherical harmonics of bands 0 to 2: 1; x, y, z; xy, yz, xz, 3 z^2 - 1; x^2 - y^2.
NineHarmonics harmonicsOf(dvec3 d) {
    return {0.282095,
            0.488603 * d.x,
            0.488603 * d.y,
            0.488603 * d.z,
            1.092548 * d.x * d.y,
            1.092548 * d.y * d.z,
            1.092548 * d.x * d.z,
            0.315392 * (3 * d.z * d.z - 1),
            0.546274 * (d.x * d.x - d.y * d.y)};
}

/// Coefficient of a clamped cosine, by band.
double cosineBand(int i) { return i == 0 ? pi : i < 4 ? 2 * pi / 3 : pi / 4; }

/// The unit vector of a view.
dvec3 viewOf(uint32_t i, uint32_t j) {
    const double u = 2.0 * i / (Appearance::kViews - 1) - 1, v = 2.0 * j / (Appearance::kViews - 1) - 1,
                 x = (u + v) / 2, y = (u - v) / 2;
    const dvec3 d = glm::normalize(dvec3(x, y, 1 - std::abs(x) - std::abs(y)));
    return glm::normalize(dvec3(d.x, d.y, std::max(d.z, std::sin(pi / 60))));
}

class Caster {
public:
    Caster(const Shape& shape, double heightScale) : shape_(shape), extent_(shape.extent()), scale_(heightScale) {}

    struct Seen {
        dvec3 at, normal;  ///< place in tile space; normal in the world
        bool isBottom = false, isResolved = true;
    };
    /// Returns where the ray against `view` meets the slab's top at `place` of the tile.
    [[nodiscard]] Seen see(dvec3 view, dvec2 place) const {
        const dvec3 origin(place.x * extent_.x, place.y * extent_.y, extent_.z), d = inTile(-view);
        const double through = extent_.z / -d.z;
        const TruthHit hit = shape_.trace(origin, d, through);
        if (hit.hit)
            return {origin + hit.t * d, glm::normalize(dvec3(hit.normal.x, hit.normal.y, hit.normal.z / scale_)), false,
                    true};
        return {dvec3(origin.x + through * d.x, origin.y + through * d.y, 0), {0, 0, 1}, true, hit.resolved};
    }
    [[nodiscard]] bool isLit(const Seen& seen, dvec3 light) const {
        if (light.z <= 0) return false;
        const dvec3 d = inTile(light), origin = seen.at + kShadowLift * seen.normal;
        return origin.z >= extent_.z || !shape_.trace(origin, d, (extent_.z - origin.z) / d.z).hit;
    }

private:
    [[nodiscard]] dvec3 inTile(dvec3 world) const { return glm::normalize(dvec3(world.x, world.y, world.z / scale_)); }

    const Shape& shape_;
    dvec3 extent_;
    double scale_;
};

/// What one view shows: coefficients without and with shadows, the mean normal.
struct Sums {
    NineHarmonics plain{}, shadowed{};
    dvec3 normal{0};
    uint32_t count = 0, bottoms = 0;

    void add(const Caster& caster, const Caster::Seen& seen, uint64_t number) {
        if (!seen.isResolved) return;
        ++count, bottoms += seen.isBottom;
        normal += seen.normal;
        const NineHarmonics at = harmonicsOf(seen.normal);
        for (int i = 0; i < 9; ++i)
            plain[size_t(i)] += cosineBand(i) * at[size_t(i)], shadowed[size_t(i)] += cosineBand(i) * at[size_t(i)];
        // The light that shadows take is summed: it is less than what is left, so its noise is less.
        for (int k = 0; k < kShadowRays; ++k) {
            const dvec3 light = directionByCosine(seen.normal, evenPoint(number * kShadowRays + uint64_t(k)));
            if (caster.isLit(seen, light)) continue;
            const NineHarmonics lost = harmonicsOf(light);
            for (size_t i = 0; i < 9; ++i) shadowed[i] -= pi / kShadowRays * lost[i];
        }
    }
    void append(std::vector<glm::vec4>& texels) const {
        const double part = 1.0 / std::max(count, 1u);
        const dvec3 n = normal * part;
        for (const NineHarmonics* c : {&plain, &shadowed}) {
            const auto at = [&](size_t i) { return float((*c)[i] * part); };
            texels.emplace_back(at(0), at(1), at(2), at(3));
            texels.emplace_back(at(4), at(5), at(6), at(7));
            texels.emplace_back(at(8), float(n.x), float(n.y), float(n.z));
        }
    }
};

}  // namespace

Appearance appearanceOf(const Shape& shape, double heightScale, uint32_t rays) {
    const Caster caster(shape, heightScale);
    Appearance made;
    made.isOpaque = true;
    for (uint32_t j = 0; j < Appearance::kViews; ++j)
        for (uint32_t i = 0; i < Appearance::kViews; ++i) {
            Sums sums;
            for (uint64_t ray = 0; ray < rays; ++ray) sums.add(caster, caster.see(viewOf(i, j), evenPoint(ray)), ray);
            sums.append(made.texels);
            made.isOpaque = made.isOpaque && sums.bottoms == 0;
        }
    for (uint64_t ray = 0; ray < rays; ++ray) made.height += caster.see({0, 0, 1}, evenPoint(ray)).at.z / rays;
    return made;
}

double lightOf(const Appearance& appearance, glm::uvec2 view, glm::dvec3 light, bool withShadows) {
    const size_t first = Appearance::kTexels * (view.x + size_t{Appearance::kViews} * view.y) + (withShadows ? 3 : 0);
    const NineHarmonics at = harmonicsOf(light);
    double sum = 0;
    for (size_t i = 0; i < 9; ++i) sum += double(appearance.texels[first + i / 4][int(i % 4)]) * at[i];
    if (withShadows) sum = std::min(sum, std::max(light.z, 0.0) / viewOf(view.x, view.y).z);
    return std::max(sum, 0.0);
}

}  // namespace vcp::meso
