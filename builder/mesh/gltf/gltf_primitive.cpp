#include "builder/mesh/gltf/gltf_primitive.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "builder/stream/chunk_room.h"
#include "builder/stream/colour_encoding.h"
#include "builder/stream/spilled_array.h"

namespace vcp {
namespace {

constexpr size_t kElements = 8192;  // elements read at once

class PrimitiveStream final : public MeshStream {
public:
    PrimitiveStream(const GltfDocument& document, GltfBuffers& buffers, const GltfPrimitive& primitive,
                    const std::filesystem::path& tempFolder)
        : primitive_(primitive),
          vertices_(document.accessors[primitive.position].count),
          positions_(document, buffers, primitive.position),
          uvs_(tempFolder) {
        if (primitive.colour) colours_.emplace(document, buffers, *primitive.colour);
        if (primitive.normal) normals_.emplace(document, buffers, *primitive.normal);
        if (primitive.uv) uvValues_.emplace(document, buffers, *primitive.uv);
        if (primitive.indices) indices_.emplace(document, buffers, *primitive.indices);
        vertexEnd_ = vertices_;
        corners_ = primitive.indices ? document.accessors[*primitive.indices].count : vertices_;
    }

    // Finds the range of the vertices that are named.
    Result<void> narrow() {
        uint64_t least = vertices_, most = 0;
        GltfAccessorReader indices = *indices_;
        while (indices.left() > 0) {
            VCP_TRY(indices.read(kElements, values_));
            for (const double value : values_) {
                least = std::min(least, uint64_t(value));
                most = std::max(most, uint64_t(value));
            }
        }
        if (most >= vertices_ || least > most) return {};  // an error that is reported when they are read in earnest
        firstVertex_ = least;
        vertexEnd_ = most + 1;
        positions_.skip(firstVertex_);
        if (colours_) colours_->skip(firstVertex_);
        if (normals_) normals_->skip(firstVertex_);
        if (uvValues_) uvValues_->skip(firstVertex_);
        return {};
    }

    [[nodiscard]] const MeshInfo& info() const override { return info_; }
    [[nodiscard]] uint64_t bytesRead() const override { return 0; }

    Result<bool> next(MeshChunk& chunk) override {
        chunk.clear();
        while (hasRoom(chunk)) {
            if (nextVertex() < vertexEnd_)
                VCP_TRY(readVertices(chunk));
            else if (corner_ < corners_)
                VCP_TRY(readCorners(chunk));
            else
                break;
        }
        return !isEmpty(chunk);
    }

private:
    [[nodiscard]] uint64_t nextVertex() const { return vertices_ - positions_.left(); }

    Result<void> readVertices(MeshChunk& chunk) {
        const uint64_t first = nextVertex();
        VCP_TRY(positions_.read(std::min<uint64_t>(kElements, vertexEnd_ - first), values_));
        const size_t count = values_.size() / 3;
        for (size_t i = 0; i < count; ++i) {
            const glm::dvec3 position(values_[3 * i], values_[3 * i + 1], values_[3 * i + 2]);
            if (!std::isfinite(position.x) || !std::isfinite(position.y) || !std::isfinite(position.z))
                return wrong(primitive_.position,
                             fmt::format("the position of vertex {} is not finite (NaN or infinite)", first + i));
            chunk.positions.push_back(position);
        }
        if (colours_) VCP_TRY(readColours(count, chunk));
        if (normals_) VCP_TRY(readNormals(count, chunk));
        if (!uvValues_) return {};
        VCP_TRY(uvValues_->read(count, values_));
        for (size_t i = 0; i < count; ++i) VCP_TRY(uvs_.append({float(values_[2 * i]), float(values_[2 * i + 1])}));
        return {};
    }

    Result<void> readColours(size_t count, MeshChunk& chunk) {
        VCP_TRY(colours_->read(count, values_));
        const size_t components = colours_->components();
        for (size_t i = 0; i < count; ++i) {
            const double* const c = values_.data() + i * components;
            chunk.colours.push_back(encodeRgba({c[0], c[1], c[2], components == 4 ? c[3] : 1}));
        }
        return {};
    }

    Result<void> readNormals(size_t count, MeshChunk& chunk) {
        VCP_TRY(normals_->read(count, values_));
        for (size_t i = 0; i < count; ++i)
            chunk.normals.push_back(packDirection({values_[3 * i], values_[3 * i + 1], values_[3 * i + 2]}));
        return {};
    }

    Result<void> readCorners(MeshChunk& chunk) {
        if (indices_) {
            VCP_TRY(indices_->read(kElements, values_));
            for (const double value : values_) VCP_TRY(takeCorner(uint64_t(value), chunk));
            return {};
        }
        const uint64_t end = std::min(corners_, corner_ + kElements);
        while (corner_ < end) VCP_TRY(takeCorner(corner_, chunk));
        return {};
    }

    Result<void> takeCorner(uint64_t vertex, MeshChunk& chunk) {
        if (vertex < firstVertex_ || vertex >= vertexEnd_)
            return wrong(*primitive_.indices,
                         fmt::format("index {} names vertex {}, but there are only {}", corner_, vertex, vertices_));
        vertex -= firstVertex_;
        switch (primitive_.mode) {
            case GltfMode::Triangles:
                if (corner_ % 3 == 2) VCP_TRY(emit(first_, last_, vertex, chunk));
                first_ = last_;
                break;
            case GltfMode::Strip:
                if (corner_ > 1)
                    VCP_TRY(corner_ % 2 == 0 ? emit(first_, last_, vertex, chunk) : emit(last_, first_, vertex, chunk));
                first_ = last_;
                break;
            case GltfMode::Fan:
                if (corner_ > 1) VCP_TRY(emit(first_, last_, vertex, chunk));
                if (corner_ == 0) first_ = vertex;
                break;
        }
        last_ = vertex;
        ++corner_;
        return {};
    }

    Result<void> emit(uint64_t a, uint64_t b, uint64_t c, MeshChunk& chunk) {
        // Such a triangle only steers the strip.
        if (primitive_.mode == GltfMode::Strip && (a == b || b == c || c == a)) return {};
        chunk.triangles.push_back({a, b, c});
        if (!uvValues_) return {};
        std::array<glm::vec2, 3> uvs;
        const std::array<uint64_t, 3> corners{a, b, c};
        for (size_t i = 0; i < 3; ++i) {
            VCP_TRY_ASSIGN(uvs[i], uvs_.at(corners[i]));
        }
        chunk.uvs.push_back(uvs);
        return {};
    }

    static Error wrong(uint32_t accessor, std::string message) {
        return {.code = ErrorCode::InvalidInput,
                .message = std::move(message),
                .element = fmt::format("accessor {}", accessor)};
    }

    GltfPrimitive primitive_;
    MeshInfo info_;
    uint64_t vertices_;
    GltfAccessorReader positions_;
    std::optional<GltfAccessorReader> colours_, normals_, uvValues_, indices_;
    SpilledArray<glm::vec2> uvs_;
    std::vector<double> values_;
    uint64_t firstVertex_ = 0;  // first vertex of those that are read
    uint64_t vertexEnd_ = 0;
    uint64_t corners_ = 0;
    uint64_t corner_ = 0;  // the next one
    uint64_t first_ = 0;   // the last corner but one; in a fan its first
    uint64_t last_ = 0;
};

}  // namespace

bool isRange(const GltfDocument& document, const GltfPrimitive& primitive) {
    return primitive.indices &&
           document.accessors[*primitive.indices].count < document.accessors[primitive.position].count;
}

Result<std::unique_ptr<MeshStream>> openGltfPrimitive(const GltfDocument& document, GltfBuffers& buffers,
                                                      const GltfPrimitive& primitive,
                                                      const std::filesystem::path& tempFolder) {
    auto stream = std::make_unique<PrimitiveStream>(document, buffers, primitive, tempFolder);
    if (isRange(document, primitive)) VCP_TRY(stream->narrow());
    return std::unique_ptr<MeshStream>(std::move(stream));
}

}  // namespace vcp
