#include "builder/texture/material_colours.h"

#include <algorithm>

#include "builder/stream/colour_encoding.h"

namespace vcp {

bool MaterialColours::hasImages() const {
    return std::any_of(materials_.begin(), materials_.end(),
                       [](const Material& material) { return material.image.exists(); });
}

Rgba8 MaterialColours::at(uint32_t material, glm::vec2 uv, const TextureFootprint& footprint) {
    if (material == 0) return kWhite;
    const Material& m = materials_[material - 1];
    if (!m.image.exists()) return m.factor;
    const std::scoped_lock lock(mutex_);
    const Texture* texture = textures_.textureOf(materials_, material - 1);
    return texture ? modulate(m.factor, texture->sample(uv, footprint)) : m.factor;
}

}  // namespace vcp
