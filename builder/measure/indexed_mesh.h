// A triangle mesh held in memory: what the measurements compare with. The build itself never holds a mesh.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "octree/result.h"

namespace vcp {

struct IndexedMesh {
    std::vector<glm::dvec3> positions;               ///< world
    std::vector<std::array<uint32_t, 3>> triangles;  ///< numbers of positions

    [[nodiscard]] std::array<glm::dvec3, 3> corners(uint64_t triangle) const {
        const auto& t = triangles[triangle];
        return {positions[t[0]], positions[t[1]], positions[t[2]]};
    }
};

/// Reads meshes through openMesh and joins them. Errors: what the readers say; InvalidInput where there is no
/// triangle; Limit at 2^32 vertices.
Result<IndexedMesh> loadMesh(std::span<const std::filesystem::path> paths);
Result<IndexedMesh> loadMesh(const std::filesystem::path& path);

}  // namespace vcp
