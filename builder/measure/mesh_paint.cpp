#include "builder/measure/mesh_paint.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "builder/stream/colour_encoding.h"

namespace vcp {

namespace {

glm::dvec3 lightOf(Rgba8 colour) {
    const auto& table = lightOfByte();
    return {table[colour & 255u], table[colour >> 8 & 255u], table[colour >> 16 & 255u]};
}

/// Returns the number of a texel that is shown at place `at` of a row of `size`, which goes on as `wrap` says.
uint32_t wrappedTexel(double at, uint32_t size, Wrap wrap) {
    const double count = size;
    if (wrap == Wrap::Clamp) return uint32_t(std::min(std::max(at, 0.0), count - 1));
    double place = std::fmod(at, wrap == Wrap::Mirror ? 2 * count : count);
    if (place < 0) place += wrap == Wrap::Mirror ? 2 * count : count;
    if (place >= count) place = wrap == Wrap::Mirror ? 2 * count - 1 - place : place - count;
    return uint32_t(std::min(std::max(place, 0.0), count - 1));
}

/// Returns a name of what an image is made of: it is decoded once for all materials that have it.
std::string keyOf(const Material& material) {
    const ImageSource& source = material.image;
    return (material.ignoresAlpha ? "opaque " : "with alpha ") +
           (source.bytes ? "bytes " + std::to_string(reinterpret_cast<uintptr_t>(source.bytes.get()))
                         : source.path.string());
}

uint64_t storedBytesOf(const ImageSource& source) {
    if (source.bytes) return source.bytes->size();
    std::error_code failed;
    const auto bytes = std::filesystem::file_size(source.path, failed);
    return failed ? 0 : bytes;
}

}  // namespace

void MeshPaint::add(size_t file, const MeshStream& stream, const MeshChunk& chunk) {
    if (file_ != file) {
        file_ = file;
        firstMaterial_ = materials_.size();
    }
    const auto known = stream.materials();
    for (size_t i = materials_.size() - firstMaterial_; i < known.size(); ++i) materials_.push_back(known[i]);

    // What a part of the mesh does not say is filled in once another part says it.
    if (!chunk.colours.empty()) {
        vertices_.resize(positions_, kWhite);
        vertices_.insert(vertices_.end(), chunk.colours.begin(), chunk.colours.end());
    } else if (!vertices_.empty()) {
        vertices_.resize(positions_ + chunk.positions.size(), kWhite);
    }
    positions_ += chunk.positions.size();
    if (!chunk.materials.empty()) {
        triangleMaterials_.resize(triangles_, kNoMaterial);
        uvs_.resize(triangles_);
        for (const uint32_t material : chunk.materials)
            triangleMaterials_.push_back(material == kNoMaterial ? kNoMaterial : uint32_t(firstMaterial_) + material);
        uvs_.insert(uvs_.end(), chunk.uvs.begin(), chunk.uvs.end());
    }
    triangles_ += chunk.triangles.size();
    if (!triangleMaterials_.empty()) {
        triangleMaterials_.resize(triangles_, kNoMaterial);
        uvs_.resize(triangles_);
    }
}

void MeshPaint::loadImages(const ImageLimits& limits) {
    std::map<std::string, size_t> first;
    images_.assign(materials_.size(), {});
    for (size_t i = 0; i < materials_.size(); ++i) {
        const ImageSource& source = materials_[i].image;
        if (!source.exists()) continue;
        const auto [at, isNew] = first.try_emplace(keyOf(materials_[i]), i);
        if (!isNew) {
            images_[i] = images_[at->second];
            continue;
        }
        auto image = loadImage(materials_[i], limits);
        if (!image) {
            warnings_.push_back(image.error().line());
            continue;
        }
        images_[i] = std::make_shared<const Image>(*std::move(image));
        imageBytes_ += storedBytesOf(source);
    }
}

PaintedLight MeshPaint::texelAt(const Material& material, const Image& image, glm::dvec2 uv) const {
    const double x = uv.x * image.width - 0.5, y = uv.y * image.height - 0.5;
    const double left = std::floor(x), top = std::floor(y);
    PaintedLight sum;
    for (int corner = 0; corner < 4; ++corner) {
        const int i = corner & 1, j = corner >> 1;
        const uint32_t column = wrappedTexel(left + i, image.width, material.wrapU),
                       row = wrappedTexel(top + j, image.height, material.wrapV);
        const Rgba8 texel = image.texels[size_t{row} * image.width + column];
        const double share = (i ? x - left : 1 - (x - left)) * (j ? y - top : 1 - (y - top)) * (texel >> 24) / 255;
        sum += {share * lightOf(texel), share};
    }
    return sum;
}

PaintedLight MeshPaint::lightAt(const IndexedMesh& mesh, uint64_t triangle, glm::dvec3 weights) const {
    PaintedLight painted{glm::dvec3(1), 1};
    if (!vertices_.empty()) {
        // As files and the renderer have it: stored values are blended.
        glm::dvec3 stored(0);
        for (int i = 0; i < 3; ++i)
            for (int channel = 0; channel < 3; ++channel)
                stored[channel] +=
                    weights[i] * double(vertices_[mesh.triangles[triangle][size_t(i)]] >> 8 * channel & 255u) / 255;
        for (int channel = 0; channel < 3; ++channel) painted.light[channel] = srgbToLinear(stored[channel]);
    }
    if (triangleMaterials_.empty() || triangleMaterials_[triangle] == kNoMaterial) return painted;
    const uint32_t number = triangleMaterials_[triangle];
    const Material& material = materials_[number];
    painted.light *= lightOf(material.factor);
    if (images_.empty() || !images_[number]) return painted;
    glm::dvec2 uv(0);
    for (int i = 0; i < 3; ++i) uv += weights[i] * glm::dvec2(uvs_[triangle][size_t(i)]);
    const PaintedLight texel = texelAt(material, *images_[number], uv);
    return {painted.light * texel.light, texel.cover};
}

}  // namespace vcp
