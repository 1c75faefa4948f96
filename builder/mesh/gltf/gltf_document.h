// What a glTF 2.0 file says in its JSON, as far as surfaces are concerned; validated: every index is in range, every
// view lies in its buffer, every accessor in its view. The nodes should form trees; whether they do is seen when they
// are walked.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "builder/stream/byte_source.h"
#include "builder/stream/material.h"
#include "octree/io/result.h"

namespace vcp {

enum class GltfComponent : uint8_t { Int8, Uint8, Int16, Uint16, Uint32, Float };

constexpr size_t byteSize(GltfComponent type) {
    constexpr size_t kSizes[] = {1, 1, 2, 2, 4, 4};
    return kSizes[size_t(type)];
}

struct GltfBuffer {
    std::string uri;  ///< as it stands, percent-encoded; a data URI is replaced by `data`
    bool embedded = false;
    std::string data;  ///< decoded from a data URI
    uint64_t bytes = 0;
};

/// EXT_meshopt_compression: the bytes of a buffer that a view is decoded from, and into what.
struct GltfMeshopt {
    enum class Mode : uint8_t { Attributes, Triangles, Indices };
    enum class Filter : uint8_t { None, Octahedral, Quaternion, Exponential };

    uint32_t buffer = 0;
    uint64_t offset = 0;
    uint64_t bytes = 0;
    uint64_t count = 0;
    uint64_t stride = 0;
    Mode mode = Mode::Attributes;
    Filter filter = Filter::None;
};

struct GltfView {
    uint32_t buffer = 0;
    uint64_t offset = 0;
    uint64_t bytes = 0;
    uint64_t stride = 0;                    ///< 0: elements follow each other
    std::optional<GltfMeshopt> compressed;  ///< then `buffer` need not exist
};

struct GltfSparse {
    uint64_t count = 0;
    uint32_t indexView = 0;
    uint64_t indexOffset = 0;
    GltfComponent indexType = GltfComponent::Uint32;
    uint32_t valueView = 0;
    uint64_t valueOffset = 0;
};

struct GltfAccessor {
    std::optional<uint32_t> view;  ///< absent: zeros
    uint64_t offset = 0;
    uint64_t count = 0;
    GltfComponent type = GltfComponent::Float;
    uint32_t components = 0;  ///< 1 to 4; 0 for matrices, which no surface needs
    bool normalized = false;
    std::optional<GltfSparse> sparse;

    [[nodiscard]] uint64_t elementBytes() const { return byteSize(type) * components; }
};

enum class GltfAlpha : uint8_t { Opaque, Mask, Blend };

/// An image, and where it lies.
struct GltfTexture {
    std::optional<uint32_t> image;
    uint32_t texCoord = 0;
    Wrap wrapU = Wrap::Repeat, wrapV = Wrap::Repeat;
    /// KHR_texture_transform: uv becomes uvMatrix * (u, v, 1), row by row.
    std::array<glm::dvec3, 2> uvMatrix{glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0)};

    [[nodiscard]] bool liesAs(const GltfTexture& other) const {
        return texCoord == other.texCoord && wrapU == other.wrapU && wrapV == other.wrapV && uvMatrix == other.uvMatrix;
    }
};

/// What a material has beside its base colour: numbers of images that lie as its texture does, and factors.
struct GltfChannels {
    std::optional<uint32_t> normals, surface, emission;
    bool lacksSurface = false, lacksEmission = false;  ///< the image that the factors belong to was left out
    double normalScale = 1, roughness = 1, metalness = 1;
    std::array<double, 3> emissionFactor{0, 0, 0};
};

struct GltfMaterial {
    std::string name;
    Rgba8 factor = kWhite;  ///< base colour, sRGB encoded
    double alpha = 1;       ///< of the base colour
    GltfAlpha alphaMode = GltfAlpha::Opaque;
    double alphaCutoff = 0.5;
    GltfTexture texture;          ///< of the base colour; without one it says where the channels lie
    bool hasCoordinates = false;  ///< some image lies over its triangles
    GltfChannels channels;
};

struct GltfImage {
    std::string uri;
    std::string data;  ///< decoded from a data URI
    std::optional<uint32_t> view;
};

/// KHR_draco_mesh_compression: the identifiers of the attributes.
struct GltfDraco {
    uint32_t view = 0;
    std::optional<uint32_t> position, colour, normal, uv;
};

enum class GltfMode : uint8_t { Triangles, Strip, Fan };

struct GltfPrimitive {
    GltfMode mode = GltfMode::Triangles;
    uint32_t position = 0;  ///< accessors
    std::optional<uint32_t> colour, normal, uv, indices;
    std::optional<uint32_t> material;
    std::optional<GltfDraco> draco;
};

struct GltfMesh {
    std::vector<GltfPrimitive> primitives;  ///< those with triangles
};

/// EXT_mesh_gpu_instancing: accessors, each of one value an instance.
struct GltfInstancing {
    std::optional<uint32_t> translation, rotation, scale;
    uint64_t count = 0;
};

struct GltfNode {
    glm::dmat4 local{1};
    std::optional<uint32_t> mesh;
    std::optional<GltfInstancing> instancing;
    std::vector<uint32_t> children;
};

struct GltfDocument {
    std::vector<GltfBuffer> buffers;
    std::vector<GltfView> views;
    std::vector<GltfAccessor> accessors;
    std::vector<GltfImage> images;
    std::vector<GltfMaterial> materials;
    std::vector<GltfMesh> meshes;
    std::vector<GltfNode> nodes;
    std::vector<uint32_t> roots;  ///< roots of the default scene, else of the first, else nodes without a parent
    glm::dvec3 centre{0};         ///< CESIUM_RTC: added to every position
    std::vector<std::string> warnings;
};

/// Reads `jsonBytes` of JSON at the cursor (up to the end for ByteSource::kUnknownSize). Memory: some 128 MiB of text,
/// most of it in data URIs, and 4 million values. Errors: InvalidInput (the JSON, or what it says), Unsupported (a
/// required extension, glTF 1), Limit, Io.
Result<GltfDocument> readGltfDocument(ByteSource& source, uint64_t jsonBytes);

}  // namespace vcp
