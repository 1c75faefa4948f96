// Texture: an image with a mip chain, sampled with filters; and the textures of a mesh's materials, in bounded memory.
//
// Texels are averaged as level_bands.h says. Sampling is trilinear (Williams 1983); where a footprint is longer than
// wide, at several places along it (McCormack et al. 1999, "Feline").
#pragma once

#include <array>
#include <cstdint>
#include <list>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "builder/stream/material.h"
#include "builder/texture/image.h"
#include "octree/io/result.h"

namespace vcp {

/// Over how much of a texture a sample is averaged: an ellipse about it, by the squares of its axes, as a symmetric
/// matrix in texture coordinates. All 0: the finest texels.
struct TextureFootprint {
    double uu = 0, uv = 0, vv = 0;

    /// As wide in all directions.
    static TextureFootprint round(double width) { return {width * width, 0, width * width}; }
    /// Returns that of the sample which says a corner's colour in one triangle; kCornerWidth edges wide where these are
    /// equal.
    /// The order of the corners does not matter.
    static TextureFootprint ofCorner(const glm::vec2 (&uv)[3]);
};

/// Where corners alone have colours, each stands for what is nearer to it than to others. A triangle samples its corner
/// `i` in the middle of its own half next to it, so that nothing beyond its edges is taken: an atlas has other things
/// there. The mean over the triangles about a corner is then centred there, and about an edge wide.
glm::vec2 placeOfCorner(const glm::vec2 (&uv)[3], int i);
inline constexpr double kCornerWidth = 0.3;

class Texture {
public:
    /// Makes a texture of one white texel.
    Texture();
    explicit Texture(Image image, Wrap wrapU = Wrap::Repeat, Wrap wrapV = Wrap::Repeat);

    /// The most texels that are kept: an image that has more is halved until it has no more. That is not for lack of
    /// memory, so that colours do not depend on it.
    static constexpr uint64_t kMostTexels = uint64_t{4096} * 4096;
    /// Reads an image that was opened, row by row. Uses the calling arena's threads. Errors: as ImageRows::read().
    static Result<Texture> read(ImageRows& image, Wrap wrapU = Wrap::Repeat, Wrap wrapV = Wrap::Repeat);
    /// Returns the bytes() of what read() makes of an image of this size.
    static uint64_t bytesOf(glm::uvec2 size);

    /// Returns the colour at `uv` ((0, 0): upper left corner, v downwards; finite), averaged over a footprint in the
    /// same units. Any thread.
    [[nodiscard]] Rgba8 sample(glm::vec2 uv, const TextureFootprint& footprint) const;

    [[nodiscard]] glm::uvec2 size() const { return {levels_[0].width, levels_[0].height}; }
    [[nodiscard]] uint64_t bytes() const;
    /// The mip chain, the finest level that is kept first, down to a single texel.
    [[nodiscard]] std::span<const Image> levels() const { return levels_; }

private:
    Texture(std::vector<Image> levels, Wrap wrapU, Wrap wrapV)
        : levels_(std::move(levels)), wrapU_(wrapU), wrapV_(wrapV) {}

    /// Light and alpha, each texel weighted by its alpha.
    [[nodiscard]] std::array<double, 4> trilinear(glm::dvec2 uv, double texels) const;
    [[nodiscard]] std::array<double, 4> bilinear(const Image& level, glm::dvec2 uv) const;

    std::vector<Image> levels_;  // the finest comes first
    Wrap wrapU_;
    Wrap wrapV_;
};

/// The textures of a mesh, loaded when they are first asked for; those least recently used go before another would pass
/// the memory limit. One that passes it alone is the only one. One thread at a time.
class TextureCache {
public:
    explicit TextureCache(uint64_t memoryBytes, ImageLimits limits = {}) : memoryBytes_(memoryBytes), limits_(limits) {}

    /// Returns the texture of `materials[number]`, valid until the next call; nullptr where it has none, or where it
    /// cannot be read, which becomes one warning.
    const Texture* textureOf(std::span<const Material> materials, uint32_t number);

    [[nodiscard]] std::span<const std::string> warnings() const { return warnings_; }
    [[nodiscard]] uint64_t bytes() const { return bytes_; }

private:
    Result<Texture> load(const Material& material);
    void makeRoom(uint64_t bytes);

    struct Loaded {
        uint32_t material;
        Texture texture;
    };

    uint64_t memoryBytes_;
    ImageLimits limits_;
    uint64_t bytes_ = 0;
    std::list<Loaded> loaded_;  // the one used last comes first
    std::map<uint32_t, std::list<Loaded>::iterator> byMaterial_;
    std::map<uint32_t, bool> broken_;
    std::vector<std::string> warnings_;
};

}  // namespace vcp
