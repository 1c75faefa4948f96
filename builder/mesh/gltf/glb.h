// GLB: the container of glTF 2.0, a header and two chunks: JSON, then the first buffer.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string_view>

#include "builder/stream/byte_source.h"
#include "builder/stream/random_bytes.h"

namespace vcp {

inline constexpr std::string_view kGlbMark = "glTF";

/// Reads up to the JSON, and returns how many bytes that has. Errors: InvalidInput (not JSON, truncated), Unsupported
/// (another version), Io.
Result<uint64_t> readGlbHeader(ByteSource& source);

/// Opens the buffer that follows the JSON; null where none does. `path` is where the source was opened: a source other
/// than a plain file is spooled into `tempFolder`. Errors: Io.
Result<std::unique_ptr<RandomBytes>> openGlbBinary(ByteSource& source, const std::filesystem::path& path,
                                                   const std::filesystem::path& tempFolder);

}  // namespace vcp
