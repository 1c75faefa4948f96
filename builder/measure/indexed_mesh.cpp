#include "builder/measure/indexed_mesh.h"

#include <limits>

#include "builder/mesh/open_mesh.h"

namespace vcp {

namespace {

Result<void> append(const std::filesystem::path& path, IndexedMesh& mesh) {
    VCP_TRY_ASSIGN(auto stream, openMesh(path));
    const uint64_t base = mesh.positions.size();
    MeshChunk chunk;
    while (true) {
        VCP_TRY_ASSIGN(auto more, stream->next(chunk));
        if (!more) return {};
        if (mesh.positions.size() + chunk.positions.size() > std::numeric_limits<uint32_t>::max())
            return Error{.code = ErrorCode::Limit,
                         .message = "more vertices than a mesh in memory can number",
                         .file = path.string()};
        mesh.positions.insert(mesh.positions.end(), chunk.positions.begin(), chunk.positions.end());
        for (const auto& t : chunk.triangles)
            mesh.triangles.push_back({uint32_t(base + t[0]), uint32_t(base + t[1]), uint32_t(base + t[2])});
    }
}

}  // namespace

Result<IndexedMesh> loadMesh(std::span<const std::filesystem::path> paths) {
    IndexedMesh mesh;
    for (const auto& path : paths) VCP_TRY(append(path, mesh));
    if (mesh.triangles.empty())
        return Error{.code = ErrorCode::InvalidInput,
                     .message = "the mesh has no triangle",
                     .file = paths.empty() ? std::string() : paths.front().string()};
    return mesh;
}

Result<IndexedMesh> loadMesh(const std::filesystem::path& path) { return loadMesh(std::span(&path, 1)); }

}  // namespace vcp
