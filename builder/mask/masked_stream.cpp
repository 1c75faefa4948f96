#include "builder/mask/masked_stream.h"

#include <algorithm>
#include <utility>

#include "builder/mask/mask_detail.h"
#include "builder/stream/chunk_room.h"

namespace vcp {

namespace {

class MaskedStream final : public MeshStream {
public:
    MaskedStream(std::unique_ptr<MeshStream> whole, uint64_t memoryBytes)
        : whole_(std::move(whole)), info_(whole_->info()), cutter_(memoryBytes) {
        info_.vertices.reset();
        info_.faces.reset();
    }

    [[nodiscard]] const MeshInfo& info() const override { return info_; }
    [[nodiscard]] uint64_t bytesRead() const override { return whole_->bytesRead(); }
    [[nodiscard]] std::span<const Material> materials() const override { return whole_->materials(); }
    [[nodiscard]] std::span<const SideFile> sideFiles() const override { return whole_->sideFiles(); }
    [[nodiscard]] std::span<const std::string> warnings() const override {
        return warnings_.empty() ? whole_->warnings() : warnings_;
    }

    Result<bool> next(MeshChunk& chunk) override {
        chunk.clear();
        while (!isRead_ && isEmpty(chunk)) {
            VCP_TRY_ASSIGN(const bool more, whole_->next(chunk));
            if (more)
                hold(chunk);
            else
                endReading();
        }
        while (isRead_ && next_ < held_.size() && hasRoom(chunk)) VCP_TRY(addParts(held_[next_++], chunk));
        if (next_ == held_.size() && isRead_ && warnings_.empty() && !cutter_.warnings().empty()) endWarnings();
        return !isEmpty(chunk);
    }

private:
    struct Held {
        std::array<uint64_t, 3> vertices;
        std::array<glm::vec2, 3> uv;
        uint32_t material;
        std::array<uint32_t, 3> normals;  // kUnknownNormal: the vertex's
    };

    void endReading() {
        isRead_ = true;
        MaskDetail detail;
        detail.add(positions_);
        cutter_.setDetail(detail.length());
    }

    /// Keeps the vertices of a chunk, and takes those triangles out of it that have a mask.
    void hold(MeshChunk& chunk) {
        positions_.insert(positions_.end(), chunk.positions.begin(), chunk.positions.end());
        colours_.insert(colours_.end(), chunk.colours.begin(), chunk.colours.end());
        normals_.insert(normals_.end(), chunk.normals.begin(), chunk.normals.end());
        if (!chunk.colours.empty()) colours_.resize(positions_.size(), kWhite);
        if (!chunk.normals.empty()) normals_.resize(positions_.size(), kUnknownNormal);
        if (chunk.materials.empty()) return;
        const bool hasNormals = !chunk.cornerNormals.empty();
        size_t stay = 0;
        for (size_t k = 0; k < chunk.triangles.size(); ++k) {
            const uint32_t material = chunk.materials[k];
            if (material < materials().size() && materials()[material].mask.exists()) {
                held_.push_back(
                    {chunk.triangles[k], chunk.uvs[k], material,
                     hasNormals ? chunk.cornerNormals[k] : std::array{kUnknownNormal, kUnknownNormal, kUnknownNormal}});
                continue;
            }
            chunk.triangles[stay] = chunk.triangles[k];
            chunk.uvs[stay] = chunk.uvs[k];
            chunk.materials[stay] = material;
            if (hasNormals) chunk.cornerNormals[stay] = chunk.cornerNormals[k];
            ++stay;
        }
        chunk.triangles.resize(stay);
        chunk.uvs.resize(stay);
        chunk.materials.resize(stay);
        if (hasNormals) chunk.cornerNormals.resize(stay);
    }

    Result<void> addParts(const Held& held, MeshChunk& chunk) {
        std::array<MaskCorner, 3> corners;
        for (size_t i = 0; i < 3; ++i) {
            const uint64_t v = held.vertices[i];
            if (v >= positions_.size())
                return Error{.code = ErrorCode::InvalidInput,
                             .message = "a triangle names a vertex that the file does not have"};
            const bool hasOwn = held.normals[i] != kUnknownNormal;
            corners[i] = {positions_[v], held.uv[i], v < colours_.size() ? colours_[v] : kWhite,
                          hasOwn                ? held.normals[i]
                          : v < normals_.size() ? normals_[v]
                                                : kUnknownNormal};
        }
        const MaskParts* const parts =
            cutter_.partsOf(materials(), held.material, held.uv,
                            triangleArea(corners[0].position, corners[1].position, corners[2].position));
        if (parts == nullptr) {
            addTriangle(held.vertices, corners, held.material, chunk);
            return {};
        }
        std::vector<MaskCorner> points;
        const uint64_t first = positions_.size() + made_;
        for (const Weights& weights : parts->points) {
            const MaskCorner& point = points.emplace_back(blend(corners, weights));
            chunk.positions.push_back(point.position);
            if (info_.hasColour || !colours_.empty()) chunk.colours.push_back(point.colour);
            ++made_;
        }
        for (const auto& t : parts->triangles)
            addTriangle({first + t[0], first + t[1], first + t[2]}, {points[t[0]], points[t[1]], points[t[2]]},
                        held.material, chunk);
        return {};
    }

    static void addTriangle(const std::array<uint64_t, 3>& vertices, const std::array<MaskCorner, 3>& corners,
                            uint32_t material, MeshChunk& chunk) {
        chunk.triangles.push_back(vertices);
        chunk.uvs.push_back({corners[0].uv, corners[1].uv, corners[2].uv});
        chunk.materials.push_back(material);
        chunk.cornerNormals.push_back({corners[0].normal, corners[1].normal, corners[2].normal});
    }

    void endWarnings() {
        warnings_.assign(whole_->warnings().begin(), whole_->warnings().end());
        warnings_.insert(warnings_.end(), cutter_.warnings().begin(), cutter_.warnings().end());
    }

    std::unique_ptr<MeshStream> whole_;
    MeshInfo info_;
    MaskCutter cutter_;
    std::vector<glm::dvec3> positions_;
    std::vector<Rgba8> colours_;     // as many as positions, or fewer where the last have none
    std::vector<uint32_t> normals_;  // likewise
    std::vector<Held> held_;
    size_t next_ = 0;  // of those held
    bool isRead_ = false;
    uint64_t made_ = 0;  // vertices of parts
    std::vector<std::string> warnings_;
};

}  // namespace

std::unique_ptr<MeshStream> maskedStream(std::unique_ptr<MeshStream> stream, uint64_t memoryBytes) {
    const auto known = stream->materials();
    if (std::none_of(known.begin(), known.end(), mayCut)) return stream;
    return std::make_unique<MaskedStream>(std::move(stream), memoryBytes);
}

}  // namespace vcp
