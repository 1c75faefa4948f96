#include "builder/texture/material_colours.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "builder/stream/colour_encoding.h"

namespace vcp {

bool MaterialColours::hasImages() const {
    return std::any_of(materials_.begin(), materials_.end(),
                       [](const Material& material) { return material.image.exists(); });
}

std::array<Rgba8, 3> MaterialColours::ofCorners(uint32_t material, const glm::vec2 (&uv)[3]) {
    if (material == 0) return {kWhite, kWhite, kWhite};
    const Material& m = materials_[material - 1];
    std::array<Rgba8, 3> colours{m.factor, m.factor, m.factor};
    if (!m.image.exists()) return colours;
    const TextureFootprint footprint = TextureFootprint::ofCorner(uv);
    const std::scoped_lock lock(mutex_);
    const Texture* texture = textures_.textureOf(materials_, material - 1);
    if (!texture) return colours;
    for (int i = 0; i < 3; ++i)
        colours[size_t(i)] = modulate(m.factor, texture->sample(placeOfCorner(uv, i), footprint));
    return colours;
}

namespace {

/// Calls visit(uv) at the middles of the similar triangles that a triangle consists of, with about a texel each.
template <class Visit>
void forEachPlace(const glm::vec2 (&uv)[3], glm::vec2 texels, const Visit& visit) {
    constexpr double kMostSteps = 8;
    const glm::vec2 second = uv[1] - uv[0], third = uv[2] - uv[0];
    const auto lengthOf = [&](glm::vec2 edge) { return double(glm::length(edge * texels)); };
    const double longest = std::max({lengthOf(second), lengthOf(third), lengthOf(third - second)});
    // What is not a number is one step.
    const int steps = longest > 1 ? int(std::ceil(std::min(longest, kMostSteps))) : 1;
    const auto at = [&](double i, double j) { visit(uv[0] + float(i / steps) * second + float(j / steps) * third); };
    for (int j = 0; j < steps; ++j)
        for (int i = 0; i < steps - j; ++i) {
            at(i + 1 / 3.0, j + 1 / 3.0);
            if (i + j + 1 < steps) at(i + 2 / 3.0, j + 2 / 3.0);
        }
}

}  // namespace

Tint MaterialColours::tintOf(uint32_t material, const glm::vec2 (&uv)[3]) {
    if (material == 0) return kUnknownTint;
    const Material& m = materials_[material - 1];
    const std::scoped_lock lock(mutex_);
    const Texture* texture = textures_.textureOf(materials_, material - 1);
    if (!texture) return kUnknownTint;
    TintMean mean;
    forEachPlace(uv, glm::vec2(texture->size()), [&](glm::vec2 place) {
        const Rgba8 texel = texture->texelAt(place);
        mean.add(okLabOfStored(modulate(m.factor, texel)), double(texel >> 24));
    });
    return mean.mean();
}

}  // namespace vcp
