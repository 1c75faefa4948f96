#include "builder/texture/texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "builder/stream/colour_encoding.h"

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

// Returns a texel's number inside 0..size-1. Any finite number of a float fits into int64_t after the clamp.
uint32_t wrapped(double texel, uint32_t size, Wrap wrap) {
    const double edge = size;
    if (wrap == Wrap::Clamp) return uint32_t(std::clamp(texel, 0.0, edge - 1));
    const double period = wrap == Wrap::Mirror ? 2 * edge : edge;
    double inside = texel - std::floor(texel / period) * period;
    if (wrap == Wrap::Mirror && inside >= edge) inside = period - 1 - inside;
    return uint32_t(std::clamp(inside, 0.0, edge - 1));
}

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
    Light sum{};
    for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 2; ++i) {
            const uint32_t column = wrapped(left + i, level.width, wrapU_),
                           row = wrapped(top + j, level.height, wrapV_);
            add(sum, level.texels[size_t{row} * level.width + column], (i ? fx : 1 - fx) * (j ? fy : 1 - fy));
        }
    return sum;
}

Rgba8 Texture::sample(glm::vec2 uv, float footprint) const {
    const double texels = double(footprint) * std::max(levels_[0].width, levels_[0].height);
    const double coarsest = double(levels_.size() - 1);
    const double level = texels > 1 ? std::min(std::log2(texels), coarsest) : 0;
    const auto finer = size_t(level);
    const double share = level - double(finer);
    Light sum{};
    add(sum, bilinear(levels_[finer], uv), 1 - share);
    if (share > 0) add(sum, bilinear(levels_[finer + 1], uv), share);
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
