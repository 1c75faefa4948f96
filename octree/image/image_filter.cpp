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

/// What is looked up for every texel and every colour.
class ColourTables {
public:
    static const ColourTables& get() {
        static const ColourTables tables;
        return tables;
    }
    [[nodiscard]] float lightOf(uint32_t byte) const { return lightOfByte_[byte]; }
    /// linearToSrgb of 0 to 1, to within 10^-4.
    [[nodiscard]] float storedOf(float light) const {
        const float at = std::sqrt(std::clamp(light, 0.0f, 1.0f)) * kRoots;
        const auto below = size_t(at);
        return storedOfRoot_[below] + (at - float(below)) * (storedOfRoot_[below + 1] - storedOfRoot_[below]);
    }

private:
    ColourTables() {
        for (size_t i = 0; i < lightOfByte_.size(); ++i) lightOfByte_[i] = srgbToLinear(float(i) / 255);
        for (size_t i = 0; i < storedOfRoot_.size(); ++i) {
            const float root = float(i) / kRoots;
            storedOfRoot_[i] = linearToSrgb(root * root);
        }
    }

    static constexpr int kRoots = 1024;
    std::array<float, 256> lightOfByte_{};
    std::array<float, kRoots + 2>
        storedOfRoot_{};  // by the root of light, of which stored values are nearly a multiple
};

/// Adds a texel's light, weighted by its alpha.
void add(const ColourTables& tables, glm::vec4& sum, uint32_t texel, float weight) {
    const float alpha = weight * (texel >> 24 == 255 ? 1.0f : float(texel >> 24) / 255);
    sum += alpha * glm::vec4(tables.lightOf(texel & 255u), tables.lightOf(texel >> 8 & 255u),
                             tables.lightOf(texel >> 16 & 255u), 1);
}

/// Returns the texels that are shown at a place of a row and after it.
glm::ivec2 pairOf(int at, int size, uint32_t wrap) {
    if (at >= 0 && at + 1 < size) return {at, at + 1};
    return {f32::wrappedTexel(at, size, wrap), f32::wrappedTexel(at + 1, size, wrap)};
}

/// Adds what a level shows at a point, between four texels.
void addBilinear(glm::vec4& sum, const ImageSet& set, const ImageSet::Level& level, ImageWraps wraps, glm::vec2 at,
                 float weight) {
    const int width = int(level.width), height = int(level.height);
    const float x = at.x * float(width) - 0.5f, y = at.y * float(height) - 0.5f;
    const float left = std::floor(x), top = std::floor(y);
    const float fx = x - left, fy = y - top;
    const int column = int(left), row = int(top);
    const glm::ivec2 columns = pairOf(column, width, wraps.u), rows = pairOf(row, height, wraps.v);
    const uint32_t* const texels = set.texelsOf(level);
    const ColourTables& tables = ColourTables::get();
    for (int j = 0; j < 2; ++j) {
        const uint32_t* const line = texels + size_t(rows[j]) * size_t(width);
        const float share = weight * (j == 0 ? 1 - fy : fy);
        add(tables, sum, line[columns[0]], share * (1 - fx));
        add(tables, sum, line[columns[1]], share * fx);
    }
}

}  // namespace

ImagePlaces placesOf(const ImageSet::Image& image, const f32::ImageFootprint& footprint) {
    ImagePlaces places{.count = f32::footprintPlaces(footprint), .along = footprint.along};
    const float last = float(image.levels.size() - 1);
    const float level = std::clamp(f32::footprintLevel(footprint, places.count) - float(image.finest), 0.0f, last);
    places.finer = size_t(level);
    places.coarser = level - float(places.finer);
    return places;
}

glm::vec4 filteredColour(const ImageSet& set, const ImageSet::Image& image, ImageWraps wraps, glm::vec2 at,
                         const ImagePlaces& places) {
    const float part = 1 / float(places.count);
    glm::vec4 sum(0);
    for (int i = 0; i < places.count; ++i) {
        const glm::vec2 place = at + ((float(i) + 0.5f) * part - 0.5f) * places.along;
        addBilinear(sum, set, image.levels[places.finer], wraps, place, (1 - places.coarser) * part);
        if (places.coarser > 0)
            addBilinear(sum, set, image.levels[places.finer + 1], wraps, place, places.coarser * part);
    }
    if (!(sum.w > 0)) return glm::vec4(0);
    const ColourTables& tables = ColourTables::get();
    return {tables.storedOf(sum.x / sum.w), tables.storedOf(sum.y / sum.w), tables.storedOf(sum.z / sum.w), sum.w};
}

}  // namespace vcp
