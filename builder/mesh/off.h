// OFF (Geomview's Object File Format), ASCII and binary, as a MeshStream.
//
// - The keyword may carry ST (texture coordinates), C (colours) and N (normals): their values follow the position
//   of each vertex in the order position, normal, colour, texture coordinates. Normals are directions of any length;
//   those of length 0, or that are not there, are unknown. Texture coordinates are read over. 4OFF and nOFF (other
//   dimensions) are refused.
// - ASCII: a vertex is a line, a face is a line; # begins a comment. The count of edges may be missing. Colours
//   are 0..1 when one of the vertex has a decimal point, else 0..255. The keyword may be missing.
// - Binary: 32-bit, big endian as Geomview says, or little endian as some write it: the order that makes the
//   smaller count of vertices.
// - Polygons become fans about their first vertex. Colours of faces are read over, which is a warning.
//
// This reader is ours and not OpenMesh's, which holds the mesh and refuses faces that are not manifold.
#pragma once

#include <memory>
#include <string_view>

#include "builder/stream/byte_source.h"
#include "builder/stream/mesh_stream.h"

namespace vcp {

/// Returns whether this text begins with the keyword, comments aside.
bool looksLikeOff(std::string_view start);

/// Opens an OFF file. `source` stands at its start. Errors: InvalidInput with vertex or face and byte (not a number,
/// not finite, no such vertex, truncated, no faces), Unsupported, Limit (a line of more than 1 MiB), Io.
Result<std::unique_ptr<MeshStream>> openOff(ByteSource source);

}  // namespace vcp
