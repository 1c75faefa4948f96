// Draco (.drc, and the compressed primitives of glTF) as a MeshStream.
//
// Draco decodes a mesh as a whole, in memory, and was not written for hostile bytes: it runs in a child process
// with limits on memory, processor time and waiting, which sends the mesh through a pipe. What comes out is
// checked as any file is. A decoder that crashes, or runs into a limit, is one clear error.
//
// The vertices are Draco's points: those that share a position but differ in another attribute come several times.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "builder/stream/byte_source.h"
#include "builder/stream/mesh_stream.h"

namespace vcp {

/// Which attributes to send: chosen by Draco's unique identifier, or, where `byIdentifier` is not set, the position,
/// the first colour and the first normals.
struct DracoSelection {
    bool byIdentifier = false;
    uint32_t position = 0;
    std::optional<uint32_t> colour, normal, uv;
    bool linearColour = false;  ///< colours are linear, as in glTF, and are encoded as sRGB
};

/// Gives the compressed bytes; called in the child.
using DracoBytes = std::function<Result<std::string>()>;

/// Decodes Draco's bytes. `name` and `element` are for errors; `compressedBytes` scales the time limits (8 s, and 2 s a
/// MiB). Errors: InvalidInput (no Draco data, damaged, only points), Limit (memory or time), Io.
Result<std::unique_ptr<MeshStream>> decodeDraco(const DracoBytes& bytes, uint64_t compressedBytes,
                                                const DracoSelection& selection, uint64_t memoryBytes, std::string name,
                                                std::string element);

/// Opens a .drc file; `source` stands at its start.
Result<std::unique_ptr<MeshStream>> openDraco(ByteSource source, uint64_t memoryBytes);

/// Returns whether a file begins like Draco's.
bool looksLikeDraco(std::string_view start);

}  // namespace vcp
