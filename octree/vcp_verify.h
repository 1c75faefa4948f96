// Whether a .vcp file is intact.
#pragma once

#include <cstdint>

#include "octree/io/byte_reader.h"
#include "octree/io/result.h"

namespace vcp {

/// Reads every byte of the file and checks it, also those between pages, and that header, directory and pages say the
/// same. Calls `progress(bytes done)` now and then; it returns false to cancel. Errors: the first thing that is wrong.
Result<void> verifyFile(const ByteReader& reader, bool (*progress)(void*, uint64_t) = nullptr, void* user = nullptr);

}  // namespace vcp
