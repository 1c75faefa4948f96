// A surface in memory: of a dataset, as exported, or of a mesh file.
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "builder/measure/indexed_mesh.h"
#include "viewer/export/mesh_format.h"
#include "viewer/export/surface_stream.h"

namespace vcp {

struct LoadedSurface {
    IndexedMesh mesh;
    double certified = 0;  ///< bound on the distance to the mesh that a dataset was built from, world units; a mesh: 0
    uint32_t level = 0;    ///< of a dataset
};

/// Collects a surface. Errors: those of streamMesh; Limit, where it has 2^31 vertices or triangles.
Result<LoadedSurface> loadSurface(const ByteReader& reader, const SurfaceCut& cut, const StreamOptions& options);

/// Writes a mesh as a PLY, its vertices with their distances from another surface and the colours of these: those of
/// -range and range at the ends. Errors: those of OutputFile; Limit.
Result<void> writeDistances(const IndexedMesh& mesh, std::span<const float> distances, double range,
                            const std::filesystem::path& output, const OutputRules& rules, const Notes& notes);

}  // namespace vcp
