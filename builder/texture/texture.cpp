#include "builder/texture/texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "builder/stream/colour_encoding.h"
#include "builder/texture/texel_wrap.h"

namespace vcp {
namespace {

using Light = std::array<double, 4>;

// Adds a texel's linear colour, weighted by its alpha.
void add(Light& sum, Rgba8 texel, double weight) {
    const auto& table = lightOfByte();
    const double alpha = weight * (texel >> 24) / 255;
    for (int c = 0; c < 3; ++c) sum[size_t(c)] += alpha * table[texel >> (8 * c) & 0xFF];
    sum[3] += alpha;
}

void add(Light& sum, const Light& other, double weight) {
    for (size_t c = 0; c < 4; ++c) sum[c] += weight * other[c];
}

// Encodes a sum of weights 1 as it is stored; colour without alpha does not matter.
Rgba8 encoded(const Light& sum) {
    if (!(sum[3] > 0)) return 0;
    return encodeRgba({sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3], sum[3]});
}

// Which of the `size` finer texels one texel of half as many covers.
struct Span {
    uint32_t first;
    std::array<double, 3> weights;  // weights of up to three texels; their sum is 1
};

Span coverage(uint32_t coarse, uint32_t coarseSize, uint32_t size) {
    const double step = double(size) / coarseSize;
    const double begin = coarse * step, end = (coarse + 1) * step;
    Span span{std::min(uint32_t(begin), size - 1), {}};
    for (uint32_t i = 0; i < 3 && span.first + i < size; ++i) {
        const double covered = std::min(end, double(span.first + i + 1)) - std::max(begin, double(span.first + i));
        span.weights[i] = std::max(covered, 0.0) / step;
    }
    return span;
}

Image halved(const Image& fine) {
    Image coarse{std::max(fine.width / 2, 1u), std::max(fine.height / 2, 1u), {}};
    coarse.texels.reserve(size_t{coarse.width} * coarse.height);
    for (uint32_t y = 0; y < coarse.height; ++y) {
        const Span rows = coverage(y, coarse.height, fine.height);
        for (uint32_t x = 0; x < coarse.width; ++x) {
            const Span columns = coverage(x, coarse.width, fine.width);
            Light sum{};
            for (uint32_t j = 0; j < 3; ++j)
                for (uint32_t i = 0; i < 3; ++i)
                    if (const double weight = rows.weights[j] * columns.weights[i]; weight > 0)
                        add(sum, fine.texels[size_t{rows.first + j} * fine.width + columns.first + i], weight);
            coarse.texels.push_back(encoded(sum));
        }
    }
    return coarse;
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

}  // namespace

Texture::Texture() : Texture(Image{1, 1, {kWhite}}) {}

Texture::Texture(Image image, Wrap wrapU, Wrap wrapV) : wrapU_(wrapU), wrapV_(wrapV) {
    levels_.push_back(std::move(image));
    while (levels_.back().width > 1 || levels_.back().height > 1) levels_.push_back(halved(levels_.back()));
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
        for (int i = 0; i < 2; ++i) add(sum, row[columns[i]], (i ? fx : 1 - fx) * (j ? fy : 1 - fy));
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
    return encoded(sum);
}

const Texture* TextureCache::textureOf(std::span<const Material> materials, uint32_t number) {
    if (number >= materials.size() || !materials[number].image.exists() || broken_.contains(number)) return nullptr;
    if (const auto found = byMaterial_.find(number); found != byMaterial_.end()) {
        loaded_.splice(loaded_.begin(), loaded_, found->second);
        return &loaded_.front().texture;
    }
    const Material& material = materials[number];
    auto image = loadImage(material.image, limits_);
    if (!image) {
        broken_[number] = true;
        warnings_.push_back(image.error().line() + "; material '" + material.name + "' has no texture");
        return nullptr;
    }
    if (material.ignoresAlpha) ignoreAlpha(*image);
    loaded_.push_front({number, Texture(*std::move(image), material.wrapU, material.wrapV)});
    byMaterial_[number] = loaded_.begin();
    bytes_ += loaded_.front().texture.bytes();
    while (bytes_ > memoryBytes_ && loaded_.size() > 1) {
        bytes_ -= loaded_.back().texture.bytes();
        byMaterial_.erase(loaded_.back().material);
        loaded_.pop_back();
    }
    return &loaded_.front().texture;
}

}  // namespace vcp
