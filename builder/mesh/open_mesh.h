// Opens a mesh file of any known format.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "builder/stream/mesh_stream.h"
#include "octree/io/result.h"

namespace vcp {

/// Lists the names that MeshOpenOptions::format may have: "ply", "obj", ...
std::span<const std::string_view> meshFormats();

/// Opens a mesh by its content, then by its extension, from a file or, for "-", from standard input: PLY (ASCII,
/// binary of either byte order), OBJ, STL (ASCII, binary), OFF (ASCII, binary), glTF and GLB, Draco; each also
/// compressed with gzip or zstd. Errors: Io (missing, unreadable, a folder), InvalidInput (empty, broken header),
/// Unsupported (unknown format; the message lists what is known), Usage (no such format as the options say).
Result<std::unique_ptr<MeshStream>> openMesh(const std::filesystem::path& path, const MeshOpenOptions& options = {});

/// Replaces each folder among `paths` by the mesh files in it, recognised by extension and sorted by name; files in
/// folders inside it are not read. Errors: Io (a folder cannot be read), InvalidInput (a folder has no mesh file).
Result<std::vector<std::filesystem::path>> expandInputs(std::span<const std::filesystem::path> paths);

}  // namespace vcp
