// The colour of a mesh held in memory at any point of its triangles: what colours in files and pictures are measured
// against.
//
// It is taken at the finest texels (bilinear, as light), without mip levels: who wants a mean takes many points. The
// build has filters of its own (builder/texture/texture.h), which this is the reference for; only the decoder of images
// is shared.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "builder/measure/indexed_mesh.h"
#include "builder/stream/mesh_stream.h"
#include "builder/texture/image.h"

namespace vcp {

/// Linear light, 0 to 1, times `cover`: what the image's alpha leaves of the point, 0 to 1. The alpha of vertices and
/// factors does not count.
struct PaintedLight {
    glm::dvec3 light{0};
    double cover = 0;

    PaintedLight& operator+=(const PaintedLight& other) {
        light += other.light;
        cover += other.cover;
        return *this;
    }
};

class MeshPaint {
public:
    /// Takes in the colours of a chunk of the mesh; chunks come in their order, file after file (LoadOptions::chunk).
    void add(size_t file, const MeshStream& stream, const MeshChunk& chunk);
    /// Decodes the images that were named. Those that cannot be read become warnings, and their materials have none.
    void loadImages(const ImageLimits& limits = {});

    /// Whether vertices or materials say anything.
    [[nodiscard]] bool hasColour() const { return !vertices_.empty() || !materials_.empty(); }
    /// Returns the light at a point of a triangle of the mesh that was added. `weights`: of its corners; their sum is
    /// 1. Any thread.
    [[nodiscard]] PaintedLight lightAt(const IndexedMesh& mesh, uint64_t triangle, glm::dvec3 weights) const;

    /// Bytes of the image files, as they are stored; and of vertex colours as RGBA8.
    [[nodiscard]] uint64_t storedBytes() const { return imageBytes_ + vertices_.size() * sizeof(Rgba8); }
    [[nodiscard]] std::span<const std::string> warnings() const { return warnings_; }

private:
    [[nodiscard]] PaintedLight texelAt(const Material& material, const Image& image, glm::dvec2 uv) const;

    std::vector<Rgba8> vertices_;                       // as many as positions, or none
    std::vector<std::array<glm::vec2, 3>> uvs_;         // as many as triangles, or none
    std::vector<uint32_t> triangleMaterials_;           // likewise; kNoMaterial where there is none
    std::vector<Material> materials_;                   // of all files, one after the other
    std::vector<std::shared_ptr<const Image>> images_;  // as many as materials; null where there is none
    std::vector<std::string> warnings_;
    size_t file_ = 0, firstMaterial_ = 0;  // the file that chunks came from last, and its first material
    uint64_t positions_ = 0, triangles_ = 0, imageBytes_ = 0;
};

}  // namespace vcp
