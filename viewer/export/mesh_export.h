// Writes the surface of a dataset as a mesh file. The file appears under its name whole (octree/io/output_file.h).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "octree/io/output_file.h"
#include "viewer/export/mesh_format.h"
#include "viewer/export/surface_stream.h"

namespace vcp {

struct MeshExportOptions {
    std::filesystem::path output;
    OutputKind kind = OutputKind::Ply;  ///< Ply, Obj, Stl or Glb
    OutputRules rules = {};
    Notes notes = {};      ///< written beside the certified distance
    double mostError = 0;  ///< the largest certified distance that is wanted, world units; 0: any
    StreamOptions stream = {};
};

struct MeshExportFigures {
    SurfaceTotals totals = {};  ///< vertices: 0 for an STL
    double certified = 0;       ///< with the rounding of positions, world units
    double rounding = 0;        ///< world units
    bool isDouble = false;      ///< whether positions are stored in double precision
    uint64_t fileBytes = 0;
    bool isTooCoarse = false;  ///< `mostError` would be exceeded: nothing was written, a finer level is needed
};

/// Exports. Blocks. On errors and cancellation nothing is left of the output. Errors: those of streamMesh and
/// OutputFile; InvalidInput, where nothing of the surface is wanted; Limit, where the format cannot count so much.
Result<MeshExportFigures> exportMesh(const ByteReader& reader, const SurfaceCut& cut, const MeshExportOptions& options);

}  // namespace vcp
