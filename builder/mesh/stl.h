// STL, binary and ASCII, as a MeshStream. Every facet brings three vertices of its own.
//
// Binary: an 80-byte header, a count, 50 bytes a facet; stored normals and attributes are ignored. Bytes after
// the last facet are ignored. ASCII: any number of solids, keywords in any case, white space anywhere;
// the last `endsolid` may be missing, as some exporters leave it out.
#pragma once

#include <memory>
#include <optional>
#include <string_view>

#include "builder/stream/byte_source.h"
#include "builder/stream/mesh_stream.h"

namespace vcp {

/// Returns whether this is STL beyond doubt. Either the size is exactly what the binary count says (many binary files
/// begin with "solid", so the size is checked first), or it is text that begins with "solid" and continues like STL.
/// Where the size is not known (a pipe), the first facets must be plausible. `start` holds the first 1024 bytes, or
/// all.
bool looksLikeStl(std::string_view start, std::optional<uint64_t> fileBytes);

/// Opens an STL file. `source` stands at its start. Errors: InvalidInput with facet and byte (truncated, not a number,
/// not finite, a keyword that does not belong, no facets), Limit, Io.
Result<std::unique_ptr<MeshStream>> openStl(ByteSource source);

}  // namespace vcp
