// PLY, ASCII and binary of either byte order, as a MeshStream.
//
// Reads the elements `vertex` (x, y, z and nx, ny, nz of any type; red, green, blue, alpha, also as diffuse_red or r,
// ...), `face` and `tristrips` (list vertex_indices or vertex_index of any types), in any order. Other elements and
// properties are skipped, lists included. The rules for rows stand in ply_rows.h.
//
// The counts of the header are compared with the size of the file before anything is read. Bytes after the
// last row are ignored: many files carry a line break or padding there. Rows are named by their number in
// the file, from 0.
#pragma once

#include <memory>

#include "builder/stream/byte_source.h"
#include "builder/stream/mesh_stream.h"

namespace vcp {

/// Opens a PLY file. `source` stands at its start. Errors: those of readPlyHeader; InvalidInput when there are no
/// vertices or no faces, a property is missing, or the file is shorter than the header says.
Result<std::unique_ptr<MeshStream>> openPly(ByteSource source);

}  // namespace vcp
