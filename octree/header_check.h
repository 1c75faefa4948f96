// Checks what the header of a .vcp file says, before anything is read or allocated by it.
#pragma once

#include <span>
#include <string>

#include "octree/vcp_file.h"

namespace vcp {

/// Checks every field of the header that begins the file named `file`. `bytes`: its first kDirectoryOffset bytes, which
/// may be hostile. `fileBytes`: how large the file is. Errors: InvalidInput; Unsupported (version, method, flags). Each
/// names the field and its byte.
Result<void> checkHeader(const std::string& file, const FileHeader& header, std::span<const std::byte> bytes,
                         uint64_t fileBytes);

}  // namespace vcp
