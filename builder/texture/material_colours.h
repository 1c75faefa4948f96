// The colours that materials give to vertices.
#pragma once

#include <array>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "builder/stream/material.h"
#include "builder/texture/texture.h"

namespace vcp {

/// Colours of materials. Any thread may call.
class MaterialColours {
public:
    /// `textureBytes`: memory for images.
    MaterialColours(std::vector<Material> materials, uint64_t textureBytes)
        : materials_(std::move(materials)), textures_(textureBytes) {}

    [[nodiscard]] bool hasImages() const;
    /// Returns what `material` (numbered from 1; 0: white) gives the corners of a triangle with these texture
    /// coordinates (placeOfCorner).
    std::array<Rgba8, 3> ofCorners(uint32_t material, const glm::vec2 (&uv)[3]);
    /// Images that could not be read, one line each.
    [[nodiscard]] std::span<const std::string> warnings() const { return textures_.warnings(); }

private:
    std::vector<Material> materials_;
    std::mutex mutex_;
    TextureCache textures_;
};

}  // namespace vcp
