#include "builder/measure/indexed_mesh.h"

#include <fmt/format.h>

#include "builder/mask/masked_stream.h"
#include "builder/mesh/open_mesh.h"

namespace vcp {

namespace {

/// Appends a chunk's coordinates, or clears all once triangles have none.
void addCoordinates(const MeshChunk& chunk, size_t before, IndexedMesh& mesh) {
    if (mesh.coordinates.size() != before) return;
    mesh.coordinates.insert(mesh.coordinates.end(), chunk.coordinates.begin(), chunk.coordinates.end());
    // In the streams' own coordinates v grows downwards.
    if (chunk.coordinates.empty())
        for (const auto& uv : chunk.uvs) {
            auto& map = mesh.coordinates.emplace_back();
            for (int k = 0; k < 3; ++k) map[k] = glm::dvec2(uv[k].x, 1 - uv[k].y);
        }
    if (mesh.coordinates.size() != mesh.triangles.size()) mesh.coordinates = {};
}

/// Gathers a file's normals, those of vertices and those of corners.
class NormalCollector {
public:
    void add(const MeshChunk& chunk, size_t positions, size_t triangles) {
        ofVertices_.insert(ofVertices_.end(), chunk.normals.begin(), chunk.normals.end());
        ofVertices_.resize(positions, kUnknownNormal);
        ofCorners_.insert(ofCorners_.end(), chunk.cornerNormals.begin(), chunk.cornerNormals.end());
        ofCorners_.resize(triangles, {kUnknownNormal, kUnknownNormal, kUnknownNormal});
    }

    /// Returns them by corner. `triangles`: those of the file; `base`: number of its first vertex.
    std::vector<std::array<uint32_t, 3>> byCorner(std::span<const std::array<uint32_t, 3>> triangles, uint64_t base) {
        for (size_t k = 0; k < triangles.size(); ++k)
            for (size_t i = 0; i < 3; ++i)
                if (ofCorners_[k][i] == kUnknownNormal) ofCorners_[k][i] = ofVertices_[triangles[k][i] - base];
        return std::move(ofCorners_);
    }

private:
    std::vector<uint32_t> ofVertices_;
    std::vector<std::array<uint32_t, 3>> ofCorners_;
};

Result<void> append(MeshStream& stream, const std::string& name, const LoadOptions& options, IndexedMesh& mesh,
                    size_t file = 0) {
    const size_t firstTriangle = mesh.triangles.size();
    NormalCollector normals;
    const uint64_t base = mesh.positions.size();
    const auto fail = [&](ErrorCode code, std::string message) {
        return Error{.code = code, .message = std::move(message), .file = name};
    };
    for (MeshChunk chunk;;) {
        VCP_TRY_ASSIGN(const bool more, stream.next(chunk));
        if (!more) {
            if (!options.normals) return {};
            const auto all = normals.byCorner(std::span(mesh.triangles).subspan(firstTriangle), base);
            mesh.normals.insert(mesh.normals.end(), all.begin(), all.end());
            return {};
        }
        if (options.chunk) options.chunk(file, stream, chunk);
        if (mesh.positions.size() + chunk.positions.size() > options.mostPositions ||
            mesh.triangles.size() + chunk.triangles.size() > options.mostTriangles)
            return fail(ErrorCode::Limit,
                        fmt::format("has more than {} triangles or {} vertices, the most that are held in memory here",
                                    options.mostTriangles, options.mostPositions));
        mesh.positions.insert(mesh.positions.end(), chunk.positions.begin(), chunk.positions.end());
        const size_t before = mesh.triangles.size();
        for (const auto& t : chunk.triangles)
            mesh.triangles.push_back({uint32_t(base + t[0]), uint32_t(base + t[1]), uint32_t(base + t[2])});
        if (options.normals) normals.add(chunk, mesh.positions.size() - base, mesh.triangles.size() - firstTriangle);
        if (options.coordinates != Coordinates::OfMaterials) addCoordinates(chunk, before, mesh);
        if (options.coordinates == Coordinates::Required && mesh.coordinates.size() != mesh.triangles.size())
            return fail(ErrorCode::InvalidInput,
                        "has no texture coordinates, which say where things go on the surface; unwrap the mesh first");
        const double size = double(stream.info().fileBytes);
        if (options.progress && !options.progress(size > 0 ? double(stream.bytesRead()) / size : 0))
            return fail(ErrorCode::Cancelled, "cancelled");
    }
}

constexpr uint64_t kMaskBytes = uint64_t{1} << 30;

Result<std::unique_ptr<MeshStream>> openCut(const std::filesystem::path& path, const LoadOptions& options) {
    MeshOpenOptions open;
    open.coordinates = options.coordinates;
    open.allowOutside = options.allowOutside;
    VCP_TRY_ASSIGN(auto stream, openMesh(path, open));
    if (!options.masks || options.coordinates != Coordinates::OfMaterials) return stream;
    return maskedStream(std::move(stream), kMaskBytes);
}

}  // namespace

Result<IndexedMesh> loadMesh(MeshStream& stream, const std::string& name, const LoadOptions& options) {
    IndexedMesh mesh;
    VCP_TRY(append(stream, name, options, mesh));
    if (mesh.triangles.empty())
        return Error{.code = ErrorCode::InvalidInput, .message = "the mesh has no triangle", .file = name};
    return mesh;
}

Result<IndexedMesh> loadMesh(const std::filesystem::path& path, const LoadOptions& options) {
    VCP_TRY_ASSIGN(const auto stream, openCut(path, options));
    return loadMesh(*stream, path.string(), options);
}

Result<IndexedMesh> loadMesh(std::span<const std::filesystem::path> paths, const LoadOptions& options) {
    IndexedMesh mesh;
    for (size_t file = 0; file < paths.size(); ++file) {
        VCP_TRY_ASSIGN(const auto stream, openCut(paths[file], options));
        VCP_TRY(append(*stream, paths[file].string(), options, mesh, file));
    }
    if (mesh.triangles.empty())
        return Error{.code = ErrorCode::InvalidInput,
                     .message = "the mesh has no triangle",
                     .file = paths.empty() ? std::string() : paths.front().string()};
    return mesh;
}

}  // namespace vcp
