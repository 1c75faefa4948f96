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
    /// The light of a texel's red, green and blue.
    [[nodiscard]] glm::vec3 lightOf(uint32_t texel) const {
        return {lightOfByte_[texel & 255u], lightOfByte_[texel >> 8 & 255u], lightOfByte_[texel >> 16 & 255u]};
    }
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
    // By the root of light, of which stored values are nearly a multiple.
    std::array<float, kRoots + 2> storedOfRoot_{};
};

/// Adds the light of four texels, weighted by their alpha.
void add(const ColourTables& tables, glm::vec4& sum, const uint32_t (&texels)[4], const float (&weights)[4]) {
    float share[4] = {weights[0], weights[1], weights[2], weights[3]};
    // Most texels hide all that is behind them.
    if ((texels[0] & texels[1] & texels[2] & texels[3]) >> 24 != 255)
        for (int i = 0; i < 4; ++i) share[i] *= float(texels[i] >> 24) / 255;
    const glm::vec3 light = (share[0] * tables.lightOf(texels[0]) + share[1] * tables.lightOf(texels[1])) +
                            (share[2] * tables.lightOf(texels[2]) + share[3] * tables.lightOf(texels[3]));
    sum += glm::vec4(light, (share[0] + share[1]) + (share[2] + share[3]));
}

/// Returns the texels that are shown at a place of a row and after it.
inline glm::ivec2 pairOf(int at, int size, uint32_t wrap) {
    if (at >= 0 && at + 1 < size) [[likely]]
        return {at, at + 1};
    return {f32::wrappedTexel(at, size, wrap), f32::wrappedTexel(at + 1, size, wrap)};
}

/// Returns the largest whole number that is not above `x`; |x| < 2^31. (std::floor is a call on old processors.)
int wholeBelow(float x) {
    const int whole = int(x);
    return whole - (float(whole) > x ? 1 : 0);
}

/// Four texels about a point, and how far it is from the first towards the others.
struct Quad {
    uint32_t texels[4];
    float fx, fy;
};

/// Finds those of a level; nothing where not all of their tiles are in memory.
inline bool findQuad(const ImageSet::Level& level, ImageWraps wraps, glm::vec2 at, Quad& quad) {
    const int width = int(level.width), height = int(level.height);
    const float x = f32::boundedPlace(at.x * float(width) - 0.5f), y = f32::boundedPlace(at.y * float(height) - 0.5f);
    const int column = wholeBelow(x), row = wholeBelow(y);
    quad.fx = x - float(column), quad.fy = y - float(row);
    const glm::uvec2 columns(pairOf(column, width, wraps.u)), rows(pairOf(row, height, wraps.v));
    const uint32_t* const first = level.tileOf(columns[0], rows[0]);
    if (first == nullptr) return false;
    if (columns[0] >> level.log2Edge == columns[1] >> level.log2Edge &&
        rows[0] >> level.log2Edge == rows[1] >> level.log2Edge) [[likely]] {
        for (int i = 0; i < 4; ++i) quad.texels[i] = first[level.placeInTile(columns[i & 1], rows[i >> 1])];
        return true;
    }
    for (int i = 0; i < 4; ++i) {
        const uint32_t* const tile = level.tileOf(columns[i & 1], rows[i >> 1]);
        if (tile == nullptr) return false;
        quad.texels[i] = tile[level.placeInTile(columns[i & 1], rows[i >> 1])];
    }
    return true;
}

/// Adds what a level shows at a point, between four texels, or the next coarser one that is in memory there.
void addBilinear(const ColourTables& tables, glm::vec4& sum, const ImageSet::Image& image, size_t level,
                 ImageWraps wraps, glm::vec2 at, float weight) {
    Quad quad;
    while (!findQuad(image.levels[level], wraps, at, quad)) ++level;
    add(tables, sum, quad.texels,
        {weight * (1 - quad.fy) * (1 - quad.fx), weight * (1 - quad.fy) * quad.fx, weight * quad.fy * (1 - quad.fx),
         weight * quad.fy * quad.fx});
}

}  // namespace

glm::vec4 filteredColour(const ImageSet::Image& image, ImageWraps wraps, glm::vec2 at, const ImagePlaces& places) {
    const ColourTables& tables = ColourTables::get();
    const float part = 1 / float(places.count);
    const size_t finer = image.finest + size_t(places.finer);
    glm::vec4 sum(0);
    for (int i = 0; i < places.count; ++i) {
        const glm::vec2 place = at + ((float(i) + 0.5f) * part - 0.5f) * places.along;
        addBilinear(tables, sum, image, finer, wraps, place, (1 - places.coarser) * part);
        if (places.coarser > 0) addBilinear(tables, sum, image, finer + 1, wraps, place, places.coarser * part);
    }
    if (!(sum.w > 0)) return glm::vec4(0);
    const float scale = 1 / sum.w;
    return {tables.storedOf(sum.x * scale), tables.storedOf(sum.y * scale), tables.storedOf(sum.z * scale), sum.w};
}

}  // namespace vcp
