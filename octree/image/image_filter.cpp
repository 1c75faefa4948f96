#include "octree/image/image_filter.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace vcp {

namespace {

float srgbToLinear(float value) {
    return value <= 0.04045f ? value / 12.92f : std::pow((value + 0.055f) / 1.055f, 2.4f);
}
float linearToSrgb(float light) {
    return light <= 0.0031308f ? light * 12.92f : 1.055f * std::pow(light, 1 / 2.4f) - 0.055f;
}

const std::array<float, 256> kLightOfByte = [] {
    std::array<float, 256> light{};
    for (size_t i = 0; i < light.size(); ++i) light[i] = srgbToLinear(float(i) / 255);
    return light;
}();

// Stored values by the root of their light, of which they are nearly a multiple.
constexpr int kRoots = 1024;
const std::array<float, kRoots + 2> kStoredOfRoot = [] {
    std::array<float, kRoots + 2> stored{};
    for (size_t i = 0; i < stored.size(); ++i) {
        const float root = float(i) / kRoots;
        stored[i] = linearToSrgb(root * root);
    }
    return stored;
}();

/// linearToSrgb of 0 to 1, to within 10^-4.
float storedValue(float light) {
    const float at = std::sqrt(std::clamp(light, 0.0f, 1.0f)) * kRoots;
    const auto below = size_t(at);
    return kStoredOfRoot[below] + (at - float(below)) * (kStoredOfRoot[below + 1] - kStoredOfRoot[below]);
}

/// Adds a texel's light, weighted by its alpha.
void add(glm::vec4& sum, uint32_t texel, float weight) {
    const float alpha = weight * (texel >> 24 == 255 ? 1.0f : float(texel >> 24) / 255);
    sum += alpha *
           glm::vec4(kLightOfByte[texel & 255u], kLightOfByte[texel >> 8 & 255u], kLightOfByte[texel >> 16 & 255u], 1);
}

/// Adds what a level shows at a point, between four texels.
void addBilinear(glm::vec4& sum, const ImageSet& set, const ImageSet::Level& level, ImageWraps wraps, glm::vec2 at,
                 float weight) {
    const int width = int(level.width), height = int(level.height);
    const float x = at.x * float(width) - 0.5f, y = at.y * float(height) - 0.5f;
    const float left = std::floor(x), top = std::floor(y);
    const float fx = x - left, fy = y - top;
    const int column = int(left), row = int(top);
    const int columns[2] = {f32::wrappedTexel(column, width, wraps.u), f32::wrappedTexel(column + 1, width, wraps.u)};
    const int rows[2] = {f32::wrappedTexel(row, height, wraps.v), f32::wrappedTexel(row + 1, height, wraps.v)};
    const uint32_t* const texels = set.texelsOf(level);
    for (int j = 0; j < 2; ++j) {
        const uint32_t* const line = texels + size_t(rows[j]) * size_t(width);
        const float share = weight * (j == 0 ? 1 - fy : fy);
        add(sum, line[columns[0]], share * (1 - fx));
        add(sum, line[columns[1]], share * fx);
    }
}

}  // namespace

glm::vec4 filteredColour(const ImageSet& set, const ImageSet::Image& image, ImageWraps wraps, glm::vec2 at,
                         const f32::ImageFootprint& footprint) {
    const int places = f32::footprintPlaces(footprint);
    const float last = float(image.levels.size() - 1);
    const float level = std::clamp(f32::footprintLevel(footprint, places) - float(image.finest), 0.0f, last);
    const auto finer = size_t(level);
    const float share = level - float(finer);
    glm::vec4 sum(0);
    for (int i = 0; i < places; ++i) {
        const float step = (float(i) + 0.5f) / float(places);
        const glm::vec2 place = at + (step - 0.5f) * footprint.along;
        addBilinear(sum, set, image.levels[finer], wraps, place, (1 - share) / float(places));
        if (share > 0) addBilinear(sum, set, image.levels[finer + 1], wraps, place, share / float(places));
    }
    if (!(sum.w > 0)) return glm::vec4(0);
    return {storedValue(sum.x / sum.w), storedValue(sum.y / sum.w), storedValue(sum.z / sum.w), sum.w};
}

}  // namespace vcp
