// Reads images of a file with a filter (octree/shared/image_lookup.h), in linear light.
#pragma once

#include <array>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "octree/image/image_set.h"
#include "octree/surface/image_lookup.h"

namespace vcp {

/// How an image goes on beyond its edges.
struct ImageWraps {
    uint32_t u = f32::kWrapRepeat, v = f32::kWrapRepeat;
};

/// Returns the texels that are shown at a place of a row and after it.
inline glm::ivec2 pairOf(int at, int size, uint32_t wrap) {
    if (at >= 0 && at + 1 < size) [[likely]]
        return {at, at + 1};
    return {f32::wrappedTexel(at, size, wrap), f32::wrappedTexel(at + 1, size, wrap)};
}

using f32::ImagePlaces;
inline ImagePlaces placesOf(const ImageSet::Image& image, const f32::ImageFootprint& footprint) {
    return f32::imagePlaces(footprint, float(image.finest), float(image.levels.size() - 1));
}

/// What is looked up for every texel and every colour.
class ColourTables {
public:
    /// Parts of the roots of light, which stored values are nearly multiples of.
    static constexpr int kRoots = 1024;

    static const ColourTables& get();
    /// The light of a byte's stored value; 256.
    [[nodiscard]] const float* lightOfBytes() const { return lightOfByte_.data(); }
    /// Stored values by the root of light, in kRoots steps from 0 to 1, and one more. Between them they are linear to
    /// within 10^-4.
    [[nodiscard]] const float* storedOfRoots() const { return storedOfRoot_.data(); }

private:
    ColourTables();

    std::array<float, 256> lightOfByte_{};
    std::array<float, kRoots + 2> storedOfRoot_{};
};

/// Four texels about a point, row by row, and how far it is from the first towards the others.
struct TexelQuad {
    uint32_t texels[4];
    float fx = 0, fy = 0;
};

/// Finds the texels of a level that are shown at a column and a row and after them; false where not all of their tiles
/// are in memory.
inline bool findTexels(const ImageSet::Level& level, ImageWraps wraps, glm::ivec2 at, TexelQuad& quad) {
    const glm::uvec2 columns(pairOf(at.x, int(level.width), wraps.u)), rows(pairOf(at.y, int(level.height), wraps.v));
    const uint32_t* const first = level.tileOf(columns[0], rows[0]);
    if (first == nullptr) return false;
    if (columns[0] >> level.log2Edge == columns[1] >> level.log2Edge &&
        rows[0] >> level.log2Edge == rows[1] >> level.log2Edge) [[likely]] {
        const auto right = std::ptrdiff_t(columns[1]) - std::ptrdiff_t(columns[0]);
        const uint32_t* const texel = first + level.placeInTile(columns[0], rows[0]);
        const uint32_t* const below = first + level.placeInTile(columns[0], rows[1]);
        quad.texels[0] = texel[0], quad.texels[1] = texel[right];
        quad.texels[2] = below[0], quad.texels[3] = below[right];
        return true;
    }
    for (int i = 0; i < 4; ++i) {
        const uint32_t* const tile = level.tileOf(columns[i & 1], rows[i >> 1]);
        if (tile == nullptr) return false;
        quad.texels[i] = tile[level.placeInTile(columns[i & 1], rows[i >> 1])];
    }
    return true;
}

/// Returns the texels about a point of the finest level in memory there, from `level` on. Precondition: the image is
/// shown.
TexelQuad texelsAround(const ImageSet::Image& image, size_t level, ImageWraps wraps, glm::vec2 at);

/// Returns the mean over a footprint about `at`, in coordinates of the image ((0, 0): its upper left corner): encoded
/// for the screen and with alpha, 0 to 1. What is transparent lends no colour; where all is, it is 0. Any
/// numbers do: places more than 2^23 texels away, or that are no numbers, are taken for 0. Where a level's tiles are
/// not in memory, the next coarser one is read. Precondition: the image is shown. Any thread.
glm::vec4 filteredColour(const ImageSet::Image& image, ImageWraps wraps, glm::vec2 at, const ImagePlaces& places);

/// Returns the same mean of an image whose texels are numbers and no colours: of red, green and blue, 0 to 1.
glm::vec3 filteredNumbers(const ImageSet::Image& image, ImageWraps wraps, glm::vec2 at, const ImagePlaces& places);

}  // namespace vcp
