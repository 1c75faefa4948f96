#include "builder/texture/material_colours.h"

#include <algorithm>

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

}  // namespace vcp
