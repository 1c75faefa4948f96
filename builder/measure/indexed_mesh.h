// A triangle mesh held in memory: what the measurements compare with, and what surfaces and tiles are made from. The
// build itself never holds a mesh.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "builder/stream/mesh_stream.h"
#include "octree/io/result.h"

namespace vcp {

struct IndexedMesh {
    std::vector<glm::dvec3> positions;               ///< world
    std::vector<std::array<uint32_t, 3>> triangles;  ///< numbers of positions
    /// Texture coordinates of the triangles' corners, v growing upwards; one for each triangle, or none.
    std::vector<std::array<glm::dvec2, 3>> coordinates;
    /// The file's normals of the triangles' corners (packDirection), one for each triangle, or none.
    std::vector<std::array<uint32_t, 3>> normals = {};

    [[nodiscard]] std::array<glm::dvec3, 3> corners(uint64_t triangle) const {
        const auto& t = triangles[triangle];
        return {positions[t[0]], positions[t[1]], positions[t[2]]};
    }
};

struct LoadOptions {
    /// OfMaterials: without coordinates. IfAny: where all triangles have them. Required: else it is an error.
    Coordinates coordinates = Coordinates::OfMaterials;
    bool normals = false;  ///< whether the mesh gets its normals
    /// Whether files are cut by the masks of their materials; only without coordinates.
    bool masks = true;
    bool allowOutside = false;  ///< as in MeshOpenOptions
    uint64_t mostTriangles = std::numeric_limits<uint32_t>::max();
    uint64_t mostPositions = std::numeric_limits<uint32_t>::max();
    /// Takes the part of the file that is read, from 0 to 1; returning false cancels.
    std::function<bool(double fraction)> progress = {};
    /// Takes each chunk as it is read: what it holds beyond positions and triangles is forgotten then. `file`: its
    /// number among those that are joined.
    std::function<void(size_t file, const MeshStream& stream, const MeshChunk& chunk)> chunk = {};
};

/// Reads a mesh to its end. `name` stands for it in errors. Errors: what the reader says; InvalidInput where there is
/// no triangle, or one without coordinates that are required; Limit; Cancelled.
Result<IndexedMesh> loadMesh(MeshStream& stream, const std::string& name, const LoadOptions& options);
/// Reads a file through openMesh.
Result<IndexedMesh> loadMesh(const std::filesystem::path& path, const LoadOptions& options = {});
/// Reads meshes and joins them. Errors: Limit at 2^32 vertices.
Result<IndexedMesh> loadMesh(std::span<const std::filesystem::path> paths, const LoadOptions& options = {});

}  // namespace vcp
