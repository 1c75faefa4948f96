#include "builder/mesh/gltf/gltf.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <glm/matrix.hpp>

#include "builder/mesh/gltf/draco.h"
#include "builder/mesh/gltf/glb.h"
#include "builder/mesh/gltf/gltf_materials.h"
#include "builder/mesh/gltf/gltf_primitive.h"
#include "builder/mesh/gltf/gltf_scene.h"
#include "builder/stream/chunk_room.h"
#include "builder/stream/colour_encoding.h"
#include "builder/stream/coordinate_check.h"
#include "builder/stream/data_uri.h"
#include "builder/stream/number_text.h"
#include "octree/surface/leaf_math.h"

namespace vcp {
namespace {

constexpr uint64_t kMostImageBytes = uint64_t{256} << 20;  // embedded images, together

class GltfStream final : public MeshStream {
public:
    GltfStream(std::string name, std::filesystem::path folder, const MeshOpenOptions& options, GltfDocument document,
               std::unique_ptr<RandomBytes> binary)
        : name_(std::move(name)),
          folder_(folder),
          options_(options),
          document_(std::move(document)),
          buffers_(document_, name_, std::move(folder), std::move(binary),
                   {.tempFolder = options.tempFolder,
                    .decoderBytes = options.decoderBytes,
                    .allowOutside = options.allowOutside}) {}

    Result<void> begin(std::string format, uint64_t fileBytes) {
        info_.format = std::move(format);
        info_.fileBytes = fileBytes;
        auto placements = placementsOf(document_);
        if (!placements) return named(placements.error());
        placements_ = *std::move(placements);
        for (const std::string& warning : document_.warnings) warnings_.push_back(name_ + ": " + warning);
        planColours();
        VCP_TRY(planMaterials());
        VCP_TRY(planCounts());
        if (placements_.empty())
            return Error{.code = ErrorCode::InvalidInput, .message = "has no triangles in its scene", .file = name_};
        return {};
    }

    [[nodiscard]] const MeshInfo& info() const override { return info_; }
    [[nodiscard]] std::span<const Material> materials() const override { return materials_; }
    [[nodiscard]] std::span<const std::string> warnings() const override { return warnings_; }
    [[nodiscard]] std::span<const SideFile> sideFiles() const override { return buffers_.sideFiles; }
    [[nodiscard]] uint64_t bytesRead() const override {
        const double share = double(placement_) / double(std::max<size_t>(placements_.size(), 1));
        return std::min(info_.fileBytes, uint64_t(share * double(info_.fileBytes)));
    }

    Result<bool> next(MeshChunk& chunk) override {
        chunk.clear();
        while (isEmpty(chunk)) {
            if (!part_) {
                auto more = nextPart();
                if (!more || !*more) return more;
            }
            auto more = part_->next(chunk);
            if (!more) return named(more.error());
            if (*more)
                VCP_TRY(place(chunk));
            else
                finishPart();
        }
        return true;
    }

private:
    // Calls `use` for every primitive that is shown.
    template <class Use>
    void eachPrimitive(Use use) const {
        for (const GltfPlacement& placement : placements_)
            for (const GltfPrimitive& primitive : document_.meshes[placement.mesh].primitives)
                use(placement, primitive);
    }

    Rgba8 factorOf(const GltfPrimitive& primitive) const {
        return primitive.material ? document_.materials[*primitive.material].factor : kWhite;
    }

    void planColours() {
        std::set<Rgba8> factors;
        eachPrimitive([&](const GltfPlacement&, const GltfPrimitive& primitive) {
            factors.insert(factorOf(primitive));
            info_.hasColour =
                info_.hasColour || (primitive.draco ? primitive.draco->colour : primitive.colour).has_value();
        });
        info_.hasColour = info_.hasColour || factors.size() > 1;
    }

    Result<void> planMaterials() {
        if (!options_.materials) return {};
        std::vector<ImageSource> images;
        uint64_t bytes = 0;
        for (size_t i = 0; i < document_.images.size(); ++i) {
            VCP_TRY_ASSIGN(auto image, imageOf(i, bytes));
            images.push_back(std::move(image));
        }
        materials_ = materialsOf(document_, images);
        eachPrimitive([&](const GltfPlacement& placement, const GltfPrimitive& primitive) {
            info_.hasMaterials = info_.hasMaterials || hasImage(primitive) || isCutOut(primitive);
            if (wantsImage(primitive) && !hasCoordinates(primitive))
                check_.noteAbsent([&] { return fmt::format("{}: mesh {}", name_, placement.mesh); }, warnings_);
        });
        if (!info_.hasMaterials) materials_.clear();
        return {};
    }

    static bool hasCoordinates(const GltfPrimitive& primitive) {
        return primitive.draco ? primitive.draco->uv.has_value() : primitive.uv.has_value();
    }
    bool wantsImage(const GltfPrimitive& primitive) const {
        return primitive.material && *primitive.material < materials_.size() &&
               materials_[*primitive.material].hasImages();
    }
    bool hasImage(const GltfPrimitive& primitive) const { return hasCoordinates(primitive) && wantsImage(primitive); }

    // Whether nothing is left of a primitive, with or without an image.
    bool isCutOut(const GltfPrimitive& primitive) const {
        return primitive.material && *primitive.material < materials_.size() &&
               materials_[*primitive.material].mask.cutoff > 1;
    }

    Result<ImageSource> imageOf(size_t number, uint64_t& bytes) {
        GltfImage& image = document_.images[number];
        const std::string where = fmt::format("{}: image {}", name_, number);
        ImageSource source;
        if (image.view) {
            const uint64_t size = document_.views[*image.view].bytes;
            bytes += size;
            if (bytes > kMostImageBytes) {
                warnings_.push_back(where + ": embedded images of more than 256 MiB are left out");
                return source;
            }
            const std::string element = fmt::format("image {}", number);
            // A buffer that is shorter than declared is noticed before anything is allocated.
            VCP_TRY(buffers_.read(*image.view, 0, nullptr, 0, element));
            std::string data(size, '\0');
            VCP_TRY(buffers_.read(*image.view, 0, data.data(), data.size(), element));
            source.bytes = std::make_shared<const std::string>(std::move(data));
        } else if (!image.data.empty()) {
            source.bytes = std::make_shared<const std::string>(std::move(image.data));
        } else if (!image.uri.empty()) {
            const auto path = folder_.empty() ? std::nullopt : fileBelow(folder_, image.uri, options_.allowOutside);
            if (path) buffers_.sideFiles.emplace_back(*path);
            std::error_code ignored;
            if (!path)
                warnings_.push_back(where + ": its URI names no file in the folder of the glTF file; it is left out");
            else if (!std::filesystem::is_regular_file(*path, ignored))
                warnings_.push_back(fmt::format("{}: {} is missing; it is left out", where, path->string()));
            else
                source.path = *path;
        }
        return source;
    }

    // Plans the counts, where the accessors say them.
    Result<void> planCounts() {
        constexpr uint64_t kMost = uint64_t{1} << 48;
        uint64_t vertices = 0, faces = 0;
        bool known = true, facesKnown = true, tooMany = false;
        eachPrimitive([&](const GltfPlacement& placement, const GltfPrimitive& primitive) {
            const auto& accessors = document_.accessors;
            const uint64_t here = accessors[primitive.position].count;
            const uint64_t corners = primitive.indices ? accessors[*primitive.indices].count : here;
            const auto* const node = document_.nodes.empty() ? nullptr : &document_.nodes[placement.node];
            const uint64_t times = node && node->instancing ? node->instancing->count : 1;
            tooMany = tooMany || std::max(here, corners) > kMost || times > kMost ||
                      double(std::max(here, corners)) * double(times) > double(kMost);
            if (tooMany) return;
            vertices += here * times;
            faces += (primitive.mode == GltfMode::Triangles ? corners / 3 : std::max<uint64_t>(corners, 2) - 2) * times;
            tooMany = vertices > kMost || faces > kMost;
            known = known && !primitive.draco && !isRange(document_, primitive);
            facesKnown = facesKnown && !primitive.draco && primitive.mode != GltfMode::Strip;
        });
        if (tooMany)
            return Error{.code = ErrorCode::Limit,
                         .message = "its instances make more than 2^48 vertices or triangles",
                         .file = name_};
        if (known) info_.vertices = vertices;
        if (facesKnown) info_.faces = faces;
        return {};
    }

    // Starts the next primitive of the next instance of the next placement; false when all were read.
    Result<bool> nextPart() {
        while (placement_ < placements_.size()) {
            const GltfPlacement& placement = placements_[placement_];
            const auto& primitives = document_.meshes[placement.mesh].primitives;
            if (!instances_) {
                instances_.emplace(document_, buffers_,
                                   document_.nodes.empty() ? GltfNode{} : document_.nodes[placement.node]);
                primitive_ = primitives.size();
            }
            if (primitive_ < primitives.size()) {
                VCP_TRY(openPart(primitives[primitive_]));
                return true;
            }
            if (instances_->done()) {
                instances_.reset();
                ++placement_;
                continue;
            }
            auto transform = instances_->next();
            if (!transform) return named(transform.error());
            worldFromMesh_ = placement.worldFromNode * *transform;
            primitive_ = 0;
        }
        if (triangles_ == 0)
            return Error{.code = ErrorCode::InvalidInput, .message = "has no triangles in its scene", .file = name_};
        return false;
    }

    Result<void> openPart(const GltfPrimitive& primitive) {
        partVertices_ = 0;
        if (!primitive.draco) {
            GltfPrimitive wanted = primitive;
            if (!hasImage(primitive)) wanted.uv.reset();
            if (!info_.hasColour) wanted.colour.reset();
            auto part = openGltfPrimitive(document_, buffers_, wanted, options_.tempFolder);
            if (!part) return named(part.error());
            part_ = *std::move(part);
            return {};
        }
        DracoSelection selection{.byIdentifier = true,
                                 .position = *primitive.draco->position,
                                 .colour = primitive.draco->colour,
                                 .normal = primitive.draco->normal,
                                 .uv = std::nullopt,
                                 .linearColour = true};
        if (hasImage(primitive)) selection.uv = primitive.draco->uv;
        const uint32_t view = primitive.draco->view;
        const uint64_t size = document_.views[view].bytes;
        const std::string element = fmt::format("mesh {}, primitive {}", placements_[placement_].mesh, primitive_);
        const auto bytes = [&]() -> Result<std::string> {
            std::string data(size, '\0');
            VCP_TRY(buffers_.read(view, 0, data.data(), data.size(), element));
            return data;
        };
        // Opened here, so that the error of a missing buffer keeps its file.
        VCP_TRY(buffers_.read(view, 0, nullptr, 0, element));
        VCP_TRY_ASSIGN(part_, decodeDraco(bytes, size, selection, options_.decoderBytes, name_, element));
        return {};
    }

    void finishPart() {
        vertices_ += partVertices_;
        part_.reset();
        ++primitive_;
    }

    // Brings a chunk from the mesh's coordinates, numbers and attributes to those of the whole.
    Result<void> place(MeshChunk& chunk) {
        const GltfPrimitive& primitive = document_.meshes[placements_[placement_].mesh].primitives[primitive_];
        for (glm::dvec3& p : chunk.positions) {
            p = glm::dvec3(worldFromMesh_ * glm::dvec4(p, 1));
            if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
                return Error{.code = ErrorCode::InvalidInput,
                             .message = "its transform moves a vertex to infinity",
                             .file = name_,
                             .element = fmt::format("node {}", placements_[placement_].node)};
        }
        partVertices_ += chunk.positions.size();
        const bool mirrored = glm::determinant(glm::dmat3(worldFromMesh_)) < 0;
        for (size_t i = 0; i < chunk.triangles.size(); ++i) {
            auto& triangle = chunk.triangles[i];
            for (uint64_t& vertex : triangle) vertex += vertices_;
            if (!mirrored) continue;
            std::swap(triangle[1], triangle[2]);
            if (!chunk.uvs.empty()) std::swap(chunk.uvs[i][1], chunk.uvs[i][2]);
        }
        triangles_ += chunk.triangles.size();
        turn(chunk.normals);
        colour(primitive, chunk);
        paint(primitive, chunk);
        return {};
    }

    // Normals go with the cofactors of the transform: where that is not singular, its inverse transposed, but for
    // length.
    void turn(std::vector<uint32_t>& normals) const {
        const glm::dmat3 m(worldFromMesh_);
        if (m == glm::dmat3(1)) return;
        const glm::dmat3 cofactors(glm::cross(m[1], m[2]), glm::cross(m[2], m[0]), glm::cross(m[0], m[1]));
        for (uint32_t& normal : normals)
            if (normal != kUnknownNormal) normal = packDirection(cofactors * f64::decodeNormal(normal));
    }

    void colour(const GltfPrimitive& primitive, MeshChunk& chunk) const {
        if (!info_.hasColour) {
            chunk.colours.clear();
            return;
        }
        const Rgba8 factor = factorOf(primitive);
        chunk.colours.resize(chunk.positions.size(), kWhite);
        if (factor != kWhite)
            for (Rgba8& c : chunk.colours) c = modulate(c, factor);
    }

    void paint(const GltfPrimitive& primitive, MeshChunk& chunk) {
        if (!info_.hasMaterials) {
            chunk.uvs.clear();
            return;
        }
        const bool image = hasImage(primitive) && chunk.uvs.size() == chunk.triangles.size();
        chunk.materials.assign(chunk.triangles.size(),
                               image || isCutOut(primitive) ? *primitive.material : kNoMaterial);
        if (!image) {
            chunk.uvs.assign(chunk.triangles.size(), {});
            return;
        }
        const auto where = [&] {
            return fmt::format("{}: mesh {}, primitive {}", name_, placements_[placement_].mesh, primitive_);
        };
        const auto& matrix = document_.materials[*primitive.material].texture.uvMatrix;
        for (auto& corners : chunk.uvs)
            for (glm::vec2& uv : corners) {
                const glm::dvec3 at(uv, 1);
                uv = glm::vec2(glm::dot(matrix[0], at), glm::dot(matrix[1], at));
                uv = check_.usable(uv, where, warnings_);
            }
    }

    Error named(Error error) const {
        if (error.file.empty()) error.file = name_;
        return error;
    }

    std::string name_;
    std::filesystem::path folder_;
    MeshOpenOptions options_;
    GltfDocument document_;
    GltfBuffers buffers_;
    std::vector<GltfPlacement> placements_;
    MeshInfo info_;
    std::vector<Material> materials_;
    std::vector<std::string> warnings_;
    CoordinateCheck check_;

    size_t placement_ = 0;
    std::optional<GltfInstances> instances_;
    size_t primitive_ = 0;
    glm::dmat4 worldFromMesh_{1};
    std::unique_ptr<MeshStream> part_;
    uint64_t partVertices_ = 0;
    uint64_t vertices_ = 0;  // vertices before the part
    uint64_t triangles_ = 0;
};

}  // namespace

bool looksLikeGltf(std::string_view start) {
    if (start.starts_with(kUtf8Mark)) start.remove_prefix(kUtf8Mark.size());
    start.remove_prefix(std::min(start.find_first_not_of(" \t\r\n"), start.size()));
    return start.starts_with(kGlbMark) || start.starts_with('{');
}

Result<std::unique_ptr<MeshStream>> openGltf(ByteSource source, const std::filesystem::path& path,
                                             const MeshOpenOptions& options) {
    VCP_TRY_ASSIGN(const auto start, source.window(kGlbMark.size()));
    const bool binary = start.starts_with(kGlbMark);
    uint64_t jsonBytes = ByteSource::kUnknownSize;
    if (binary) {
        VCP_TRY_ASSIGN(jsonBytes, readGlbHeader(source));
    }
    VCP_TRY_ASSIGN(auto document, readGltfDocument(source, jsonBytes));
    std::unique_ptr<RandomBytes> chunk;
    if (binary) {
        VCP_TRY_ASSIGN(chunk, openGlbBinary(source, path, options.tempFolder));
    }
    std::filesystem::path folder;
    if (!path.empty() && path != "-") folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
    auto stream =
        std::make_unique<GltfStream>(source.name(), std::move(folder), options, std::move(document), std::move(chunk));
    VCP_TRY(stream->begin(binary ? "GLB" : "glTF", source.fileBytes()));
    return std::unique_ptr<MeshStream>(std::move(stream));
}

}  // namespace vcp
