#include "builder/texture/texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "builder/texture/level_bands.h"
#include "builder/texture/texel_light.h"
#include "builder/texture/texel_wrap.h"

namespace vcp {
namespace {

using Light = TexelLight;

void add(Light& sum, const Light& other, double weight) {
    for (size_t c = 0; c < 4; ++c) sum[c] += weight * other[c];
}

// A footprint in texels of the finest level.
struct Ellipse {
    double length, width;
    glm::dvec2 along;  // its length as a step of texture coordinates
};

Ellipse ellipseOf(const TextureFootprint& footprint, const Image& finest) {
    const double w = finest.width, h = finest.height;
    const double xx = footprint.uu * w * w, xy = footprint.uv * w * h, yy = footprint.vv * h * h;
    const double mean = (xx + yy) / 2, apart = std::hypot((xx - yy) / 2, xy);
    const double length = std::sqrt(mean + apart), width = std::sqrt(std::max(mean - apart, 0.0));
    // There are two ways to write the direction; this one does not cancel.
    glm::dvec2 direction = xx > yy ? glm::dvec2((xx - yy) / 2 + apart, xy) : glm::dvec2(xy, (yy - xx) / 2 + apart);
    const double size = std::hypot(direction.x, direction.y);
    direction = size > 0 ? direction / size : glm::dvec2(0);
    return {length, width, {direction.x * length / w, direction.y * length / h}};
}

constexpr int kMostPlaces = 16;  // along a footprint; longer ones are taken as wider

uint64_t texelsOf(glm::uvec2 size) { return uint64_t{size.x} * size.y; }

}  // namespace

Texture::Texture() : Texture(Image{1, 1, {kWhite}}) {}

Texture::Texture(Image image, Wrap wrapU, Wrap wrapV) : wrapU_(wrapU), wrapV_(wrapV) {
    levels_.push_back(std::move(image));
    while (levels_.back().width > 1 || levels_.back().height > 1) {
        const Image& fine = levels_.back();
        const glm::uvec2 size = halvedSize({fine.width, fine.height});
        Image coarse{size.x, size.y, std::vector<Rgba8>(size_t{size.x} * size.y)};
        halveRows(fine.texels, 0, {fine.width, fine.height}, coarse.texels, 0);
        levels_.push_back(std::move(coarse));
    }
}

Result<Texture> Texture::read(ImageRows& image, Wrap wrapU, Wrap wrapV) {
    Texture texture(std::vector<Image>(), wrapU, wrapV);
    size_t finest = 0;
    glm::uvec2 size = image.size();
    for (; texelsOf(size) > kMostTexels; size = halvedSize(size)) ++finest;
    const auto take = [&](size_t level, uint32_t, std::span<const Rgba8> texels) -> Result<void> {
        if (level < finest) return {};
        for (; texture.levels_.size() <= level - finest; size = halvedSize(size)) {
            texture.levels_.push_back({size.x, size.y, {}});
            texture.levels_.back().texels.reserve(texelsOf(size));
        }
        std::vector<Rgba8>& to = texture.levels_[level - finest].texels;
        to.insert(to.end(), texels.begin(), texels.end());
        return {};
    };
    VCP_TRY(readLevels(image, take));
    return texture;
}

uint64_t Texture::bytesOf(glm::uvec2 size) {
    while (texelsOf(size) > kMostTexels) size = halvedSize(size);
    uint64_t bytes = 0;
    for (;; size = halvedSize(size)) {
        bytes += texelsOf(size) * sizeof(Rgba8);
        if (size == glm::uvec2(1)) return bytes;
    }
}

uint64_t Texture::bytes() const {
    uint64_t bytes = 0;
    for (const Image& level : levels_) bytes += level.texels.size() * sizeof(Rgba8);
    return bytes;
}

std::array<double, 4> Texture::bilinear(const Image& level, glm::dvec2 uv) const {
    const double x = uv.x * level.width - 0.5, y = uv.y * level.height - 0.5;
    const double left = std::floor(x), top = std::floor(y);
    const double fx = x - left, fy = y - top;
    const uint32_t columns[2] = {wrappedTexel(left, level.width, wrapU_), wrappedTexel(left + 1, level.width, wrapU_)};
    Light sum{};
    for (int j = 0; j < 2; ++j) {
        const Rgba8* row = &level.texels[size_t{wrappedTexel(top + j, level.height, wrapV_)} * level.width];
        for (int i = 0; i < 2; ++i) addTexel(sum, row[columns[i]], (i ? fx : 1 - fx) * (j ? fy : 1 - fy));
    }
    return sum;
}

Light Texture::trilinear(glm::dvec2 uv, double texels) const {
    const double coarsest = double(levels_.size() - 1);
    const double level = texels > 1 ? std::min(std::log2(texels), coarsest) : 0;
    const auto finer = size_t(level);
    const double share = level - double(finer);
    Light sum{};
    add(sum, bilinear(levels_[finer], uv), 1 - share);
    if (share > 0) add(sum, bilinear(levels_[finer + 1], uv), share);
    return sum;
}

TextureFootprint TextureFootprint::ofCorner(const glm::vec2 (&uv)[3]) {
    TextureFootprint sum;
    for (int i = 0; i < 3; ++i) {
        const glm::dvec2 edge = glm::dvec2(uv[(i + 1) % 3]) - glm::dvec2(uv[i]);
        sum.uu += edge.x * edge.x;
        sum.uv += edge.x * edge.y;
        sum.vv += edge.y * edge.y;
    }
    // The squares of an equilateral triangle's edges sum up to 3/2 in each direction.
    const double scale = kCornerWidth * kCornerWidth / 1.5;
    return {scale * sum.uu, scale * sum.uv, scale * sum.vv};
}

glm::vec2 placeOfCorner(const glm::vec2 (&uv)[3], int i) {
    return uv[i] + ((uv[(i + 1) % 3] - uv[i]) + (uv[(i + 2) % 3] - uv[i])) / 6.0f;
}

Rgba8 Texture::sample(glm::vec2 uv, const TextureFootprint& footprint) const {
    const Ellipse ellipse = ellipseOf(footprint, levels_[0]);
    const double ratio = std::round(ellipse.length / std::max(ellipse.width, 1.0));
    const int places = ratio > 1 ? int(std::min(ratio, double(kMostPlaces))) : 1;
    Light sum{};
    for (int i = 0; i < places; ++i)
        add(sum,
            trilinear(glm::dvec2(uv) + ellipse.along * ((i + 0.5) / places - 0.5),
                      std::max(ellipse.width, ellipse.length / places)),
            1.0 / places);
    return encodedTexel(sum);
}

const Texture* TextureCache::textureOf(std::span<const Material> materials, uint32_t number) {
    if (number >= materials.size() || !materials[number].image.exists() || broken_.contains(number)) return nullptr;
    if (const auto found = byMaterial_.find(number); found != byMaterial_.end()) {
        loaded_.splice(loaded_.begin(), loaded_, found->second);
        return &loaded_.front().texture;
    }
    auto texture = load(materials[number]);
    if (!texture) {
        broken_[number] = true;
        warnings_.push_back(texture.error().line() + "; material '" + materials[number].name + "' has no texture");
        return nullptr;
    }
    loaded_.push_front({number, *std::move(texture)});
    byMaterial_[number] = loaded_.begin();
    bytes_ += loaded_.front().texture.bytes();
    return &loaded_.front().texture;
}

Result<Texture> TextureCache::load(const Material& material) {
    VCP_TRY_ASSIGN(const auto image, openImage(material, limits_));
    makeRoom(Texture::bytesOf(image->size()));
    auto texture = Texture::read(*image, material.wrapU, material.wrapV);
    if (!texture) return namedImageError(material.image, texture.error());
    return texture;
}

void TextureCache::makeRoom(uint64_t bytes) {
    while (bytes_ + bytes > memoryBytes_ && !loaded_.empty()) {
        bytes_ -= loaded_.back().texture.bytes();
        byMaterial_.erase(loaded_.back().material);
        loaded_.pop_back();
    }
}

}  // namespace vcp
