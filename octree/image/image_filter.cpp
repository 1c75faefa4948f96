#include "octree/image/image_filter.h"

#include <algorithm>
#include <cmath>

namespace vcp {

namespace {

float srgbToLinear(float value) {
    return value <= 0.04045f ? value / 12.92f : std::pow((value + 0.055f) / 1.055f, 2.4f);
}
float linearToSrgb(float light) {
    return light <= 0.0031308f ? light * 12.92f : 1.055f * std::pow(light, 1 / 2.4f) - 0.055f;
}

/// The light of a texel's red, green and blue.
glm::vec3 lightOf(const float* lightOfByte, uint32_t texel) {
    return {lightOfByte[texel & 255u], lightOfByte[texel >> 8 & 255u], lightOfByte[texel >> 16 & 255u]};
}

/// linearToSrgb of 0 to 1.
float storedOf(const float* storedOfRoot, float light) {
    const float at = std::sqrt(std::clamp(light, 0.0f, 1.0f)) * ColourTables::kRoots;
    const auto below = size_t(at);
    return storedOfRoot[below] + (at - float(below)) * (storedOfRoot[below + 1] - storedOfRoot[below]);
}

/// Returns the weights of four texels by where the point is among them.
std::array<float, 4> weightsOf(const TexelQuad& quad) {
    return {(1 - quad.fy) * (1 - quad.fx), (1 - quad.fy) * quad.fx, quad.fy * (1 - quad.fx), quad.fy * quad.fx};
}

/// Calls visit(quad, weight) for what is read of an image about `at`.
template <class Visit>
void forEachQuad(const ImageSet::Image& image, ImageWraps wraps, glm::vec2 at, const ImagePlaces& places,
                 const Visit& visit) {
    const float part = 1 / places.count;
    const auto finer = size_t(places.level);
    const float coarser = places.level - float(finer);
    for (int i = 0; i < int(places.count); ++i) {
        const glm::vec2 place = at + ((float(i) + 0.5f) * part - 0.5f) * places.along;
        visit(texelsAround(image, finer, wraps, place), (1 - coarser) * part);
        if (coarser > 0) visit(texelsAround(image, finer + 1, wraps, place), coarser * part);
    }
}

/// Adds the light of four texels, weighted by their alpha, too.
void add(const float* lightOfByte, glm::vec4& sum, const TexelQuad& quad, float weight) {
    const auto weights = weightsOf(quad);
    for (int i = 0; i < 4; ++i) {
        const float share = weight * weights[size_t(i)] * float(quad.texels[i] >> 24) / 255;
        sum += glm::vec4(share * lightOf(lightOfByte, quad.texels[i]), share);
    }
}

}  // namespace

const ColourTables& ColourTables::get() {
    static const ColourTables tables;
    return tables;
}

ColourTables::ColourTables() {
    for (size_t i = 0; i < lightOfByte_.size(); ++i) lightOfByte_[i] = srgbToLinear(float(i) / 255);
    for (size_t i = 0; i < storedOfRoot_.size(); ++i) {
        const float root = float(i) / kRoots;
        storedOfRoot_[i] = linearToSrgb(root * root);
    }
}

TexelQuad texelsAround(const ImageSet::Image& image, size_t level, ImageWraps wraps, glm::vec2 at) {
    for (;; ++level) {
        const ImageSet::Level& of = image.levels[level];
        const float x = f32::boundedPlace(at.x * float(of.width) - 0.5f),
                    y = f32::boundedPlace(at.y * float(of.height) - 0.5f);
        const float column = std::floor(x), row = std::floor(y);
        TexelQuad quad;
        if (!findTexels(of, wraps, {int(column), int(row)}, quad)) continue;
        quad.fx = x - column, quad.fy = y - row;
        return quad;
    }
}

glm::vec4 filteredColour(const ImageSet::Image& image, ImageWraps wraps, glm::vec2 at, const ImagePlaces& places) {
    const float* const light = ColourTables::get().lightOfBytes();
    const float* const stored = ColourTables::get().storedOfRoots();
    glm::vec4 sum(0);
    forEachQuad(image, wraps, at, places, [&](const TexelQuad& quad, float weight) { add(light, sum, quad, weight); });
    if (!(sum.w > 0)) return glm::vec4(0);
    const float scale = 1 / sum.w;
    return {storedOf(stored, sum.x * scale), storedOf(stored, sum.y * scale), storedOf(stored, sum.z * scale), sum.w};
}

glm::vec3 filteredNumbers(const ImageSet::Image& image, ImageWraps wraps, glm::vec2 at, const ImagePlaces& places) {
    glm::vec3 sum(0);
    forEachQuad(image, wraps, at, places, [&](const TexelQuad& quad, float weight) {
        const auto weights = weightsOf(quad);
        for (size_t i = 0; i < 4; ++i)
            sum += weight * weights[i] *
                   glm::vec3(float(quad.texels[i] & 255u), float(quad.texels[i] >> 8 & 255u),
                             float(quad.texels[i] >> 16 & 255u));
    });
    return sum / 255.0f;
}

}  // namespace vcp
