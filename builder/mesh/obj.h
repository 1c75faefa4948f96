// Wavefront OBJ as a MeshStream: the statements `v`, `vn` and `f`, and, for colours, `vt`, `mtllib` and `usemtl`; all
// others are ignored.
//
// - `v x y z [w] [r g b]`: w is ignored (it weighs free-form curves only). Colours are 0..1, or 0..255 when a
//   vertex near the start of the file has a component above 1. The mesh has colours when its first vertex has
//   one; vertices without one are white then.
// - `f v v v ...`, each as v, v/t, v//n or v/t/n; numbers count from 1, negative ones back from the latest
//   vertex. Polygons become fans about their first vertex; those with fewer than three are skipped.
// - `vn x y z`: a direction of any length. Normals that a face names before they come, and such as are no numbers or 0,
//   are unknown.
// - With MeshOpenOptions::coordinates all `vt` before a face count, and materials do not.
// - Materials count when the MTL file is there (mtl.h), is named in the first 256 KiB, and has an image, or several
//   different colours. Texture coordinates that a face names before they come are 0.
// - A statement may continue in the next line after a backslash. A comment may follow on the line.
// - Faces may name vertices that come later. Whether those exist is known at the end of the file only: the
//   last next() fails if they do not. Until then no number exceeds what a file of this size could hold.
#pragma once

#include <memory>

#include "builder/stream/byte_source.h"
#include "builder/stream/mesh_stream.h"

namespace vcp {

/// Returns whether this text begins with a statement of OBJ, comments aside.
bool looksLikeObj(std::string_view start);

/// Opens an OBJ file. `source` stands at its start; `path` is where it was opened, for the MTL files beside it, or
/// empty. Errors: InvalidInput with line and byte (not a number, not finite, no such vertex, no faces), Unsupported
/// (UTF-16), Limit (a statement of more than 1 MiB), Io.
Result<std::unique_ptr<MeshStream>> openObj(ByteSource source, const std::filesystem::path& path,
                                            const MeshOpenOptions& options);

/// Opens an OBJ file without materials.
Result<std::unique_ptr<MeshStream>> openObj(ByteSource source);

}  // namespace vcp
